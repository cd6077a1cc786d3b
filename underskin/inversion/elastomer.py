"""The elastomer's modulus from curves of the same bench: a compressed or pulled sample, or an indented one, each
recording separately (recordings/modulus.py, block_modulus.py). Curves are prepared by curve_preparation.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.errors import InvalidInput, unusable
from underskin.recordings.block_modulus import CompressionModulus, small_strain_modulus
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    CurveRecording,
    IndentationRecording,
    SkinDescription,
)
from underskin.recordings.curve_preparation import prepared, reject_exchanged_columns
from underskin.recordings.modulus import IndentationModulus, of_indentation
from underskin.surrogate.hdf5_format import load_contact


@dataclass(frozen=True)
class RecordingModulus:
    """The modulus of a recording, or in `result` the reason why there is none."""

    recording: str
    kind: str
    result: CompressionModulus | IndentationModulus | InvalidInput


def of_campaign(campaign: Campaign) -> list[RecordingModulus]:
    """The modulus by each recording of kind `compression` or `indentation`."""
    return [
        RecordingModulus(curve.id, curve.kind, _modulus_or_reason(curve, campaign.skin))
        for curve in prepared(campaign).campaign.curves
    ]


def _modulus_or_reason(
    curve: CurveRecording, skin: SkinDescription
) -> CompressionModulus | IndentationModulus | InvalidInput:
    try:
        reject_exchanged_columns(curve)
        result = _MODULUS[curve.kind](curve, skin)
    except InvalidInput as error:
        return error
    except (ArithmeticError, ValueError) as error:  # NumPy's among them
        return unusable("force_n", None, f"no modulus can be computed from these numbers ({error})")
    if not result.modulus > 0:
        return unusable("force_n", None, "must rise with the displacement: no modulus follows from a fall")
    return result


def _of_indentation(curve: IndentationRecording, skin: SkinDescription) -> IndentationModulus:
    return of_indentation(curve, skin.poisson_ratio, skin.thickness_mm, load_contact().softening)


def _of_compression(curve: CompressionRecording, _: SkinDescription) -> CompressionModulus:
    _require_height(curve)
    return small_strain_modulus(curve)


_MODULUS: Mapping[str, Callable[[Any, SkinDescription], CompressionModulus | IndentationModulus]] = {
    "indentation": _of_indentation,
    "compression": _of_compression,
}


def _require_height(recording: CompressionRecording) -> None:
    """Raise InvalidInput where the displacement of a block, from its least force on, exceeds its height."""
    if len(recording.displacement_mm) != len(recording.force_n):
        return
    rest = recording.displacement_mm[np.argmin(np.abs(recording.force_n))]
    moved = float(np.max(recording.displacement_mm) - rest)
    if moved >= recording.sample_height_mm:
        height = f"must stay below sample_height_mm, {recording.sample_height_mm:g}"
        raise unusable(
            "displacement_mm",
            moved,
            f"{height}: is that height in mm, was the sample pulled (tension counts negative), or is this exchanged "
            "with force_n?",
        )
