"""What is answered on the d33 of a campaign, and how an inversion is put into it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from underskin import InvalidInput
from underskin.units import to_lab

if TYPE_CHECKING:
    from underskin.inversion.invert import Inversion
    from underskin.inversion.mixed_model import Estimate
    from underskin.recordings.elastomer import RecordingModulus

# Raised whenever the fields below, or the figures that underskin.inversion and underskin.recordings put into them,
# change: what an earlier version kept is then computed anew.
ANSWER_VERSION = 3


class D33Value(BaseModel):
    """d33 with its uncertainty."""

    d33_pc_per_n: float | None = Field(description="d33 [pC/N]; null where no recording can be used.")
    d33_uncertainty_pc_per_n: float | None = Field(description="Its standard uncertainty [pC/N].")
    d33_low_pc_per_n: float | None = Field(description="Lower end of its 95 % interval [pC/N].")
    d33_high_pc_per_n: float | None = Field(description="Upper end of its 95 % interval [pC/N].")


class Scatter(BaseModel):
    """A scatter that the recordings show."""

    value: float = Field(description="Its estimate.")
    low: float = Field(description="Lower end of its 95 % interval.")
    high: float = Field(description="Upper end of its 95 % interval.")


class Band(BaseModel):
    """The lines that were averaged."""

    low_hz: float = Field(description="From here [Hz].")
    high_hz: float = Field(description="To here, included [Hz].")
    reason: str = Field(description="Why this band.")
    chosen_by_user: bool = Field(description="Whether the request named it.")
    left_out_hz: list[float] = Field(description="Lines inside it that were not averaged, such as mains pick-up [Hz].")


class SensorFlag(BaseModel):
    """Something that makes a sensor stand out."""

    code: str = Field(description="What, in one word.", examples=["weak"])
    reason: str = Field(description="What shows it.")


class SensorD33(D33Value):
    """d33 of one sensor, over all indenters and preloads."""

    sensor: str = Field(description="Its id.")
    flags: list[SensorFlag] = Field(description="Where it stands out.")


class CellD33(D33Value):
    """d33 of one sensor under one indenter and preload."""

    sensor: str = Field(description="Its id.")
    indenter_radius_mm: float = Field(description="Radius of the sphere [mm].")
    preload_n: float = Field(description="Static force [N].")
    recordings: int = Field(description="How many recordings it comes from.")


class LeftOut(BaseModel):
    """Something that the figures do without."""

    recording: str | None = Field(description="The recording; null where the reason names what is meant.")
    reason: str = Field(description="Why.")


class Modulus(BaseModel):
    """What a recording of kind `compression` or `indentation` says of the elastomer."""

    recording: str = Field(description="The recording.")
    kind: Literal["compression", "indentation"] = Field(description="Its kind.")
    youngs_modulus_mpa: float = Field(description="Young's modulus of the elastomer [MPa].")
    youngs_modulus_uncertainty_mpa: float = Field(description="Its standard uncertainty [MPa].")
    statement: str = Field(description="Where the curve is straight, or how well Hertz' law fits it.")


class D33(BaseModel):
    """d33 of a campaign's sensors, and the modulus of its elastomer where that was recorded."""

    campaign_id: str = Field(description="The campaign.")
    table_sha256: str = Field(description="SHA-256 of the table of σ.")
    model: Literal["paper", "adopted"] = Field(default="paper", description="The model that the figures rest on.")
    model_id: str | None = Field(default=None, description="Which adopted model.")
    model_percent: float | None = Field(
        default=None,
        description="Standard deviation of all d33 together by an adopted model's parameters; not in intervals.",
    )
    status: Literal["ok", "none"] = Field(description="`none`: no d33 can be told from it; `reason` says why.")
    reason: str | None = Field(description="Why there is none.")
    band: Band | None = Field(description="The lines that were averaged.")
    array: D33Value | None = Field(description="d33 of the array: mean of the sensors that are not flagged as unfit.")
    sensor_spread_percent: Scatter | None = Field(description="Standard deviation of d33 over the sensors.")
    gain_scatter_percent: Scatter | None = Field(description="Standard deviation of a recording's gain.")
    position_scatter_mm: Scatter | None = Field(
        description="Standard deviation of the sphere's position, each axis [mm]."
    )
    declared_percent: float | None = Field(
        description="How far d33 moves where the declared modulus is 2 % and the thickness 1 % off; not in intervals."
    )
    sensors: list[SensorD33] = Field(description="One entry a sensor that was recorded.")
    cells: list[CellD33] = Field(description="One entry a sensor, indenter and preload that was recorded.")
    moduli: list[Modulus] = Field(description="One entry a recording of the elastomer alone.")
    findings: list[str] = Field(
        description="What looked wrong and was used all the same, such as C/N taken for pC/N or a time still to come."
    )
    left_out: list[LeftOut] = Field(description="What the figures do without.")


def of_inversion(found: "Inversion") -> dict[str, Any]:
    """The fields of `D33` that come from an inversion."""
    zone, cells = found.zone, found.cells
    names = ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33_low_pc_per_n", "d33_high_pc_per_n")
    flags = _flags(found)
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
        "array": None if found.campaign_d33 is None else dict(zip(names, _columns(found.campaign_d33)[0], strict=True)),
        "sensor_spread_percent": _scatter(found.spread, 100.0),
        "gain_scatter_percent": _scatter(found.gain, 100.0),
        "position_scatter_mm": _scatter(found.position, 1e3),
        "declared_percent": _finite(found.declared_percent),
        "sensors": [
            {"sensor": name, "flags": flags.get(name, []), **dict(zip(names, row, strict=True))}
            for name, row in zip(found.sensor_ids, _columns(found.sensors), strict=True)
        ],
        "cells": [
            {
                "sensor": found.sensor_ids[sensor],
                "indenter_radius_mm": round(radius, 9),
                "preload_n": preload,
                "recordings": count,
                **dict(zip(names, row, strict=True)),
            }
            for sensor, radius, preload, count, row in zip(
                cells.sensor.tolist(), radii, cells.preload.tolist(), cells.recordings.tolist(), _columns(cells.d33),
                strict=True,
            )
        ],
        "findings": [finding.sentence for finding in found.findings],
    }  # fmt: skip


def of_moduli(found: Sequence["RecordingModulus"]) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """The entries of `moduli`, and those of `left_out` for recordings that tell none."""
    moduli, left_out = [], []
    for one in found:
        if isinstance(one.found, InvalidInput):
            left_out.append({"recording": one.recording, "reason": str(one.found)})
            continue
        moduli.append(
            {
                "recording": one.recording,
                "kind": one.kind,
                "youngs_modulus_mpa": float(to_lab("youngs_modulus_mpa", one.found.modulus)),
                "youngs_modulus_uncertainty_mpa": float(to_lab("youngs_modulus_mpa", one.found.uncertainty)),
                "statement": one.found.statement,
            }
        )
    return moduli, left_out


def _columns(estimate: "Estimate") -> list[list[float | None]]:
    """Value, uncertainty, low and high [pC/N] of each entry."""
    parts = (estimate.value, estimate.uncertainty, estimate.low, estimate.high)
    columns = np.stack([np.atleast_1d(to_lab("d33_pc_per_n", part)) for part in parts], axis=-1)
    return [[_finite(value) for value in row] for row in columns.tolist()]


def _scatter(estimate: "Estimate | None", factor: float) -> dict[str, float] | None:
    if estimate is None:
        return None
    return {name: factor * float(getattr(estimate, name)) for name in ("value", "low", "high")}


def _flags(found: "Inversion") -> dict[str, list[dict[str, str]]]:
    by_sensor: dict[str, list[dict[str, str]]] = {}
    for flag in found.flags:
        by_sensor.setdefault(flag.sensor, []).append({"code": flag.code, "reason": flag.reason})
    return by_sensor


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
