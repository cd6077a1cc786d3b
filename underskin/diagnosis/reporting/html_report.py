"""The report as one HTML file that needs nothing from outside: it opens on any computer, also without a network.

Every text that comes from a campaign is escaped; the page's policy forbids whatever is not in it.
"""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import plotly.graph_objects as go
import plotly.io
from plotly.offline import get_plotlyjs

from underskin.diagnosis.reporting.caveats import caveats
from underskin.diagnosis.reporting.figures import explanations
from underskin.diagnosis.reporting.wording import axis, error, group, interval, number, plain, readable, unit, words
from underskin.formatting import in_percent
from underskin.mechanisms.registry import CATALOGUE

_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
_VERDICTS = {
    "explained": "explained",
    "ambiguous": "several explanations remain",
    "unexplained": "something without a name is missing",
    "no_mismatch": "no mismatch",
    "insufficient_data": "too little data",
}
_NOTHING_NEXT = {
    "unexplained": "No recording can be planned for a law that is not known here. Repeat one where most of the misfit "
    "lies, to see that it comes again; then change one thing of the rig at a time.",
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
_D33_NOT_TO_QUOTE = (
    "Do not quote it: PVDF cannot have this value, or the error in the recordings is well above their noise."
)
_NO_D33 = "No d33 is given: each explanation that is left would mean another."
_STYLE = """
body { font: 17px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.1rem; font-weight: 600; color: #555; margin: 0; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; font-size: 1.3rem; }
.first { font-size: 1.5rem; line-height: 1.3; margin: .4rem 0 1rem; }
.verdict { display: inline-block; border: 1px solid #555; border-radius: 1rem; padding: 0 .8rem; font-size: .95rem; }
table { border-collapse: collapse; margin: .8rem 0; font-size: .95rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e4e4e4; }
th { font-weight: 600; }
.note { color: #555; font-size: .95rem; }
.wide { overflow-x: auto; }
dt { font-weight: 600; margin-top: .6rem; } dd { margin: 0; overflow-wrap: anywhere; }
@page { margin: 14mm; }
@media print {
  body { font-size: 11pt; max-width: none; margin: 0; padding: 0; }
  h1, h2, h3, thead { break-after: avoid; }
  tr, .plotly-graph-div { break-inside: avoid; }
  .wide { overflow: visible; }
}
"""

Report = Mapping[str, Any]
Drawn = Mapping[str, str]  # HTML of each figure, by its name


def page(report: Report, figures: Mapping[str, go.Figure] | None = None) -> str:
    """The whole page; `figures` as `underskin.diagnosis.reporting.figures` makes them: a report alone has but one."""
    given = figures if figures is not None else of_report(report)
    drawn = {name: _plot(figure, name) for name, figure in given.items()}
    title = escape(f"Diagnosis of {report['campaign']}")
    body = [f"<h1>{title}</h1>", body_of(report, drawn), provenance(report)]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{_STYLE}</style>\n"
        f"{f'<script>{get_plotlyjs()}</script>' if drawn else ''}\n</head>\n<body>\n"
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def body_of(report: Report, drawn: Drawn) -> str:
    """What stands below the title, as HTML: one sentence, where, what, how much better, what to measure next."""
    first, _, rest = report["statement"].partition(". ")
    verdict = _VERDICTS[report["verdict"]]
    if report["verdict"] != "insufficient_data":
        verdict += f" · probability {in_percent(report['probability'])}"
    parts = [
        f'<p class="first">{escape(readable(first.rstrip(".")))}.</p>',
        f'<p><span class="verdict">{escape(verdict)}</span></p>',
        # Of what is explained the laws stand under What
        _paragraph(readable(caveats(report["findings"]) if report["verdict"] == "explained" else rest)),
        _section("Where", _where(report, drawn)),
        _section("What", _what(report, drawn)),
        _section("How much better", _better(report, drawn)),
        _section("Look at these recordings", _findings(report)),
        _section("What to measure next", _next(report)),
    ]
    return "\n".join(part for part in parts if part)


def provenance(report: Report) -> str:
    """With what it was made, as HTML."""
    return _section("Made with", _provenance(report))


def of_report(report: Report) -> dict[str, go.Figure]:
    """The figures that a report alone can give."""
    return {} if report["fit"] is None else {"explanations": explanations(report)}


def _where(report: Report, drawn: Drawn) -> str:
    location = report["location"]
    rows = [
        (
            axis(entry["axis"]),
            "cannot be told" if entry["p_value"] is None else f"{100 * entry['p_value']:.1f} %",
            entry.get("undecidable", "") if entry["p_value"] is None else f"{entry['share_percent']:.1f} %",
        )
        for entry in location["axes"]
    ]
    note = (
        "By chance: how often chance alone would show so strong a dependence, corrected for the number of axes. "
        "Where that is small, the misfit depends on it."
    )
    table = (
        _table(("the misfit against", "by chance", "share that no other axis takes up"), rows) + _note(note)
        if rows
        else ""
    )
    return _paragraph(location["statement"]) + _figure(drawn, "where") + table


def _what(report: Report, drawn: Drawn) -> str:
    parts = [_figure(drawn, "explanations")]
    for entry in report["mechanisms"]:
        name = entry["name"]
        known = CATALOGUE.get(name)
        explains = entry["explains_percent"]
        share = (
            ""
            if explains is None
            else f"; accounts for {explains:.0f} % of the misfit beyond noise in the recordings fitted to"
        )
        parts.append(f"<h3>{escape(words(name))}</h3>")
        parts.append(_paragraph("" if known is None else known.plain))
        parts.append(_paragraph(f"Present with probability {in_percent(entry['probability'])}{share}."))
        parts.append(
            _table(
                ("parameter", "value", "95 % interval", "unit"),
                [
                    (words(one["name"]), number(one["value"]), interval(one), unit(one["unit"]))
                    for one in entry["parameters"]
                ],
            )
        )
        parts.append("" if known is None else _note(f"Law: {known.law} Source: {known.source}"))
    parts.append(_figure(drawn, "parameters"))
    if report["d33"] is not None:
        one = report["d33"]
        parts.append(_paragraph(f"d33 under this explanation: {number(one['value'])} ({interval(one)}) {one['unit']}."))
        parts.append(_note(_D33 if one.get("quotable", True) else _D33_NOT_TO_QUOTE))
    elif report["fit"] is not None and "youngs_modulus" not in report["fit"]["after"]:
        parts.append(_note(_NO_D33))
    if report["alternatives"]:
        rows = [
            (" + ".join(map(words, entry["mechanisms"])), in_percent(entry["probability"]), readable(entry["why_not"]))
            for entry in report["alternatives"]
        ]
        parts += ["<h3>Alternatives, and why not</h3>", _table(("explanation", "probability", "why not"), rows)]
    if report["not_identifiable"]:
        rows = [
            (words(entry["mechanism"]), words(entry["confounded_with"]), readable(entry["reason"]))
            for entry in report["not_identifiable"]
        ]
        parts += [
            "<h3>What these recordings cannot tell</h3>",
            _table(("mechanism", "not told from", "because"), rows),
        ]
    return "".join(parts)


def _better(report: Report, drawn: Drawn) -> str:
    fit = report["fit"]
    if fit is None:
        return ""
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
    note = (
        "Error: rms of measured less predicted over rms of predicted. Each group was left out whole, everything fitted "
        "and chosen again without it, and then predicted; the noise floor is what noise alone would give. Before: "
        f"the model with nothing added; after: {_AFTER.get(report['verdict'], 'with what is said above')}."
    )
    parts = [_table(("error of", *heads), rows), _figure(drawn, "before_after")]
    if groups:
        parts += ["<h3>Group by group</h3>", _table(("left out", *heads, "chosen without it"), groups)]
    return "".join([*parts, _note(note)])


def _findings(report: Report) -> str:
    rows = [
        (entry["recording"] or "all", axis(entry["field"]), readable(entry["statement"]), words(entry["code"]))
        for entry in report["findings"]
    ]
    return _table(("recording", "field", "finding", "kind"), rows) if rows else ""


def _next(report: Report) -> str:
    planned = report["next_experiment"]
    if not planned:
        if report["verdict"] == "insufficient_data":
            return _paragraph(f"What is lacking: {readable(report['statement'].partition(': ')[2])}")
        decided = _DECIDED + (_OPEN if report["not_identifiable"] else "")
        return _paragraph(_NOTHING_NEXT.get(report["verdict"], decided))
    return plan_of(planned)


def plan_of(planned: Mapping[str, Any]) -> str:
    """A report's `next_experiment` that is not empty, as HTML."""
    if not planned["recordings"]:
        return _paragraph(readable(planned["statement"]))
    heads = list(dict.fromkeys(name for entry in planned["recordings"] for name in entry))
    rows = [[plain(entry.get(name)) for name in heads] for entry in planned["recordings"]]
    chance = (
        f"Expected probability that they decide: {in_percent(planned['probability_of_deciding'])} "
        f"(without them {in_percent(planned['without_it'])}); about {planned['minutes']:g} minutes."
    )
    return (
        _paragraph(readable(planned["statement"])) + _table([axis(name) for name in heads], rows) + _paragraph(chance)
    )


def _provenance(report: Report) -> str:
    rows = []
    for name, value in report["provenance"].items():
        text = ", ".join(f"{key} {entry}" for key, entry in value.items()) if isinstance(value, Mapping) else value
        rows.append(f"<dt>{escape(str(name))}</dt><dd>{escape(str(text))}</dd>")
    return f"<dl>{''.join(rows)}</dl>"


def _figure(drawn: Drawn, name: str) -> str:
    return drawn.get(name, "")


def _plot(figure: go.Figure, name: str) -> str:
    text: str = plotly.io.to_html(
        figure,
        full_html=False,
        include_plotlyjs=False,
        div_id=f"figure-{name}",
        config={"displaylogo": False, "responsive": True},
    )
    return text


def _section(title: str, content: str) -> str:
    return f"<h2>{escape(title)}</h2>\n{content}" if content else ""


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>" if text else ""


def _note(text: str) -> str:
    return f'<p class="note">{escape(text)}</p>'


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(text))}</td>' for text in row)}</tr>" for row in rows)
    return f'<div class="wide" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
