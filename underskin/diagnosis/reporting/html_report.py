"""The report as one HTML file that needs nothing from outside: it opens on any computer, also without a network.

`report_view` says what the page shows, the template makes HTML of it. Every text that comes from a campaign is escaped;
the page's policy forbids whatever is not in it.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

import plotly.graph_objects as go
import plotly.io
from jinja2 import Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from underskin.diagnosis.reporting import report_view
from underskin.diagnosis.reporting.figures import explanations
from underskin.diagnosis.reporting.report_view import Report

_LIST = """
const plot = document.getElementById("{plot_id}"), {buttons} = plot.layout.updatemenus[0];
const label = document.createElement("label"), list = label.appendChild(document.createElement("select"));
label.prepend("Recording ");
for (const button of buttons) list.add(new Option(button.name));
list.addEventListener("change", () => Plotly.update(plot, ...buttons[list.selectedIndex].args));
Plotly.relayout(plot, {"updatemenus[0].visible": false});
plot.before(label);
"""  # stands in for a figure's own menu, which only a pointer can open

FigureHtml = Mapping[str, str]  # HTML of each figure, by its name


@cache
def _macros() -> Any:
    loader = PackageLoader("underskin.diagnosis.reporting")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    return environment.get_template("report.html").module


def page(report: Report, figures: Mapping[str, go.Figure] | None = None) -> str:
    """The whole page; `figures` as `underskin.diagnosis.reporting.figures` makes them: a report alone has but one."""
    given = figures if figures is not None else of_report(report)
    drawn = {name: _plot(figure, name) for name, figure in given.items()}
    title = f"Diagnosis of {report['campaign']}"
    entries = report_view.provenance_of(report)
    script = get_plotlyjs() if drawn else ""
    return str(_macros().page(title, report_view.view_of(report), drawn, entries, script))


def body_of(report: Report, drawn: FigureHtml) -> str:
    """What stands below the title, as HTML: one sentence, where, what, how much better, what to measure next."""
    return str(_macros().body(report_view.view_of(report), drawn))


def provenance(report: Report) -> str:
    """With what it was made, as HTML."""
    return str(_macros().provenance(report_view.provenance_of(report)))


def plan_of(planned: Mapping[str, Any]) -> str:
    """A report's `next_experiment` that is not empty, as HTML."""
    return str(_macros().blocks(report_view.plan_of(planned), {}))


def of_report(report: Report) -> dict[str, go.Figure]:
    """The figures that a report alone can give."""
    return {} if report["fit"] is None else {"explanations": explanations(report)}


def _plot(figure: go.Figure, name: str) -> str:
    text: str = plotly.io.to_html(
        figure,
        full_html=False,
        include_plotlyjs=False,
        div_id=f"figure-{name}",
        config={"displaylogo": False, "responsive": True},
        post_script=_LIST if figure.layout.updatemenus else None,
    )
    return text
