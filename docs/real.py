"""`python -m docs.real`: diagnose the open real recordings and write docs/real.md with a figure of each.

The recordings, what their owners say of them, and the judge are in the folder `real` of `UNDERSKIN_RECORDINGS`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from proof.ledger.campaigns import PARTS, Real
from underskin.diagnosis import pipeline
from underskin.diagnosis.reporting.facts import Facts
from underskin.diagnosis.reporting.figure_data import ShownCurve, shown_curves
from underskin.diagnosis.reporting.report import report
from underskin.errors import UnderskinError
from underskin.recordings.reading import read_file
from underskin.recordings.rig_description import parse
from underskin.surrogate.sigma_table import load_table

_DOCS = Path(__file__).parent
_STYLE = _DOCS / "figures.mplstyle"
_WORDS = {  # of the judge, the misses first
    "confidently wrong": "wrong at 95 % or more",
    "wrong": "wrong",
    "refused": "refused",
    "honest, E off": "left open, E off",
    "partly": "in part",
    "right, E off": "right, E off",
    "honest": "left open",
    "right: no listed law": "rightly no listed law",
    "right": "right",
}
_HEAD = """# Real recordings

What `underskin diagnose` says of {count} recordings of other laboratories, beside what their owners or a textbook fit
say. `make real` writes this page and its figures; the recordings are public, from the repositories named. The worst
come first. *Right* is the physics that the owner names, or rightly none, with E in the owner's range or the owner's in
its interval. Held out: the root mean square error on parts of the curves that the fit had not seen, before and after,
in percent of the measured force.

{summary}

| recording | owner | underskin | E, MPa: owner | underskin (95 %) | held out, before → after | judged |
|---|---|---|---|---|---|---|
{rows}
"""
_SECTION = """
## {name}

{truth}. Source: {source}.

> {statement}

{figure}
"""


@dataclass(frozen=True)
class Diagnosed:
    """One recording: its truth, the report, the judge's word, and its curve where there is a fit."""

    name: str
    truth: Mapping[str, Any]
    report: Mapping[str, Any]
    word: str
    curve: ShownCurve | None


def main() -> None:
    """Write docs/real.md and docs/figures/real-*.svg."""
    diagnosed = sorted(map(_diagnosed, cast(list[Real], PARTS["real"]())), key=lambda one: [*_WORDS].index(one.word))
    for one in diagnosed:
        if one.curve is not None:
            _draw(one.curve, _DOCS / "figures" / f"real-{one.name}.svg")
    (_DOCS / "real.md").write_text(_page(diagnosed), encoding="utf-8")


def _diagnosed(item: Real) -> Diagnosed:
    facts = item.recorded_truth
    contents = {one["name"]: bytes.fromhex(one["content"]) for one in item.documents()}
    (name,) = facts["files"]
    try:
        rig = parse(contents[facts["rig"]], facts["rig"]) if facts["rig"] else None
        reading = read_file(contents[name], name, rig)
    except UnderskinError as error:
        refusal = {"verdict": "refused", "statement": str(error)}
        return Diagnosed(item.name, facts, refusal, item.word(None), None)
    result = pipeline.with_refused(pipeline.diagnose(reading.campaign, load_table()), reading.problems)
    document, curve = report(result), None
    if result.search is not None and result.curves is not None:
        shown = Facts(result)
        curve = shown_curves(shown.problem, result.curves, shown.base, shown.shown)[0]
    return Diagnosed(item.name, facts, document, item.word(document), curve)


def _page(diagnosed: Iterable[Diagnosed]) -> str:
    sections, rows, counts = [], [], dict.fromkeys(_WORDS, 0)
    for one in diagnosed:
        counts[one.word] += 1
        fit = one.report.get("fit") or {}
        low, high = one.truth["ranges"].get("youngs_modulus", (None, None))
        modulus = (fit.get("after") or {}).get("youngs_modulus")
        cells = (
            f"[{one.name}](#{one.name.lower()})",
            one.truth["truth"],
            f"`{one.report['verdict']}` {_percent(one.report.get('probability'))} {_named(one.report)}",
            "" if low is None else f"{low:.3g} to {high:.3g}",
            "" if modulus is None else f"{modulus['value']:.3g} ({_end(modulus['low'])} to {_end(modulus['high'])})",
            _held_out(fit),
            _WORDS[one.word],
        )
        rows.append("| " + " | ".join(cells) + " |")
        drawn = "" if one.curve is None else f"![Measured, base model and answer](figures/real-{one.name}.svg)"
        sections.append(
            _SECTION.format(
                name=one.name,
                truth=one.truth["truth"][:1].upper() + one.truth["truth"][1:],
                source=one.truth["source"],
                statement=one.report["statement"],
                figure=drawn,
            )
        )
    summary = ", ".join(f"{count} {_WORDS[word]}" for word, count in counts.items() if count)
    head = _HEAD.format(count=len(rows), summary=f"{summary}.", rows="\n".join(rows))
    return (head + "".join(sections)).rstrip() + "\n"


def _percent(probability: float | None) -> str:
    return "" if probability is None else f"{100 * probability:.0f} %"


def _named(document: Mapping[str, Any]) -> str:
    return ", ".join(f"`{mechanism['name']}`" for mechanism in document.get("mechanisms") or ())


def _end(value: float | None) -> str:
    return "open" if value is None else f"{value:.3g}"


def _held_out(fit: Mapping[str, Any]) -> str:
    errors = [(fit.get(name) or {}).get("heldout_rmse_percent") for name in ("before", "after")]
    return "" if None in errors else " → ".join(f"{error:.2g} %" for error in errors)


def _draw(curve: ShownCurve, path: Path) -> None:
    """Force against displacement: measured, by the base model, and by the answer."""
    with mpl.rc_context(cast(Any, {"font.size": 8, "svg.hashsalt": path.stem}), fname=_STYLE):
        figure = Figure(figsize=(4.6, 2.6), layout="constrained")
        axes = figure.subplots()
        unit, name = (1.0, "N") if np.abs(curve.sample_n).max() > 0.1 else (1e6, "µN")
        axes.plot(curve.sample_mm, unit * curve.sample_n, ".", ms=2, color="0.55", label="measured")
        for role, style, label in (("before", "--", "simplest model"), ("after", "-", "answer")):
            axes.plot(curve.displacement_mm, unit * curve.predicted_n[role], style, lw=1, label=label)
        axes.set_xlabel("displacement, mm")
        axes.set_ylabel(f"force, {name}")
        axes.legend(fontsize=7)
        figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    main()
