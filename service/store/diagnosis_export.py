"""Diagnoses that have ended, and the models adopted from them, in a skin's export: out, checked, and in.

What waits or runs stays behind: it is asked for again elsewhere. Figures derived with models are computed again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, StringConstraints
from sqlalchemy import Connection, Table, insert, select

from service.schemas.diagnoses import Verdict
from service.store import skins
from service.store.codec import compressed, decompressed
from service.store.engine import Database, holds
from service.store.import_checks import ImportedRow, Time
from service.store.tables import AnyRow, campaigns, diagnoses, models

Text = Annotated[str, StringConstraints(max_length=4000)]
Id = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^/\x00-\x1f]+$")]

Share = Annotated[float, Field(ge=0, le=1, strict=False)]
Number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=False)]

_ENDED = ("done", "failed", "cancelled")
_DIAGNOSES = select(diagnoses, campaigns.c.id.label("campaign_id")).join(campaigns)
_MODELS = select(models, diagnoses.c.id.label("diagnosis_id")).join(diagnoses)


class _Parameter(BaseModel):
    name: str
    value: Number
    low: Number
    high: Number


class _Mechanism(BaseModel):
    name: str
    probability: Share
    parameters: list[_Parameter]


class _Alternative(BaseModel):
    mechanisms: list[str]
    probability: Share


class _D33(BaseModel):
    low: Positive
    high: Positive


class _Report(BaseModel):
    """What is read again of a report; the rest is handed on."""

    document: Literal["report/1"] = Field(alias="schema")
    verdict: Verdict
    probability: Share
    statement: str
    mechanisms: list[_Mechanism]
    alternatives: list[_Alternative]
    fit: dict[str, Any] | None
    d33: _D33 | None
    provenance: dict[str, Any]


class DiagnosisRow(ImportedRow):
    """A row of diagnoses."""

    id: Annotated[str, StringConstraints(pattern=r"^d-[0-9a-f]{16}$")]
    excluded: int = Field(ge=0)
    table_sha256: Text
    version: Text
    without: Annotated[str, StringConstraints(max_length=4000, pattern=r'^\[("[a-z0-9_]+"(, "[a-z0-9_]+")*)?\]$')] = (
        "[]"
    )
    own_sha256: Text = ""  # older files have neither
    state: Literal["done", "failed", "cancelled"]
    progress: Share
    asked_at: Time
    asked_from: Text | None
    started_at: Time | None
    ended_at: Time
    reason: Text | None
    verdict: Text | None
    probability: Share | None
    campaign_id: Id
    report: dict[str, Any] | None


class ModelRow(ImportedRow):
    """A row of models."""

    id: Annotated[str, StringConstraints(pattern=r"^m-[0-9a-f]{16}$")]
    skin_id: Id
    version: int = Field(ge=1)
    adopted_at: Time
    adopted_from: Text | None
    withdrawn_at: Time | None = None  # which older files do not have, nor the next two
    withdrawn_from: Text | None = None
    withdraw_reason: Text | None = None
    diagnosis_id: Id


@dataclass(frozen=True)
class Checked:
    """Diagnoses and models of an export that hold together."""

    diagnoses: Sequence[DiagnosisRow]
    models: Sequence[ModelRow]


def exported(connection: Connection, root: str) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Diagnoses and models of a skin and of those joined to it, as an export has them."""
    of_skin = skins.members(root)
    query = _DIAGNOSES.where(campaigns.c.skin_id.in_(of_skin), diagnoses.c.state.in_(_ENDED))
    entries = [_diagnosis(row) for row in connection.execute(query.order_by(diagnoses.c.number))]
    query = _MODELS.where(models.c.skin_id.in_(of_skin))
    return entries, [_model(row) for row in connection.execute(query.order_by(models.c.number))]


def checked(
    diagnosed: Sequence[Mapping[str, Any]], adopted: Sequence[Mapping[str, Any]], campaign_ids: Sequence[str],
    skin_ids: Sequence[str],
) -> Checked:  # fmt: skip
    """The rows of an export; raises pydantic's ValidationError, or KeyError where one refers to what is not there."""
    rows = [DiagnosisRow.model_validate(row) for row in diagnosed]
    model_rows = [ModelRow.model_validate(row) for row in adopted]
    for row in rows:
        if row.campaign_id not in set(campaign_ids):
            raise KeyError(f"diagnosis {row.id}: campaign {row.campaign_id}")
        if (row.state == "done") != (row.report is not None):
            raise KeyError(f"diagnosis {row.id}: report")
        if row.report is not None and _Report.model_validate(row.report).verdict != row.verdict:
            raise KeyError(f"diagnosis {row.id}: verdict")
    explained = {row.id for row in rows if row.verdict == "explained" and row.report and row.report["d33"]}
    for model in model_rows:
        if model.diagnosis_id not in explained or model.skin_id not in set(skin_ids):
            raise KeyError(f"model {model.id}")
        if (model.withdrawn_at is None) != (model.withdraw_reason is None):
            raise KeyError(f"model {model.id}: withdraw_reason")
    return Checked(rows, model_rows)


def known(connection: Connection, file: Checked) -> set[str]:
    """Ids of those diagnoses and models that are in the store, the same or not."""
    found = {row.id for row in file.diagnoses if holds(connection, diagnoses, id=row.id)}
    return found | {row.id for row in file.models if holds(connection, models, id=row.id)}


def clashes(connection: Connection, file: Checked) -> list[str]:
    """Which diagnoses and versions of models are there already and differ."""
    sentences = []
    for row in file.diagnoses:
        there = connection.execute(_DIAGNOSES.where(diagnoses.c.id == row.id)).first()
        if there is not None and _diagnosis(there) != row.model_dump():
            sentences.append(f"Diagnosis {row.id!r} is there already and differs")
    for model in file.models:
        same = (models.c.id == model.id) | ((models.c.skin_id == model.skin_id) & (models.c.version == model.version))
        if any(_model(there) != model.model_dump() for there in connection.execute(_MODELS.where(same))):
            sentences.append(f"Model {model.version} of skin {model.skin_id!r} is there already and differs")
    return sentences


def add(store: Database, file: Checked) -> None:
    """Keep what is not there; the skins and campaigns are."""
    with store.writing() as connection:
        for row in file.diagnoses:
            if not holds(connection, diagnoses, id=row.id):
                values = row.model_dump(exclude={"campaign_id", "report"})
                values["campaign"] = _number(connection, campaigns, row.campaign_id)
                values["report"] = None if row.report is None else compressed(row.report)
                connection.execute(insert(diagnoses), values)
        for model in file.models:
            if not holds(connection, models, id=model.id):
                values = model.model_dump(exclude={"diagnosis_id"})
                values["diagnosis"] = _number(connection, diagnoses, model.diagnosis_id)
                connection.execute(insert(models), values)


def _number(connection: Connection, table: Table, name: str) -> int:
    return int(connection.execute(select(table.c.number).where(table.c.id == name)).scalar_one())


def _diagnosis(row: AnyRow) -> dict[str, Any]:
    values = {name: getattr(row, name) for name in DiagnosisRow.model_fields}
    return values | {"report": None if row.report is None else decompressed(row.report)}


def _model(row: AnyRow) -> dict[str, Any]:
    return {name: getattr(row, name) for name in ModelRow.model_fields}
