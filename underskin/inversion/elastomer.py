"""The elastomer's modulus from curves of the same bench: a compressed or pulled sample, or an indented one, each
recording separately (recordings/modulus.py). Curves are prepared by curve_preparation.
"""

from dataclasses import dataclass

import numpy as np

from underskin.errors import InvalidInput, unusable
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording
from underskin.recordings.curve_preparation import prepared, reject_exchanged_columns
from underskin.recordings.modulus import CompressionModulus, IndentationModulus, of_compression, of_indentation
from underskin.surrogate.tables import load_contact


@dataclass(frozen=True)
class RecordingModulus:
    """The modulus of a recording, or in `result` the reason why there is none."""

    recording: str
    kind: str
    result: CompressionModulus | IndentationModulus | InvalidInput


def of_campaign(campaign: Campaign) -> list[RecordingModulus]:
    """The modulus by each recording of kind `compression` or `indentation`."""
    moduli = []
    skin = campaign.skin
    for recording in prepared(campaign).campaign.recordings:
        result: CompressionModulus | IndentationModulus | InvalidInput
        try:
            if isinstance(recording, CompressionRecording | IndentationRecording):
                reject_exchanged_columns(recording)
            if isinstance(recording, CompressionRecording):
                _require_height(recording)
                result = of_compression(recording)
            elif isinstance(recording, IndentationRecording):
                result = of_indentation(recording, skin.poisson_ratio, skin.thickness_mm, load_contact().softening)
            else:
                continue
            if not result.modulus > 0:
                raise unusable("force_n", None, "must rise with the displacement: no modulus follows from a fall")
        except InvalidInput as error:
            result = error
        except (ArithmeticError, ValueError) as error:  # NumPy's among them
            result = unusable("force_n", None, f"no modulus can be computed from these numbers ({error})")
        moduli.append(RecordingModulus(recording.id, recording.kind, result))
    return moduli


def _require_height(recording: CompressionRecording) -> None:
    """Raise InvalidInput where the displacement of a block, from its least force on, exceeds its height."""
    if len(recording.displacement_mm) != len(recording.force_n):
        return
    rest = recording.displacement_mm[np.argmin(np.abs(recording.force_n))]
    moved = float(np.max(recording.displacement_mm) - rest)
    if moved >= recording.sample_height_mm:
        height = f"must stay below sample_height_mm, {recording.sample_height_mm:g}"
        raise unusable("displacement_mm", moved, f"{height}: is it in mm, or exchanged with force_n, or tension?")
