"""A diagnosis: requested, monitored while it runs, read, saved, adopted."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, NoReturn
from urllib.parse import quote

import orjson
import plotly.graph_objects as go
import plotly.io
from fastapi import APIRouter, Path, Request, Response
from jinja2 import UndefinedError
from markupsafe import Markup
from sqlalchemy import Connection

from service.dependencies import CampaignId, DiagnosisId, RunnerInUse, Store, Table, sender
from service.pages.plan import FIELDS, PlannedRow, heads, is_undecided, planned_rows, rig_answer
from service.pages.shared import same_request, verdicts
from service.pages.shared.downloads import Numbers, attachment, downloadable
from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, drawn_before, drawn_history, sensors_of
from service.pages.shared.forms import FORM_OF_SESSION, Form, see
from service.pages.shared.html import page, render
from service.problems import Refusal
from service.store import AnyRow, Database, Missing, campaigns, diagnoses, models, skins
from service.usecases import d33_cache
from service.usecases import diagnoses as usecase
from service.usecases.adopted_models import adopt as adopt_model
from service.usecases.skins import history_by_model
from underskin import InvalidInput
from underskin.diagnosis.data.names import EXPLAINED, in_words
from underskin.diagnosis.reporting import html_report
from underskin.diagnosis.reporting.figure_columns import columns
from underskin.diagnosis.reporting.wording import planned_columns
from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note
from underskin.findings.formatting import in_digits
from underskin.mechanisms.declared import saving
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.vocabulary import OF_SAMPLES, followed
from underskin.prediction.adopted_model import implausible_d33, not_adopted
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter()


_D33 = ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33_low_pc_per_n", "d33_high_pc_per_n")
_ABOUT_SENSOR = (
    "One recording of {sensor} with the models before and after, the worst explained one first; below, measured less "
    "predicted on the band that 95 % of the noise stays in."
)
_CAMPAIGN = re.compile(r"\bc-[0-9a-f]{16}\b")  # the id of one
_ABOUT = {
    "where": "Each cell is the mean over the recordings in it, empty where there is none.",
    "frf": "One recording with the models before and after, the worst explained one first; below, measured less "
    "predicted on the band that 95 % of the noise stays in. Before, one d33 fits all lines at once: where part of the "
    "band departs from the model, the rest may lie off it too. A double click shows residuals beyond the panel.",
    "curve": "One recording with the models before and after, the worst explained one first; below, measured less "
    "predicted on the band that 95 % of the noise stays in. A double click shows all of the air, another one the "
    "contact.",
    "before_after": "Each point a recording, or a part of its lines, both axes alike; the grey band holds 95 % of "
    "the noise.",
    "explanations": "What the recordings say of each explanation, the stated one on top.",
    "sensors": "d33 of the sensors in each campaign, the mechanisms taken into account: each with its 95 % interval, "
    "of many sensors the median, the range of 90 % and those that stand apart. They compare sensors and campaigns, "
    "with the mechanisms held as they were found; to quote, take a campaign's own diagnosis.",
    "population": "Each skin's value with its 95 % interval on the grey band in which 95 % of such skins lie.",
    "parameters": "Each parameter's most probable value and 95 % interval; next to it, what was known before.",
}
_ODD = (LookupError, TypeError, ValueError, AttributeError, UndefinedError)  # of a report that came with an import


@dataclass(frozen=True)
class ShownArray:
    """The fitted sensors, the chosen one, the figures, and the rows of its recordings."""

    sensors: list[str]
    chosen: str | None
    figures: list[Drawn]
    rows: list[dict[str, Any]]


def shown_array(
    store: Database, table: SigmaTable, row: AnyRow, texts: Mapping[str, str], sensor: str | None
) -> ShownArray | None:
    """For the diagnosis `row` of one campaign with the figures `texts`; None if it shows no FRFs of sensors."""
    if "frf" not in texts:
        return None
    figure = orjson.loads(texts["frf"])
    meta = figure["layout"]["meta"]
    sensors = sorted(set(meta["sensors"]))
    sensor = sensor if sensor in sensors else None
    campaign = store.read(campaigns.find, row.campaign_id)
    of_sensors = sensors_of(campaign, d33_cache.answer(store, table, campaign, None))
    if not of_sensors:
        return None
    figures = [_map(campaign, of_sensors, sensor)]
    if sensor is None:
        return ShownArray(sensors, None, figures, [])
    indices = [number for number, name in enumerate(meta["sensors"]) if name == sensor]
    root = store.read(skins.require_root, campaign.skin_id)
    computed = d33_cache.complete(store, table, root)
    history = drawn_history(root, history_by_model(store, table, root, "paper", computed), sensor, "paper")
    about = _ABOUT_SENSOR.format(sensor=sensor)
    frf = drawn_before("frf", _only(figure, indices), about, f"/diagnoses/{row.id}/frf.csv")
    return ShownArray(
        sensors, sensor, [*figures, replace(frf, name="frf-of-sensor"), history], _recording_rows(meta, indices)
    )


def _map(campaign: AnyRow, rows: Sequence[Mapping[str, Any]], sensor: str | None) -> Drawn:
    names, d33, uncertainty, low, high, x_mm, y_mm, reasons = columns_of(
        rows, "sensor", *_D33, "x_mm", "y_mm", "reasons"
    )
    quantity = Quantity("d33", "pC/N", intervals=tuple(zip(low, high, strict=True)))
    radius = campaign.about["skin"].get("sensor_radius_mm")
    figure = array_map(names, x_mm, y_mm, d33, uncertainty, reasons, quantity, sensor, radius)
    about = (
        f"Each sensor where it lies, coloured by its d33 by the paper's model. {disc_size(x_mm, y_mm, radius)} "
        f"{significance_note(d33, uncertainty)} {CLICK}"
    )
    return drawn("map", figure, about, f"/campaigns/{quote(campaign.id, safe='')}/d33.csv")


def _only(figure: Mapping[str, Any], numbers: list[int]) -> str:
    """The FRF figure restricted to these recordings."""
    for menu in figure["layout"].get("updatemenus", []):
        menu["buttons"] = [menu["buttons"][number] for number in numbers]
    return orjson.dumps(figure).decode()


def _recording_rows(meta: Mapping[str, Any], numbers: list[int]) -> list[dict[str, Any]]:
    """Recordings with sphere, preload and the residual of either model; figures of older versions have only the
    names."""
    columns = ("indenters_mm", "preloads_n", "left_percent")
    return [
        {"recording": meta["recordings"][number], **{name: meta[name][number] for name in columns if name in meta}}
        for number in numbers
    ]


@router.post("/campaigns/{campaign_id}/diagnosis", dependencies=[FORM_OF_SESSION])
def ask(request: Request, campaign_id: CampaignId, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Queue it; an existing diagnosis of the campaign's present state is shown."""
    row = store.write(usecase.ask, campaign_id, table, sender(request))
    runner.stir()
    return see(f"/diagnoses/{row.id}")


@router.post("/diagnoses/{diagnosis_id}/again")
def ask_again(
    request: Request, diagnosis_id: DiagnosisId, sent: Form, runner: RunnerInUse, store: Store, table: Table
) -> Response:
    """Queue the same for the campaigns' present state, without the mechanisms that the form names."""
    row = store.write(usecase.ask_again, diagnosis_id, table, sender(request), sent.get("without", "").split())
    runner.stir()
    return see(f"/diagnoses/{row.id}")


@router.get("/diagnoses/{diagnosis_id}")
def diagnosis(
    request: Request, diagnosis_id: DiagnosisId, store: Store, table: Table, sensor: str | None = None
) -> Response:
    """Its progress or its result; `sensor`: the one whose recordings and history are shown."""
    with store.reading() as connection:
        row, report, figures = _stored(connection, diagnosis_id)
        of_skin = models.of_skin(connection, skins.require_root(connection, row.skin_id))
        adopted = next((model for model in of_skin if model.id == row.id), None)
        adopted_as = None if adopted is None else verdicts.adopted_versions(connection, [adopted])[0]
        members = diagnoses.members(connection, row)
        outdated = _outdated(connection, row)
    of_campaign = row.kind == "campaign"
    not_adopted = None if report is None or not of_campaign else _not_adopted(report)
    planned = _planned(store, row, report) if report is not None and of_campaign else []
    return page(
        request,
        "diagnosis.html",
        row=row,
        name=row.name or members[0].name,
        alone=of_campaign,
        members=members,
        shown=None if report is None else _shown(row, report, figures, _recorded(store, row)),
        array=shown_array(store, table, row, figures, sensor) if of_campaign else None,
        lacks_figures=of_campaign and report is not None and report["fit"] is not None and not figures,
        outdated=outdated,
        adopted_as=adopted_as,
        in_force=adopted is not None and adopted is of_skin[0] and adopted.model_withdrawn_at is None,
        may_be_adopted=of_campaign and report is not None and not_adopted is None,
        settled=report is not None and _settled(report),
        adopts="" if report is None else _adopted_in_words(report),
        open=of_campaign and report is not None and "curve" not in figures and is_undecided(report),
        limit_fields=FIELDS,
        planned=planned,
        heads=heads(planned),
        without=in_words(diagnoses.without(row)),
        without_names=" ".join(diagnoses.without(row)),
        supposed=[] if report is None else _supposed(report, diagnoses.without(row)),
        has_law=report is not None and report.get("unnamed") is not None,
        not_kept=None if report is None else _why_not_adopted(report),
        not_adopted=not_adopted,
        same=same_request.get(request, f"/v1/diagnoses/{row.id}", f"client.diagnoses.get({row.id!r})"),
    )


def _outdated(connection: Connection, row: AnyRow) -> str | None:
    """Why it is outdated, with the names of the campaigns in place of their ids."""

    def named(match: re.Match[str]) -> str:
        try:
            return f"“{campaigns.find(connection, match[0]).name}”"
        except Missing:  # the text is user input
            return match[0]

    why = diagnoses.outdated(row)
    return None if why is None else _CAMPAIGN.sub(named, why)


@router.get("/diagnoses/{diagnosis_id}/report.html")
def one_file(diagnosis_id: DiagnosisId, store: Store) -> Response:
    """The report as a single self-contained file."""
    row, report, texts = _done(store, diagnosis_id)
    recorded = _recorded(store, row)
    try:
        figures: Mapping[str, go.Figure] | None = {name: plotly.io.from_json(text) for name, text in texts.items()}
        content = html_report.page(report, figures or None, recorded)
    except _ODD:
        _cannot_be_shown(row)
    policy = {"Content-Security-Policy": "sandbox"}  # should anything open it in place
    return attachment(f"{row.id}.html", content, "text/html; charset=utf-8", **policy)


@downloadable(router, "/diagnoses/{diagnosis_id}/planned")
def planned_csv(diagnosis_id: DiagnosisId, store: Store) -> Numbers:
    """The recordings that the report plans, one per row."""
    row, report, _ = _done(store, diagnosis_id)
    planned = (report["next_experiment"] or {}).get("recordings", [])
    if not planned:
        raise Refusal(404, f"Diagnosis {diagnosis_id!r} plans no recordings.")
    return Numbers(f"{row.id}-plan", planned_columns(planned))


@router.get("/diagnoses/{diagnosis_id}/planned/{number}/rig.yaml")
def planned_rig(diagnosis_id: DiagnosisId, number: Annotated[int, Path(ge=1)], store: Store) -> Response:
    """The rig description of a planned recording, for sending its file."""
    row, report, _ = _done(store, diagnosis_id)
    return rig_answer(store, row, _planned(store, row, report), number)


@downloadable(router, "/diagnoses/{diagnosis_id}/{figure}")
def numbers_csv(diagnosis_id: DiagnosisId, figure: str, store: Store) -> Numbers:
    """The numbers of a figure."""
    row, report, figures = _done(store, diagnosis_id)
    if figure not in _ABOUT:
        raise Refusal(404, f"There is no figure {figure!r}.")
    try:
        return Numbers(f"{row.id}-{figure}", columns(figure, report, figures))
    except _ODD:
        _cannot_be_shown(row)


@router.post("/diagnoses/{diagnosis_id}/cancel", dependencies=[FORM_OF_SESSION])
def cancel(diagnosis_id: DiagnosisId, runner: RunnerInUse, store: Store) -> Response:
    """Cancel it."""
    store.write(diagnoses.cancel, diagnosis_id)
    runner.stir()
    return see(f"/diagnoses/{quote(diagnosis_id, safe='')}")


@router.post("/diagnoses/{diagnosis_id}/adopt", dependencies=[FORM_OF_SESSION])
def adopt(request: Request, diagnosis_id: DiagnosisId, store: Store) -> Response:
    """Make it the model of its skin."""
    with store.writing() as connection:
        skin = diagnoses.find(connection, diagnosis_id).skin_id
        model = adopt_model(connection, skin, diagnosis_id, sender(request))
    return see(f"/skins/{quote(model.model_skin_id, safe='')}?model=adopted")


def _planned(store: Database, row: AnyRow, report: Mapping[str, Any]) -> list[PlannedRow]:
    try:
        return planned_rows(store, row, report["next_experiment"])
    except _ODD:
        _cannot_be_shown(row)


def _supposed(report: Mapping[str, Any], without: Sequence[str]) -> list[tuple[str, str]]:
    """Catalogue mechanisms that could be excluded from another diagnosis, in words, and the complete list of those
    excluded then."""
    named = [name for name in verdicts.mechanisms_of(report) if name in CATALOGUE]
    return [(in_words([name]), " ".join([*without, name])) for name in dict.fromkeys(named)]


def _why_not_adopted(report: Mapping[str, Any]) -> str | None:
    """Why the law of a report cannot become a mechanism of the lab's own; None if it can."""
    try:
        saving.document(report, "kept")
    except InvalidInput as refusal:
        return refusal.allowed.removesuffix(": it cannot be kept")  # as stated on the page
    return None


def _not_adopted(report: Mapping[str, Any]) -> str | None:
    """Why a report cannot become a model, and what to do; None if it can."""
    why_not = not_adopted(report)
    law = report.get("unnamed")
    if (why_not is None and report["d33"] is None) or (law is not None and law["axis"] in OF_SAMPLES):
        return "it is of curves, which have no d33: a model of a skin is of FRFs"
    if why_not is None:
        reason = implausible_d33(report, units_checked=True)  # whether they are is asked on adoption
        return None if reason is None else f"its d33 cannot be right: {reason}"
    return why_not


def _settled(report: Mapping[str, Any]) -> bool:
    """Whether one answer has 80 % of the probability: an explanation, or one form of an unlisted law."""
    law = report.get("unnamed")
    share = 1.0 if law is None else law["probability"]
    return report["verdict"] in ("explained", "unexplained") and report["probability"] * share >= EXPLAINED


def _adopted_in_words(report: Mapping[str, Any]) -> str:
    """What an adopted report adds to the paper's model: "contact resonance of the rig"."""
    law = ["the law over " + followed(report["unnamed"]["axis"])] if report.get("unnamed") else []
    mechanisms = [
        in_words([mechanism["name"]])
        + (f" of the {mechanism['of']}" if mechanism.get("of") in ("rig", "chain") else "")
        for mechanism in report["mechanisms"]
    ]
    return " and ".join([*mechanisms, *law]) or "the paper's model"


def _stored(connection: Connection, diagnosis_id: str) -> tuple[AnyRow, dict[str, Any] | None, dict[str, str]]:
    row = diagnoses.find(connection, diagnosis_id)
    return row, diagnoses.report_of(connection, row.number), diagnoses.figures_of(connection, row.number)


def _done(store: Database, diagnosis_id: str) -> tuple[AnyRow, dict[str, Any], dict[str, str]]:
    row, report, figures = store.read(_stored, diagnosis_id)
    if report is None:
        raise Refusal(404, f"Diagnosis {diagnosis_id!r} has no report: its state is {row.state}.")
    return row, report, figures


def _recorded(store: Database, row: AnyRow) -> str:
    """What the diagnosed recordings are of; empty for several campaigns, which the page lists."""
    if row.kind != "campaign":
        return ""
    with store.reading() as connection:
        campaign = campaigns.find(connection, row.campaign_id)
        used = [one for one in campaigns.recordings_of(connection, campaign.number) if one.excluded_at is None]
    skin = {**campaign.about["skin"], "id": row.skin_id}
    return html_report.recorded_in_words(skin, [{**one.scalars, "recorded_at": one.recorded_at} for one in used])


def _shown(row: AnyRow, report: Mapping[str, Any], texts: Mapping[str, str], recorded: str) -> tuple[Markup, Markup]:
    """The report in the words of the file, with the page's figures, and its origin."""
    try:
        figures = _drawn(row, report, texts)
        html = {name: render("figure.html", drawn=figure) for name, figure in figures.items()}
        body = html_report.body_of(report, html, f"/diagnoses/{row.id}/planned", recorded)
        provenance = html_report.provenance(report)
    except _ODD:
        _cannot_be_shown(row)
    return Markup(body), Markup(provenance)  # noqa: S704 -- every text in them is escaped where they are made


def _drawn(row: AnyRow, report: Mapping[str, Any], texts: Mapping[str, str]) -> dict[str, Drawn]:
    def numbers(name: str) -> str:
        return f"/diagnoses/{row.id}/{name}.csv"

    if texts:
        return {
            name: drawn_before(name, texts[name], _about(name, texts[name]), numbers(name))
            for name in _ABOUT
            if name in texts
        }
    return {
        name: drawn(name, figure, _ABOUT[name], numbers(name)) for name, figure in html_report.of_report(report).items()
    }


def _about(name: str, text: str) -> str:
    """The description of a figure; for the map of the misfit also of the quantity drawn."""
    if name != "where":
        return _ABOUT[name]
    layout = orjson.loads(text)["layout"]
    axes = [layout[axis]["title"].get("text", "") for axis in ("xaxis", "yaxis")]
    sentences = [_ABOUT[name]]
    if any(title.startswith("frequency") for title in axes):
        sentences.append("Steps of frequency are even in its logarithm.")
    if any(title.startswith("displacement") for title in axes):
        sentences.append(
            "The displacement is that of the file; the curve's figure counts depth from the contact point."
        )
    if layout.get("shapes"):
        sentences.append("The outlined region holds most of the misfit.")
    if "noise_percent" in layout.get("meta", {}):
        noise = in_digits(layout["meta"]["noise_percent"], 2)
        sentences.append(
            f"95 % of the noise of a point, which is a recording or a part of its lines, stays within ±{noise} %, in "
            "percent of what is predicted there; the colours reach twice as far, or farther."
        )
    return " ".join(sentences)


def _cannot_be_shown(row: AnyRow) -> NoReturn:
    raise Refusal(422, f"The report of diagnosis {row.id!r} came with an import and lacks what a page shows.") from None
