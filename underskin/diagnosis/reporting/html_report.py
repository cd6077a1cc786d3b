"""The report as one self-contained HTML file, which opens without a network.

The template says what the page shows; filters word the names and numbers of the report. All text from a campaign is
escaped, and the page's content policy forbids whatever is not in the file.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any
from urllib.parse import quote

import plotly.graph_objects as go
import plotly.io
from jinja2 import Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.reporting import wording
from underskin.diagnosis.reporting.figures import explanations, several_figures
from underskin.diagnosis.reporting.headline import first_and_rest
from underskin.diagnosis.reporting.page_styles import SCHEME
from underskin.diagnosis.reporting.statement import lacking_part
from underskin.findings.formatting import capital, in_percent
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.vocabulary import acted_on, followed
from underskin.prediction.columns import to_spreadsheet

_LIST = """
const plot = document.getElementById("{plot_id}"), {buttons} = plot.layout.updatemenus[0];
const label = document.createElement("label"), list = label.appendChild(document.createElement("select"));
label.prepend("Recording ");
for (const button of buttons) list.add(new Option(button.name));
const show = () => {
  Plotly.update(plot, ...buttons[list.selectedIndex].args);
  steps.forEach((step, index) => (step.disabled = list.selectedIndex === [0, buttons.length - 1][index]));
};
const steps = ["Previous", "Next"].map((text, index) => {
  const step = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  step.addEventListener("click", () => {
    list.selectedIndex += [-1, 1][index];
    show();
  });
  return step;
});
list.addEventListener("change", show);
steps[0].disabled = true;
Plotly.relayout(plot, {"updatemenus[0].visible": false});
plot.before(label, " ", steps[0], " ", steps[1]);
plot.style.height = `${plot.layout.height}px`;
plot.parentElement.style.height = "auto"; // its box has the height of the figure alone
"""  # replaces a figure's own menu, which the keyboard cannot open

_FILTERS = (
    *(wording.axis, wording.columns, wording.error, wording.finding, wording.group),
    *(wording.in_its_unit, wording.interval, wording.law_range, wording.not_quoted, wording.number, wording.plain),
    *(wording.quantity, wording.readable, wording.unit, wording.words),
    *(acted_on, followed, first_and_rest, in_percent, lacking_part),
)

_SCRIPTS = (SCHEME, SCHEME.with_name("narrow.js"), SCHEME.with_name("paper.js"))  # the same as on the service's pages
_OF_SUMMARY = ("frf", "curve", "where", "explanations", "population", "sensors", "before_after")
_DECLARED = (("thickness_mm", "h", "mm"), ("youngs_modulus_mpa", "E", "MPa"), ("sensor_radius_mm", "rT", "mm"))
_MOST_VALUES = 5  # of spheres or preloads, listed one by one
Report = Mapping[str, Any]
FigureHtml = Mapping[str, str]  # HTML of each figure, by its name


@cache
def _templates() -> Environment:
    loader = PackageLoader("underskin.diagnosis.reporting")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    environment.tests["search"] = lambda text, part: part in text
    environment.filters |= {function.__name__: function for function in (*_FILTERS, csv_address, of_summary)}
    environment.globals |= {"catalogue": CATALOGUE, "EXPLAINED": EXPLAINED}
    return environment


def _macros(template: str) -> Any:
    return _templates().get_template(template).module


def of_summary(drawn: FigureHtml) -> list[str]:
    """The figures of the summary, three at most, in the order of `_OF_SUMMARY`."""
    return [name for name in _OF_SUMMARY if name in drawn][:3]


def recorded_in_words(skin: Report, recordings: Iterable[Report]) -> str:
    """What was recorded: the skin's id, thickness h, modulus E and sensor radius rT, the spheres, preloads, number and
    dates of recordings; `skin` and `recordings` by the fields of a campaign, those that are unknown left out."""
    rows = list(recordings)
    parts = [f"skin {skin['id']}"] if skin.get("id") else []
    for field, symbol, unit in _DECLARED:
        parts += [f"{symbol} {skin[field]:g} {unit}"] if skin.get(field) is not None else []
    for field, name, unit in (("indenter_radius_mm", "spheres of radius", "mm"), ("preload_n", "preloads", "N")):
        values = sorted({row[field] for row in rows if row.get(field) is not None})
        shown = values if len(values) <= _MOST_VALUES else [values[0], values[-1]]
        joint = ", " if shown is values else " to "
        parts += [f"{name} {joint.join(f'{value:g}' for value in shown)} {unit}"] if values else []
    days = sorted({str(row["recorded_at"])[:10] for row in rows if row.get("recorded_at")})
    dates = "" if not days else f", {days[0]}" + (f" to {days[-1]}" if len(days) > 1 else "")
    return capital("; ".join([*parts, f"{len(rows)} recording{'' if len(rows) == 1 else 's'}{dates}"]))


def page(report: Report, figures: Mapping[str, go.Figure] | None = None, recorded: str = "") -> str:
    """The whole page; `figures` are those of `underskin.diagnosis.reporting.figures`, by default those of the report
    alone; `recorded`: the text of `recorded_in_words`."""
    given = figures if figures is not None else of_report(report)
    drawn = {name: _plot(figure, name) for name, figure in given.items()}
    scripts = (get_plotlyjs(), *(script.read_text("utf-8") for script in _SCRIPTS)) if drawn else ()
    return str(_macros("file.html").page(report, drawn, scripts, recorded))


def body_of(report: Report, drawn: FigureHtml, plan: str | None = None, recorded: str = "") -> str:
    """The page below the title, as HTML: statement, location, mechanisms, improvement, next recordings.

    `plan` is the address of the planned recordings without its suffix .csv or .xlsx; without it the CSV is in the page.
    """
    return str(_macros("report.html").body(report, drawn, plan, recorded))


def csv_address(recordings: Sequence[Mapping[str, Any]]) -> str:
    """The planned recordings as CSV in a data address, since a file has no server."""
    return f"data:text/csv;charset=utf-8,{quote(to_spreadsheet(wording.planned_columns(recordings)))}"


def provenance(report: Report) -> str:
    """The provenance of a report, as HTML."""
    return str(_macros("report.html").provenance(report["provenance"]))


def of_report(report: Report) -> dict[str, go.Figure]:
    """The figures that can be drawn from a report alone."""
    fit_figures = {} if report["fit"] is None else {"explanations": explanations(report)}
    return {**fit_figures, **several_figures(report)}


def _plot(figure: go.Figure, name: str) -> str:
    return plotly.io.to_html(
        figure,
        full_html=False,
        include_plotlyjs=False,
        div_id=f"figure-{name}",
        config={"displaylogo": False, "responsive": True},
        post_script=_LIST if figure.layout.updatemenus else None,
    )
