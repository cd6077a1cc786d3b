"""An inversion as the answer on the d33 of a campaign."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from service.schemas.campaign_d33 import D33Value
from underskin import InvalidInput
from underskin.units import to_lab

if TYPE_CHECKING:
    from underskin.inversion.elastomer import RecordingModulus
    from underskin.inversion.invert import Inversion
    from underskin.inversion.mixed_model import Estimate


def of_inversion(inversion: "Inversion") -> dict[str, Any]:
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


def of_array(estimate: "Estimate | None") -> dict[str, float | None] | None:
    """The fields of `D33Value` of one d33."""
    return None if estimate is None else _d33(estimate)[0]


def of_moduli(recordings: Sequence["RecordingModulus"]) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
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


def _d33(estimate: "Estimate") -> list[dict[str, float | None]]:
    """The fields of `D33Value` of each entry."""
    return [dict(zip(D33Value.model_fields, map(_finite, row), strict=True)) for row in estimate.d33_rows()]


def _scatter(estimate: "Estimate | None", factor: float) -> dict[str, float] | None:
    if estimate is None:
        return None
    return {name: factor * float(getattr(estimate, name)) for name in ("value", "low", "high")}


def _flags(inversion: "Inversion", sensor: str) -> list[dict[str, str]]:
    return [{"code": flag.code, "reason": flag.reason} for flag in inversion.flags if flag.sensor == sensor]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
