"""The next measurement within the limits of the reader's rig; planned in a worker process, and not stored."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import yaml
from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import JSONResponse

from service.dependencies import DiagnosisId, PlannerInUse, Store
from service.jobs.planner import Planned, Planner
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, attachment, downloadable, file_name, numbers_of_rows
from service.pages.shared.forms import in_form_words, labels_of, number, numbers
from service.pages.shared.html import page
from service.problems import Refusal
from service.store import AnyRow, Database, campaigns, diagnoses
from service.usecases import planned_recordings
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.wording import axis, in_a_cell, readable
from underskin.errors import UnderskinError, out_of_range, required

router = APIRouter(prefix="/diagnoses/{diagnosis_id}/plan")


_HEADS = {
    "indenter_radius_mm": "sphere radius [mm]", "position_mm": "place x, y [mm]", "dwell_s": "hold [s]",
}  # fmt: skip
_LOWEST, _HIGHEST, _RECORDINGS = "lowest_preload_n", "highest_preload_n", "recordings"

# Field, words, unit, whether it takes several numbers.
FIELDS = (
    (_LOWEST, "lowest preload", "N", False),
    (_HIGHEST, "highest preload", "N", False),
    ("indenter_radius_mm", "radii of the spheres at hand", "mm", True),
    ("offset_mm", "distances from the sensor", "mm", True),
    ("dynamic_force_n", "dynamic forces of the shaker", "N", True),
    ("dwell_s", "times to hold the preload", "s", True),
    (_RECORDINGS, "recordings at most (empty: 8)", "", False),
)
_SEVERAL = tuple(name for name, _, _, many in FIELDS if many)
_LABELS = labels_of(FIELDS) | {
    "preload_n": "lowest and highest preload [N]",
    _RECORDINGS: "recordings at most",
}
_COUNT = re.compile(r"[0-9]{1,9}")
_MOST_VALUES = 8
_MOST_RECORDINGS = 50
_SURVIVES = 0.02  # less probable ones are not weighed


@dataclass(frozen=True)
class PlannedRow:
    """A planned recording: its conditions by field, the number of repeats, and how many have arrived."""

    values: Mapping[str, Any]
    repeats: int
    arrived: int

    @property
    def complete(self) -> bool:
        """Whether all have arrived."""
        return self.arrived >= self.repeats


def planned_rows(store: Database, row: AnyRow, plan: Mapping[str, Any] | None) -> list[PlannedRow]:
    """Those of a plan after the diagnosis `row`."""
    entries = (plan or {}).get("recordings", [])
    counts = store.read(planned_recordings.arrived, row, entries)
    return [
        PlannedRow(
            {name: value for name, value in planned.items() if name != "repeats" and value != []},
            planned["repeats"],
            count,
        )
        for planned, count in zip(entries, counts, strict=True)
    ]


def heads(rows: Sequence[PlannedRow]) -> dict[str, str]:
    """The table headings of the conditions."""
    return {name: _HEADS.get(name) or axis(name) for row in rows for name in row.values}


def rig_answer(store: Database, row: AnyRow, rows: Sequence[PlannedRow], number: int) -> Response:
    """The rig description of the planned recording `number`, counted from 1, with which its file can be sent."""
    if number > len(rows):
        raise Refusal(404, f"The plan has {len(rows)} recordings.")
    with store.reading() as connection:
        campaign = campaigns.find(connection, row.campaign_id)
        document = planned_recordings.rig_description(connection, campaign, rows[number - 1].values)
    content = yaml.safe_dump(document, sort_keys=False, allow_unicode=True)
    return attachment(f"rig-{number}.yaml", content, "application/yaml")


def is_undecided(report: Mapping[str, Any]) -> bool:
    """Whether a report leaves several explanations that further recordings could separate."""
    if report["verdict"] == "unexplained":
        return False
    surviving = sum(alternative["probability"] > _SURVIVES for alternative in report["alternatives"])
    return bool(report["next_experiment"]) or (report["fit"] is not None and surviving > 0)


@router.get("")
def plan(request: Request, diagnosis_id: DiagnosisId, planner: PlannerInUse, store: Store) -> Response:
    """Within the limits of the address."""
    row, name = _diagnosed(store, diagnosis_id)
    error: str | None = None
    planned: Planned | None = None
    same: same_request.SameRequest | None = None
    rows: list[PlannedRow] = []
    try:
        limits = _limits(request.query_params)
        same = _same(request, row.campaign_id, limits)
        planned = planner.plan(row, _checked(limits))
        rows = planned_rows(store, row, planned.plan)
    except UnderskinError as wrong:
        error = in_form_words(wrong, _LABELS)
    except Refusal as busy:
        error = busy.detail
    return page(
        request,
        "plan.html",
        row=row,
        campaign_name=name,
        outdated=diagnoses.outdated(row),
        excluded=row.excluded,
        limit_fields=FIELDS,
        given=request.query_params,
        error=error,
        planned=planned,
        statement=None if planned is None or not planned.plan else readable(planned.plan["statement"]),
        heads=heads(rows),
        rows=rows,
        query=request.url.query,
        same=same,
    )


@downloadable(router, "/recordings")
def recordings_csv(request: Request, diagnosis_id: DiagnosisId, planner: PlannerInUse, store: Store) -> Numbers:
    """The planned recordings, one per row, and how many of each have arrived."""
    rows = _rows_of_address(request, diagnosis_id, planner, store)
    names = list(dict.fromkeys(name for planned in rows for name in planned.values))
    cells = [{name: in_a_cell(value) for name, value in planned.values.items()} for planned in rows]
    counts = [{"repeats": planned.repeats, "arrived": planned.arrived} for planned in rows]
    joined = [values | count for values, count in zip(cells, counts, strict=True)]
    row, name = _diagnosed(store, diagnosis_id)
    return numbers_of_rows(file_name(row.skin_id, name, "plan"), [*names, "repeats", "arrived"], joined)


@router.get("/{number}/rig.yaml")
def rig_yaml(
    request: Request, diagnosis_id: DiagnosisId, planner: PlannerInUse, store: Store, number: Annotated[int, Path(ge=1)]
) -> Response:
    """The rig description of a planned recording, for sending its file."""
    rows = _rows_of_address(request, diagnosis_id, planner, store)
    return rig_answer(store, _diagnosed(store, diagnosis_id)[0], rows, number)


def _rows_of_address(request: Request, diagnosis_id: str, planner: Planner, store: Database) -> list[PlannedRow]:
    """Those of the limits in the address, once they are planned."""
    row, _ = _diagnosed(store, diagnosis_id)
    planned = planner.plan(row, _checked(_limits(request.query_params)))
    if planned.state != "done":
        raise Refusal(409, f"The plan is not there yet: its state is {planned.state}.")
    return planned_rows(store, row, planned.plan)


@router.get("/progress")
def progress(request: Request, diagnosis_id: DiagnosisId, planner: PlannerInUse, store: Store) -> Response:
    """Its progress."""
    row, _ = _diagnosed(store, diagnosis_id)
    planned = planner.plan(row, _checked(_limits(request.query_params)))
    return JSONResponse({"state": planned.state, "progress": planned.progress})


def _diagnosed(store: Database, diagnosis_id: str) -> tuple[AnyRow, str]:
    with store.reading() as connection:
        row = diagnoses.find(connection, diagnosis_id)
        name = str(campaigns.find(connection, row.campaign_id).name)
        of_curves = "curve" in diagnoses.figures_of(connection, row.number)
    if row.kind != "campaign":
        raise Refusal(404, f"Diagnosis {diagnosis_id!r} is of several campaigns: plan after the diagnosis of one.")
    if row.state != "done":
        raise Refusal(404, f"Diagnosis {diagnosis_id!r} has no report: its state is {row.state}.")
    if of_curves:
        raise Refusal(404, f"Diagnosis {diagnosis_id!r} is of curves: only recordings of FRFs are planned.")
    return row, name


def _limits(given: Mapping[str, str]) -> dict[str, Any]:
    """The fields of `RigLimits` that the form gives; raises InvalidInput."""
    limits: dict[str, Any] = {}
    ends = tuple(number(name, given[name]) for name in (_LOWEST, _HIGHEST) if given.get(name, "").strip())
    if len(ends) == 1:
        raise required("preload_n", "give both, or leave both empty")
    if ends:
        limits["preload_n"] = ends
    for name in _SEVERAL:
        values = numbers(name, given.get(name, ""))
        if len(values) > _MOST_VALUES:
            raise out_of_range(name, len(values), f"must be at most {_MOST_VALUES} numbers")
        if values:
            limits[name] = values
    count = given.get(_RECORDINGS, "").strip()
    if count:
        if not (_COUNT.fullmatch(count) and 1 <= int(count) <= _MOST_RECORDINGS):
            raise out_of_range(_RECORDINGS, count[:80], f"must be a whole number from 1 to {_MOST_RECORDINGS}")
        limits[_RECORDINGS] = int(count)
    return limits


def _checked(limits: Mapping[str, Any]) -> RigLimits:
    return RigLimits(**limits)


def _same(request: Request, campaign_id: str, limits: Mapping[str, Any]) -> same_request.SameRequest:
    """The command and the library's call with these limits."""
    options: list[str] = []
    for name, value in limits.items():
        flag = "--" + name.replace("_", "-")
        if name == "preload_n":
            options += [flag, *map(repr, value)]
        else:
            values = value if name in _SEVERAL else [value]
            options += [text for item in values for text in (flag, repr(item))]
    call = ", ".join(f"{name}={value!r}" for name, value in limits.items())
    return same_request.planned(request, campaign_id, options, call)
