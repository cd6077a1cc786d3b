"""Finished diagnoses, and the models adopted from them, in a skin's export: written, checked, and imported.

Pending diagnoses are not exported, nor those that include campaigns of other skins, which the file lacks. Figures
derived with models are computed again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, StringConstraints
from sqlalchemy import Connection, Table, insert, select

from service.schemas.diagnoses import DiagnosisKind
from service.schemas.report import Verdict
from service.store import diagnosed_together, skins
from service.store.codec import compressed, decompressed
from service.store.diagnosed_together import Member, Together
from service.store.engine import Database, holds
from service.store.import_checks import ImportedRow, Time
from service.store.tables import AnyRow, campaigns, diagnoses, models
from underskin.prediction.adopted_model import not_adopted

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


class _AnyReport(BaseModel):
    """The fields of every report that are checked; the rest is passed through."""

    document: Literal["report/1"] = Field(alias="schema")
    verdict: Verdict
    probability: Share
    statement: str
    mechanisms: list[_Mechanism]
    alternatives: list[_Alternative]
    fit: dict[str, Any] | None
    provenance: dict[str, Any]


class _Report(_AnyReport):
    """For a report on one campaign also d33, because a model of the skin may be adopted from it."""

    d33: _D33 | None


class MemberRow(ImportedRow):
    """A row of diagnosed_campaigns."""

    campaign_id: Id
    skin_id: Id
    excluded: int = Field(ge=0)


class DiagnosisRow(ImportedRow):
    """A row of diagnoses."""

    id: Annotated[str, StringConstraints(pattern=r"^d-[0-9a-f]{16}$")]
    excluded: int = Field(ge=0)
    table_sha256: Text
    version: Text
    without: Annotated[str, StringConstraints(max_length=4000, pattern=r'^\[("[a-z0-9_]+"(, "[a-z0-9_]+")*)?\]$')] = (
        "[]"
    )
    own_sha256: Text = ""  # older files have neither, nor the next four
    kind: DiagnosisKind = "campaign"
    name: Text | None = None
    members: list[MemberRow] = Field(default_factory=list)  # of several campaigns, in order
    all_of: list[Id] = Field(default_factory=list)  # the skins of which they are all
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
    """Diagnoses and models of an export that are consistent."""

    diagnoses: Sequence[DiagnosisRow]
    models: Sequence[ModelRow]


def exported(connection: Connection, root: str) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Diagnoses and models of a skin and of those joined to it, as an export has them."""
    of_skin = skins.members(root)
    query = _DIAGNOSES.where(campaigns.c.skin_id.in_(of_skin), diagnoses.c.state.in_(_ENDED))
    query = query.where(
        ~diagnosed_together.has_other_than(select(campaigns.c.number).where(campaigns.c.skin_id.in_(of_skin)))
    )
    entries = [_diagnosis(connection, row) for row in connection.execute(query.order_by(diagnoses.c.number)).all()]
    query = _MODELS.where(models.c.skin_id.in_(of_skin))
    return entries, [_model(row) for row in connection.execute(query.order_by(models.c.number))]


def checked(
    diagnosed: Sequence[Mapping[str, Any]], adopted: Sequence[Mapping[str, Any]], campaign_ids: Sequence[str],
    skin_ids: Sequence[str],
) -> Checked:  # fmt: skip
    """The rows of an export; raises pydantic's ValidationError, or KeyError for a reference to a missing row."""
    rows = [DiagnosisRow.model_validate(row) for row in diagnosed]
    model_rows = [ModelRow.model_validate(row) for row in adopted]
    for row in rows:
        of_campaigns = [row.campaign_id, *(member.campaign_id for member in row.members)]
        if not set(of_campaigns) <= set(campaign_ids):
            raise KeyError(f"diagnosis {row.id}: campaign {row.campaign_id}")
        _require_complete(row, skin_ids)
        if (row.state == "done") != (row.report is not None):
            raise KeyError(f"diagnosis {row.id}: report")
        kind = _Report if row.kind == "campaign" else _AnyReport
        if row.report is not None and kind.model_validate(row.report).verdict != row.verdict:
            raise KeyError(f"diagnosis {row.id}: verdict")
    single_campaigns = [row for row in rows if row.kind == "campaign"]
    explained = {
        row.id for row in single_campaigns if row.report and not_adopted(row.report) is None and row.report["d33"]
    }
    for model in model_rows:
        if model.diagnosis_id not in explained or model.skin_id not in set(skin_ids):
            raise KeyError(f"model {model.id}")
        if (model.withdrawn_at is None) != (model.withdraw_reason is None):
            raise KeyError(f"model {model.id}: withdraw_reason")
    return Checked(rows, model_rows)


def _require_complete(row: DiagnosisRow, skin_ids: Sequence[str]) -> None:
    """Check that what a diagnosis says of several campaigns is consistent; raises KeyError."""
    several = row.kind != "campaign"
    if several != (len(row.members) > 1) or several != (row.name is not None) or (row.all_of and not several):
        raise KeyError(f"diagnosis {row.id}: members")
    if not {*row.all_of, *(member.skin_id for member in row.members)} <= set(skin_ids):
        raise KeyError(f"diagnosis {row.id}: skins of its members")
    if several and row.campaign_id not in {member.campaign_id for member in row.members}:
        raise KeyError(f"diagnosis {row.id}: campaign {row.campaign_id}")


def stored_ids(connection: Connection, file: Checked) -> set[str]:
    """Ids of those diagnoses and models that are in the store, identical or not."""
    ids = {row.id for row in file.diagnoses if holds(connection, diagnoses, id=row.id)}
    return ids | {row.id for row in file.models if holds(connection, models, id=row.id)}


def clashes(connection: Connection, file: Checked) -> list[str]:
    """Diagnoses and models that are in the store and differ."""
    sentences = []
    for row in file.diagnoses:
        there = connection.execute(_DIAGNOSES.where(diagnoses.c.id == row.id)).first()
        if there is not None and _diagnosis(connection, there) != row.model_dump():
            sentences.append(f"Diagnosis {row.id!r} is there already and differs")
    for model in file.models:
        same = (models.c.id == model.id) | ((models.c.skin_id == model.skin_id) & (models.c.version == model.version))
        if any(_model(there) != model.model_dump() for there in connection.execute(_MODELS.where(same))):
            sentences.append(f"Model {model.version} of skin {model.skin_id!r} is there already and differs")
    return sentences


def add(store: Database, file: Checked) -> None:
    """Store what is missing; the skins and campaigns are stored already."""
    with store.writing() as connection:
        for row in file.diagnoses:
            if not holds(connection, diagnoses, id=row.id):
                _add(connection, row)
        for model in file.models:
            if not holds(connection, models, id=model.id):
                values = model.model_dump(exclude={"diagnosis_id"})
                values["diagnosis"] = _number(connection, diagnoses, model.diagnosis_id)
                connection.execute(insert(models), values)


def _add(connection: Connection, row: DiagnosisRow) -> None:
    values = row.model_dump(exclude={"campaign_id", "report", "members", "all_of"})
    values["campaign"] = _number(connection, campaigns, row.campaign_id)
    values["report"] = None if row.report is None else compressed(row.report)
    if row.name is None:
        connection.execute(insert(diagnoses), values)
        return
    members = [
        Member(
            _number(connection, campaigns, member.campaign_id), member.campaign_id, "", member.skin_id, member.excluded
        )
        for member in row.members
    ]
    together = Together(row.kind, row.name, members, row.all_of)
    connection.execute(insert(diagnoses), {**values, "together_sha256": together.sha256})
    diagnosed_together.keep(connection, _number(connection, diagnoses, row.id), together)


def _number(connection: Connection, table: Table, name: str) -> int:
    return int(connection.execute(select(table.c.number).where(table.c.id == name)).scalar_one())


def _diagnosis(connection: Connection, row: AnyRow) -> dict[str, Any]:
    """The row of an export from that of the store."""
    members = diagnosed_together.members_of(connection, [row.number]).get(row.number, [])
    several = {
        "members": [{name: getattr(member, name) for name in MemberRow.model_fields} for member in members],
        "all_of": diagnosed_together.all_of(connection, row.number),
        "report": None if row.report is None else decompressed(row.report),
    }
    return {name: several[name] if name in several else getattr(row, name) for name in DiagnosisRow.model_fields}


def _model(row: AnyRow) -> dict[str, Any]:
    return {name: getattr(row, name) for name in ModelRow.model_fields}
