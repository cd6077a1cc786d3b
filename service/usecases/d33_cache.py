"""d33 of stored campaigns, computed once for each state of a campaign and cached in the store."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Literal

import numpy as np
import orjson
from sqlalchemy import Connection
from sqlalchemy.exc import OperationalError

from service.log import logger
from service.problems import Refusal
from service.schemas.campaign_d33 import D33, D33Value
from service.store import AnyRow, Conflict, Database, StorageFailed, StoreMoved, campaigns, inversions
from service.usecases import figure_data
from service.usecases.adopted_models import ModelInForce, model_in_force
from underskin import InvalidInput, TableError
from underskin.findings.finding import Finding
from underskin.findings.formatting import left_out_lines
from underskin.inversion import elastomer
from underskin.inversion.elastomer import RecordingModulus
from underskin.inversion.invert import Inversion, array_d33_by_other, invert
from underskin.inversion.mixed_model import Estimate
from underskin.recordings import plausibility
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import to_lab

BandHz = tuple[float, float]
_MOST_NAMED = 3  # reasons for which recordings give no d33
_PAPER = {"model": "paper", "model_id": None, "model_percent": None}
_NONE: dict[str, Any] = {
    **dict.fromkeys(
        ("band", "array", "array_relative", "sensor_spread_percent", "gain_scatter_percent", "position_scatter_mm")
    ),
    "array_solved": None,
    "declared_percent": None,
    "status": "none",
    "sensors": [],
    "cells": [],
    "findings": [],
}


def of_inversion(inversion: Inversion) -> dict[str, Any]:
    """The fields of `D33` that come from an inversion."""
    zone, cells = inversion.zone, inversion.cells
    array, relative = inversion.absolute_d33, inversion.campaign_d33

    radii = to_lab("indenter_radius_mm", cells.indenter_radius).tolist()
    return {
        "status": "ok",
        "reason": None,
        "band": {
            "low_hz": float(zone.low_hz),
            "high_hz": float(zone.high_hz),
            "reason": zone.reason,
            "chosen_by_user": zone.chosen_by_user,
            "left_out_hz": [float(line) for line in zone.left_out_hz],
        },
        "array": of_array(array),
        "array_relative": of_array(relative),
        "array_solved": None,
        "sensor_spread_percent": _scatter(inversion.spread, 100.0),
        "gain_scatter_percent": _scatter(inversion.gain, 100.0),
        "position_scatter_mm": _scatter(inversion.position, 1e3),
        "declared_percent": _finite(inversion.declared_percent),
        "sensors": [
            {"sensor": name, "flags": _flags(inversion, name), **d33}
            for name, d33 in zip(inversion.sensor_ids, _d33(inversion.sensors), strict=True)
        ],
        "cells": [
            {
                "sensor": inversion.sensor_ids[sensor],
                "indenter_radius_mm": round(radius, 9),
                "preload_n": preload,
                "recordings": count,
                **d33,
            }
            for sensor, radius, preload, count, d33 in zip(
                cells.sensor.tolist(), radii, cells.preload.tolist(), cells.recordings.tolist(), _d33(cells.d33),
                strict=True,
            )
        ],
        "findings": [finding.sentence for finding in inversion.findings],
    }  # fmt: skip


def of_array(estimate: Estimate | None) -> dict[str, float | None] | None:
    """The fields of `D33Value` of one d33."""
    return None if estimate is None else _d33(estimate)[0]


def of_moduli(recordings: Sequence[RecordingModulus]) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """The entries of `moduli`, and those of `left_out` for recordings without one."""
    moduli, excluded = [], []
    for recording in recordings:
        if isinstance(recording.result, InvalidInput):
            excluded.append({"recording": recording.recording, "reason": str(recording.result)})
            continue
        moduli.append(
            {
                "recording": recording.recording,
                "kind": recording.kind,
                "youngs_modulus_mpa": float(to_lab("youngs_modulus_mpa", recording.result.modulus)),
                "youngs_modulus_uncertainty_mpa": float(to_lab("youngs_modulus_mpa", recording.result.uncertainty)),
                "statement": recording.result.statement,
            }
        )
    return moduli, excluded


def _d33(estimate: Estimate) -> list[dict[str, float | None]]:
    """The fields of `D33Value` of each entry."""
    return [dict(zip(D33Value.model_fields, map(_finite, row), strict=True)) for row in estimate.d33_rows()]


def _scatter(estimate: Estimate | None, factor: float) -> dict[str, float] | None:
    if estimate is None:
        return None
    return {name: factor * float(getattr(estimate, name)) for name in ("value", "low", "high")}


def _flags(inversion: Inversion, sensor: str) -> list[dict[str, str]]:
    return [{"code": flag.code, "reason": flag.reason} for flag in inversion.flags if flag.sensor == sensor]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def answer(
    store: Database, table: SigmaTable, row: AnyRow, band_hz: BandHz | None, *, soon: bool = True
) -> dict[str, Any]:
    """The d33 of a campaign in its present state (fields of D33), over its flat zone or a given band; given `soon`,
    or once the result could be stored."""
    cached = store.read(inversions.find, row, table.sha256) if band_hz is None else None
    return dict(cached) if cached is not None else _derived(store, table, row, band_hz, soon=soon)[0]


def by_model(
    store: Database, table: SigmaTable, row: AnyRow, model: Literal["paper", "adopted"], band_hz: BandHz | None = None
) -> dict[str, Any]:
    """The same by the paper's model, or by the model in force of the campaign's skin."""
    if model == "adopted":
        return adopted_answer(store, table, row, model_in_force(store, row.skin_id), band_hz)
    return answer(store, table, row, band_hz)


def with_numbers(
    store: Database, table: SigmaTable, row: AnyRow, band_hz: BandHz | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The same, and the numbers that its figures show (service.usecases.figure_data)."""
    cached = store.read(inversions.find_with_numbers, row, table.sha256)
    if cached is not None and band_hz is None:
        return cached
    return _derived(store, table, row, band_hz, None if cached is None else cached[1]["spreads"], soon=True)


def adopted_answer(
    store: Database,
    table: SigmaTable,
    row: AnyRow,
    model_in_force: ModelInForce,
    band_hz: BandHz | None,
    *,
    soon: bool = True,
) -> dict[str, Any]:
    """As `answer`, under an adopted model: from the lines that the base model would have shown.

    Raises InvalidInput if the campaign lacks what the model needs, or declares the skin differently.
    """
    model, model_id = model_in_force.model, model_in_force.model_id
    cached = store.read(inversions.find_adopted, row, model_id, table.sha256) if band_hz is None else None
    if cached is not None:
        return dict(cached)
    campaign, excluded = store.read(_used, row)
    translated, beyond = model.as_base_model(campaign, table)
    excluded += [(name, "beyond the table under the adopted model") for name in beyond]
    origin = {"model": "adopted", "model_id": model_id, "model_percent": 100 * model.unsure}
    document = {"campaign_id": row.id, "table_sha256": table.sha256, **origin}
    document, _, failed = _computed(document, translated, table, band_hz, excluded)
    if band_hz is None and not failed:
        _keep(store, row, soon, inversions.keep_adopted, model_id, table.sha256, document)
    return document


def derive(
    store: Database, table: SigmaTable, campaign_ids: Sequence[str], *, soon: bool = False
) -> dict[str, dict[str, Any]]:
    """Compute and store d33 by the paper's model and by the one in force; returns the paper's answers by campaign
    id. Failures are logged, and retried on request."""
    answers = {}
    for campaign_id in campaign_ids:
        try:
            row = store.read(campaigns.find, campaign_id)
            answers[campaign_id] = answer(store, table, row, None, soon=soon)
            with suppress(Refusal, Conflict, InvalidInput):  # without a model in force, or if it does not apply
                adopted_answer(store, table, row, model_in_force(store, row.skin_id), None, soon=soon)
        except Exception:  # the campaign itself is stored, as promised
            logger.exception("no d33 from a campaign", extra={"fields": {"campaign": campaign_id}})
    return answers


def foreseen(table: SigmaTable, campaign: Campaign) -> list[str]:
    """The findings on a campaign before it is stored, after notes on FRFs that will give no d33, and on curves that
    will give no modulus, and why."""
    document = {"campaign_id": campaign.name, "table_sha256": table.sha256, **_PAPER}
    fields = _computed(document, campaign, table, None, [])[0]
    curves = {curve.id for curve in campaign.curves}
    without_modulus = [
        (left["recording"], left["reason"]) for left in fields["left_out"] if left["recording"] in curves
    ]
    findings: list[str] = fields["findings"]
    return [*_without_d33(campaign, fields, table), *left_out_lines(without_modulus), *findings]


def _without_d33(campaign: Campaign, fields: dict[str, Any], table: SigmaTable) -> list[str]:
    """A sentence if a campaign's FRFs, or some of them, will give no d33; and the load parameter L."""
    frfs = {recording.id for recording in campaign.of(FrfRecording)}
    reasons = [
        left["reason"] if left["recording"] is None else f"recording {left['recording']}: {left['reason']}"
        for left in fields["left_out"]
        if left["recording"] is None or left["recording"] in frfs
    ]
    if not frfs or (fields["status"] == "ok" and not reasons):
        return []
    if fields["status"] == "ok":
        more = f"; and {len(reasons) - _MOST_NAMED} more" if len(reasons) > _MOST_NAMED else ""
        sentence = f"these will give no d33: {'; '.join(reasons[:_MOST_NAMED])}{more}."
    else:
        sentence = f"no d33 will come of this: {fields['reason']}."
    if "L = " not in sentence:
        return [sentence]
    most = float(table.domain["load_parameter"][1])
    depth = 100 * (9 / 16 * most) ** (2 / 3)  # % of the radius, by Hertz on an incompressible half space
    meaning = (
        "L = F/(R²E) measures the strain under the sphere: how deep it goes in for its radius R. The table ends at "
        f"L = {most:g}, about {depth:.0f} % of R deep in a thick layer; a larger sphere or a smaller preload stays "
        "within it."
    )
    return [sentence, meaning]


def complete(store: Database, table: SigmaTable, root: str) -> dict[str, dict[str, Any]]:
    """Compute what is missing for a skin's current campaigns, and store it if that is possible soon; returns the
    answers by campaign id."""
    missing = store.read(inversions.missing_of_skin, root, table.sha256)
    return derive(store, table, [row.id for row in missing], soon=True)


def _derived(
    store: Database,
    table: SigmaTable,
    row: AnyRow,
    band_hz: BandHz | None,
    spreads: list[dict[str, Any]] | None = None,
    *,
    soon: bool,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Answer and numbers, computed, and stored if they are of the flat zone; `spreads`: if known already."""
    campaign, excluded = store.read(_used, row)
    document = {"campaign_id": row.id, "table_sha256": table.sha256, **_PAPER}
    document, inversion, failed = _computed(document, campaign, table, band_hz, excluded)
    if inversion is not None:
        document["array_solved"] = _array_solved(campaign, table, inversion)
    numbers = figure_data.numbers(campaign, inversion, spreads)
    if band_hz is None and not failed:
        _keep(store, row, soon, inversions.keep, table.sha256, document, numbers, of_sensors(document))
    return document, numbers


def of_sensors(document: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """d33 with its standard uncertainty [pC/N] of those sensors of an answer that have both, by their ids."""
    values = {
        of_sensor["sensor"]: (of_sensor["d33_pc_per_n"], of_sensor["d33_uncertainty_pc_per_n"])
        for of_sensor in document["sensors"]
    }
    return {sensor: both for sensor, both in values.items() if None not in both}


def _used(connection: Connection, row: AnyRow) -> tuple[Campaign, list[tuple[str, str]]]:
    """The campaign without its excluded recordings; and these, with the reasons."""
    excluded = [(exclusion.recording, exclusion.reason) for exclusion in campaigns.excluded_of(connection, row.number)]
    return campaigns.load(connection, row, with_excluded=False), excluded


def _computed(
    document: dict[str, Any],
    campaign: Campaign,
    table: SigmaTable,
    band_hz: BandHz | None,
    excluded: Sequence[tuple[str, str]],
) -> tuple[dict[str, Any], Inversion | None, bool]:
    """The document with the campaign's figures, its inversion if there is one, and whether the computation failed;
    `excluded`: recordings with reasons.

    Raises InvalidInput for an invalid band.
    """
    entries = [{"recording": recording, "reason": reason} for recording, reason in excluded]
    try:
        fields, inversion = _inverted(campaign, table, band_hz)
        full_document = {**document, **fields, "left_out": entries + fields["left_out"]}
        D33.model_validate(orjson.loads(orjson.dumps(full_document)))  # stored answers must be valid
    except InvalidInput:  # of the band
        raise
    except Exception as error:
        logger.exception("no d33 from a campaign", extra={"fields": {"campaign": document["campaign_id"]}})
        reason = f"the figures cannot be computed ({type(error).__name__}: {error}); the server's log says more"
        return {**document, **_NONE, "reason": reason, "moduli": [], "left_out": entries}, None, True
    return full_document, inversion, False


def _inverted(campaign: Campaign, table: SigmaTable, band_hz: BandHz | None) -> tuple[dict[str, Any], Inversion | None]:
    moduli, without_modulus = of_moduli(elastomer.of_campaign(campaign))
    try:
        inversion = invert(campaign, table, band_hz)
    except InvalidInput as error:
        if band_hz is not None and error.field == "band_hz":
            raise
        findings = [finding.sentence for finding in plausibility.at_reading(campaign)]
        fields = {"reason": str(error), "findings": findings, "moduli": moduli, "left_out": without_modulus}
        return {**_NONE, **fields}, None
    excluded = [
        {"recording": left.recording, "reason": left.statement}
        if isinstance(left, Finding) and left.recording
        else {"recording": None, "reason": left.sentence}
        for left in inversion.left_out
    ]
    return {**of_inversion(inversion), "moduli": moduli, "left_out": excluded + without_modulus}, inversion


def _array_solved(campaign: Campaign, table: SigmaTable, inversion: Inversion) -> dict[str, float | None] | None:
    """The field of `D33`; also null if the contact table cannot be read, which is logged."""
    try:
        return of_array(array_d33_by_other(campaign, table, inversion))
    except TableError as error:
        logger.error("no d33 by the solved contact: %s", error)
        return None


def _keep(store: Database, row: AnyRow, soon: bool, change: Callable[..., None], *derived: Any) -> None:
    """Store the answer; if that fails, or is not possible `soon`, it is only returned."""
    try:
        store.require_hope(soon=soon)
        with store.writing(soon=soon) as connection:
            change(connection, row, *derived)
    except (StorageFailed, StoreMoved, OperationalError, OSError) as error:
        logger.warning("the d33 of a campaign was not kept: %s", error, extra={"fields": {"campaign": row.id}})
