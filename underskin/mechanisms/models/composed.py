"""A model of recordings: the base model composed with a set of mechanisms in a fixed order."""

from collections.abc import Callable, Mapping, Sequence

from underskin.errors import ErrorCode, InvalidInput
from underskin.mechanisms.base import Kind, Mechanism
from underskin.mechanisms.models.composition import Prediction, check_supported, chosen, kind_of
from underskin.mechanisms.models.curves import CompressionModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.models.indentation import IndentationModel
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Conditions
from underskin.surrogate.sigma_table import SigmaTable

__all__ = ["Model", "Prediction", "compose"]


# The `parameters` of each are those of the mechanisms, in order of composition, then the nuisances. `valid` (rows,) is
# decided by the declared values, before any fit: False where the contact or its offset lies beyond the tables from the
# start; such rows are predicted by continuation and should not be fitted.
Model = FrfModel | IndentationModel | CompressionModel
_MODELS: Mapping[Kind, Callable[[Sequence[Mechanism], Conditions, SigmaTable], Model]] = {
    "frf": FrfModel,
    "indentation": lambda mechanisms, conditions, _: IndentationModel(mechanisms, conditions),
    "compression": lambda mechanisms, conditions, _: CompressionModel(mechanisms, conditions),
}


def compose(
    names: Sequence[str],
    conditions: Conditions,
    table: SigmaTable,
    kind: Kind | None = None,
    catalogue: Mapping[str, Mechanism] = CATALOGUE,
) -> Model:
    """The model of some mechanisms for all recordings of one kind, provided that these can support the mechanisms.

    Parameters
    ----------
    names
        Mechanisms of the catalogue, in any order.
    conditions
        Conditions of recordings, or a campaign. Of measured curves, contact points, force offsets and an undeclared
        modulus start from the base model's own fits.
    table
        The σ table.
    kind
        Required where the conditions hold several kinds.
    catalogue
        The mechanisms by name.

    Raises
    ------
    Unsupported
        Where the recordings cannot support a mechanism: they contain no information about its parameters.
    InvalidInput
        For an unknown name, or a kind of which there is no recording.
    """
    kind = kind or kind_of(conditions)
    _require_kind(conditions, kind)
    mechanisms = chosen(names, catalogue)
    check_supported(mechanisms, conditions, kind)
    return forward_model(mechanisms, conditions, table, kind)


def forward_model(mechanisms: Sequence[Mechanism], conditions: Conditions, table: SigmaTable, kind: Kind) -> Model:
    """The model of mechanisms in order of composition, whether or not the recordings identify their parameters.

    All models of a skin use the same σ around its sensors.

    Raises InvalidInput for a kind of which there is no recording, and where a declared value is missing.
    """
    _require_kind(conditions, kind)
    return _MODELS[kind](mechanisms, conditions, table)


def _require_kind(conditions: Conditions, kind: Kind) -> None:
    if all(recording.kind != kind for recording in conditions.recordings):
        raise InvalidInput(
            "kind", kind, "must be that of at least one of the campaign's recordings", code=ErrorCode.NOT_ONE_OF
        )
