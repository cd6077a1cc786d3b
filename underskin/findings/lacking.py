"""What data lack for a conclusion."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Lack(StrEnum):
    """Why nothing can be concluded."""

    CURVES_CONTRADICT = "curves_contradict"
    NO_CURVE = "no_curve"
    NO_RECORDING = "no_recording"
    NO_RESPONSE = "no_response"
    TWO_RECORDINGS_CONTRADICT = "two_recordings_contradict"
    FEW_RECORDINGS = "few_recordings"
    FEW_TO_AGREE = "few_to_agree"
    MADE_ALIKE = "made_alike"
    IMPOSSIBLE_DECLARATION = "impossible_declaration"
    NOISE = "noise"


@dataclass(frozen=True)
class Lacking:
    """A lack with the values of its sentence, and the number of rejected recordings with their fields."""

    lack: Lack
    arguments: Mapping[str, Any] = dataclasses.field(default_factory=dict, hash=False)
    refused_recordings: int = 0
    refused_fields: Sequence[str] = ()
