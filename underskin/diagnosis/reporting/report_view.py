"""What the page of a report shows, as sections of paragraphs, tables and figures: no HTML."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from underskin.diagnosis.reporting.caveats import caveats
from underskin.diagnosis.reporting.statements import first_and_rest, lacking_part
from underskin.diagnosis.reporting.wording import axis, error, group, interval, number, plain, readable, unit, words
from underskin.findings.formatting import in_percent
from underskin.mechanisms.registry import CATALOGUE

_VERDICTS = {
    "explained": "explained",
    "ambiguous": "several explanations remain",
    "unexplained": "something without a name is missing",
    "no_mismatch": "no mismatch",
    "insufficient_data": "too little data",
}
_NOTHING_NEXT = {
    "unexplained": "No recording can be planned for a law that is not known here. Repeat one where most of the misfit "
    "lies, to see that it comes again; then change one thing of the rig at a time."
}
_DECIDED = "Nothing more is needed for this answer: these recordings decide."
_AFTER = {
    "unexplained": "with the mechanisms that come closest, which are no explanation",
    "no_mismatch": "the same, since nothing is added",
}
_OPEN = " What they cannot tell, as listed above, stays open."
_D33 = (
    "One fit of everything to all these recordings: its 95 % interval holds what is unsure of the mechanisms, of the "
    "modulus and of the thickness. Quote it as the d33 of this campaign. The d33 that the skin's page or /v1/campaigns "
    "tells is a mean over the sensors with the model held as it was found, to compare sensors and campaigns with: "
    "value and interval differ somewhat."
)
_BY_CHANCE = (
    "By chance: how often chance alone would show so strong a dependence, corrected for the number of axes. "
    "Where that is small, the misfit depends on it."
)
_ERROR = (
    "Error: rms of measured less predicted over rms of predicted. Each group was left out whole, everything fitted and "
    "chosen again without it, and then predicted; the noise floor is what noise alone would give. Before: the model "
    "with nothing added; after: {after}."
)
_CURVE = (
    "One recording at a time, the worst explained one first. Circles are samples: of a long recording some, evenly "
    "chosen, and all beside a jump or the turn. Lines and residuals (measured less predicted) are at the means over "
    "neighbouring samples that were fitted, which grow shorter towards jumps; predictions include the zero, the drift "
    "and the gain that the fit grants the load cell of each recording. Depth is counted from the fitted contact point, "
    "force from the reading in the air. Snap-in is the first sample in contact, pull-off the last."
)
_SHARE = "; accounts for {:.0f} % of the misfit beyond noise in the recordings fitted to"
_D33_NOT_TO_QUOTE = (
    "Do not quote it: PVDF cannot have this value, or the error in the recordings is well above their noise."
)
_NO_D33 = "No d33 is given: each explanation that is left would mean another."

Report = Mapping[str, Any]


@dataclass(frozen=True)
class TextBlock:
    """A paragraph, a note in small print, or a heading within a section."""

    text: str
    kind: Literal["paragraph", "note", "heading"] = "paragraph"


@dataclass(frozen=True)
class TableBlock:
    """Rows of texts below their heads."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    kind: Literal["table"] = "table"


@dataclass(frozen=True)
class FigureBlock:
    """The place of a figure that may have been drawn; its note stands below it."""

    name: str
    note: str = ""
    kind: Literal["figure"] = "figure"


ReportBlock = TextBlock | TableBlock | FigureBlock


@dataclass(frozen=True)
class Section:
    """Blocks below a title."""

    title: str
    blocks: Sequence[ReportBlock]


@dataclass(frozen=True)
class View:
    """The verdict as a sentence and as a label, what decides how far it can be trusted, and the sections."""

    first: str
    verdict: str
    lead: str
    sections: Sequence[Section]


def view_of(report: Report) -> View:
    """One sentence, where, what, how much better, what to look at, what to measure next."""
    first, rest = first_and_rest(report["statement"])
    verdict = _VERDICTS[report["verdict"]]
    if report["verdict"] != "insufficient_data":
        verdict += f" · probability {in_percent(report['probability'])}"
    sections = (
        Section("Where", _where(report)),
        Section("What", _what(report)),
        Section("How much better", _better(report)),
        Section("Look at these recordings", _findings(report)),
        Section("What to measure next", _next(report)),
    )
    # Of what is explained the laws stand under What.
    lead = caveats(report["findings"]) if report["verdict"] == "explained" else rest
    return View(readable(first), verdict, readable(lead), sections)


def provenance_of(report: Report) -> list[tuple[str, str]]:
    """Names and values of what the report was made with."""
    return [
        (str(name), ", ".join(f"{key} {entry}" for key, entry in value.items()))
        if isinstance(value, Mapping)
        else (str(name), str(value))
        for name, value in report["provenance"].items()
    ]


def plan_of(planned: Mapping[str, Any]) -> list[ReportBlock]:
    """A report's `next_experiment` that is not empty."""
    if not planned["recordings"]:
        return _paragraphs(readable(planned["statement"]))
    heads = list(dict.fromkeys(name for entry in planned["recordings"] for name in entry))
    rows = [[plain(entry.get(name)) for name in heads] for entry in planned["recordings"]]
    chance = (
        f"Expected probability that they decide: {in_percent(planned['probability_of_deciding'])} "
        f"(without them {in_percent(planned['without_it'])}); about {planned['minutes']:g} minutes."
    )
    return [
        *_paragraphs(readable(planned["statement"])),
        TableBlock([axis(name) for name in heads], rows),
        *_paragraphs(chance),
    ]


def _where(report: Report) -> list[ReportBlock]:
    location = report["location"]
    rows = [
        (
            axis(entry["axis"]),
            "cannot be told" if entry["p_value"] is None else f"{100 * entry['p_value']:.1f} %",
            entry.get("undecidable", "") if entry["p_value"] is None else f"{entry['share_percent']:.1f} %",
        )
        for entry in location["axes"]
    ]
    blocks: list[ReportBlock] = [*_paragraphs(location["statement"]), FigureBlock("where")]
    if rows:
        heads = ("the misfit against", "by chance", "share that no other axis takes up")
        blocks += [TableBlock(heads, rows), TextBlock(_BY_CHANCE, "note")]
    return blocks


def _what(report: Report) -> list[ReportBlock]:
    blocks: list[ReportBlock] = [FigureBlock("explanations")]
    for entry in report["mechanisms"]:
        blocks += _mechanism(entry)
    blocks.append(FigureBlock("parameters"))
    if report["d33"] is not None:
        one = report["d33"]
        value = f"{number(one['value'])} ({interval(one)}) {one['unit']}"
        quotable = one.get("quotable", True)
        blocks += [
            TextBlock(f"d33 under this explanation: {value}."),
            TextBlock(_D33 if quotable else _D33_NOT_TO_QUOTE, "note"),
        ]
    elif report["fit"] is not None and "youngs_modulus" not in report["fit"]["after"]:
        blocks.append(TextBlock(_NO_D33, "note"))
    if report["alternatives"]:
        rows = [
            (" + ".join(map(words, entry["mechanisms"])), in_percent(entry["probability"]), readable(entry["why_not"]))
            for entry in report["alternatives"]
        ]
        heading = TextBlock("Alternatives, and why not", "heading")
        blocks += [heading, TableBlock(("explanation", "probability", "why not"), rows)]
    if report["not_identifiable"]:
        rows = [
            (words(entry["mechanism"]), words(entry["confounded_with"]), readable(entry["reason"]))
            for entry in report["not_identifiable"]
        ]
        heading = TextBlock("What these recordings cannot tell", "heading")
        blocks += [heading, TableBlock(("mechanism", "not told from", "because"), rows)]
    return blocks


def _mechanism(entry: Mapping[str, Any]) -> list[ReportBlock]:
    """A mechanism with its probability, its parameters and its law."""
    known = CATALOGUE.get(entry["name"])
    explains = entry["explains_percent"]
    share = "" if explains is None else _SHARE.format(explains)
    present = f"Present with probability {in_percent(entry['probability'])}{share}."
    rows = [(words(one["name"]), number(one["value"]), interval(one), unit(one["unit"])) for one in entry["parameters"]]
    law = [] if known is None else [TextBlock(f"Law: {known.law} Source: {known.source}", "note")]
    return [
        TextBlock(words(entry["name"]), "heading"),
        *_paragraphs("" if known is None else known.plain),
        TextBlock(present),
        TableBlock(("parameter", "value", "95 % interval", "unit"), rows),
        *law,
    ]


def _better(report: Report) -> list[ReportBlock]:
    fit = report["fit"]
    if fit is None:
        return []
    before, after, floor = fit["before"], fit["after"], error(fit["noise_floor_percent"])
    rows = [
        ("recordings held out", error(before["heldout_rmse_percent"]), error(after["heldout_rmse_percent"]), floor),
        ("recordings fitted to", error(before["rmse_percent"]), error(after["rmse_percent"]), ""),
    ]
    groups = [
        (
            group(entry["group"]),
            error(entry["before_rmse_percent"]),
            error(entry["after_rmse_percent"]),
            error(entry["noise_floor_percent"]),
            " + ".join(map(words, entry["chosen"])),
        )
        for entry in fit["groups"]
    ]
    heads = ("before", "after", "noise floor")
    blocks: list[ReportBlock] = [
        TableBlock(("error of", *heads), rows),
        FigureBlock("curve", _CURVE),
        FigureBlock("before_after"),
    ]
    if groups:
        blocks += [
            TextBlock("Group by group", "heading"),
            TableBlock(("left out", *heads, "chosen without it"), groups),
        ]
    return [*blocks, TextBlock(_ERROR.format(after=_AFTER.get(report["verdict"], "with what is said above")), "note")]


def _findings(report: Report) -> list[ReportBlock]:
    rows = [
        (entry["recording"] or "all", axis(entry["field"]), readable(entry["statement"]), words(entry["code"]))
        for entry in report["findings"]
    ]
    return [TableBlock(("recording", "field", "finding", "kind"), rows)] if rows else []


def _next(report: Report) -> list[ReportBlock]:
    planned = report["next_experiment"]
    if planned:
        return plan_of(planned)
    if report["verdict"] == "insufficient_data":
        return _paragraphs(f"What is lacking: {readable(lacking_part(report['statement']))}")
    decided = _DECIDED + (_OPEN if report["not_identifiable"] else "")
    return _paragraphs(_NOTHING_NEXT.get(report["verdict"], decided))


def _paragraphs(text: str) -> list[ReportBlock]:
    return [TextBlock(text)] if text else []
