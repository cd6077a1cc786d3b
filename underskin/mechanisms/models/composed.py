"""A model of a campaign's recordings: the base model, and a set of mechanisms composed with it in a fixed order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from underskin.errors import InvalidInput
from underskin.mechanisms.base import Kind, Parameter
from underskin.mechanisms.models.composition import Prediction, check_supported, chosen, kind_of
from underskin.mechanisms.models.compression import CompressionModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.models.indentation import IndentationModel
from underskin.mechanisms.models.pickup import Pickup
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

__all__ = ["Model", "Prediction", "compose"]


class Model(Protocol):
    """A composed model. `parameters`: the mechanisms' own, in order of composition, then the nuisances.

    `valid` (rows,) is decided by the declared values, before any fit: False where the contact or its offset lies
    beyond the tables from the start; such rows are predicted by continuation and should not be fitted.
    """

    names: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    recording: NDArray[np.intp]
    sensor: NDArray[np.intp] | None
    valid: NDArray[np.bool_]
    pickup: Pickup | None

    def predict(self, fit: Floats) -> Prediction:
        """All rows at one point of the fit coordinates (parameters,)."""
        ...

    def sensor_spread_of(self, fit: Floats) -> tuple[float, Floats]:
        """The sd of the sensors' log gains, and its derivative (parameters,)."""
        ...


def compose(names: Sequence[str], campaign: Campaign, table: SigmaTable, kind: Kind | None = None) -> Model:
    """The model of these mechanisms, by name, in any order, for the campaign's recordings of one kind.

    `kind` must be given where the campaign has several. Raises Unsupported(mechanism, reason) where the campaign
    cannot support one, InvalidInput for an unknown name, or a kind of which the campaign has no recording.
    """
    kind = kind or kind_of(campaign)
    if all(recording.kind != kind for recording in campaign.recordings):
        raise InvalidInput("kind", kind, "must be that of at least one of the campaign's recordings")
    mechanisms = chosen(names, CATALOGUE)
    check_supported(mechanisms, campaign, kind)
    if kind == "frf":
        return FrfModel(mechanisms, campaign, table)
    if kind == "indentation":
        return IndentationModel(mechanisms, campaign)
    return CompressionModel(mechanisms, campaign)
