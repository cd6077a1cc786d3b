"""The forward model: what recordings under given conditions would show, with derivatives by every parameter.

skin = SkinDescription(poisson_ratio=0.5, thickness_mm=2.5, youngs_modulus_mpa=16, sensor_radius_mm=1.5)
conditions = frf_conditions(skin, indenter_radius_mm=4, preload_n=[0.5, 1, 2], frequency_hz=[30])
predict(conditions, load_table(), {"d33": 14, "mobile_fraction": 0.4}, mechanisms=["moving_contact_edge"]).value
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.errors import conflicting, not_one_of, out_of_range, required, wrong_type
from underskin.mechanisms.base import NEEDED_FIELDS, Kind, Mechanism, Parameter
from underskin.mechanisms.models.composed import Model, forward_model
from underskin.mechanisms.models.composition import D33, chosen, kind_of, parameters_together
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Conditions, FrfConditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Indices, Mask, to_lab

_NOTHING: Mapping[str, float] = {}


@dataclass(frozen=True, eq=False)
class Predicted:
    """What recordings would show; rows are lines of FRFs or samples of curves, one recording after another.

    Attributes
    ----------
    value
        (rows,) complex FRF [pC/N], or force [N] of a curve.
    derivatives
        Of `value` by each parameter in its unit, (rows,) each, by name.
    recording
        (rows,) number of the recording.
    inside
        (rows,) False where the contact lies beyond the tables, which are continued there.
    """

    value: Array
    derivatives: Mapping[str, Array]
    recording: Indices
    inside: Mask


def predict(
    conditions: Conditions,
    table: SigmaTable,
    parameters: Mapping[str, float] = _NOTHING,
    *,
    mechanisms: Sequence[str] = (),
    kind: Kind | None = None,
) -> Predicted:
    """What recordings under these conditions show, by the base model with a set of mechanisms.

    Parameters
    ----------
    conditions
        Conditions of recordings, or a campaign, whose measurements are not used but for the contact points of curves.
    table
        The σ table (`load_table`).
    parameters
        Values by name, in the parameter's unit: those of every mechanism, and of the base model `d33` [pC/N] (default
        the declared one), `youngs_modulus` and `thickness` (factors on the declared ones, default 1), of curves
        `contact_point <id>` [mm], and of indentations `finite_strain`, the share of what finite strain adds to the
        depth (default ½).
    mechanisms
        Names from the catalogue, in any order.
    kind
        Of the recordings; needed where the conditions hold several kinds.

    Returns
    -------
    Predicted
        Values and derivatives in lab units.

    Raises
    ------
    InvalidInput
        For a mechanism or parameter that is unknown, missing or beyond its bounds, and for a recording that lacks what
        a mechanism needs.
    """
    if isinstance(mechanisms, str):
        raise wrong_type("mechanisms", mechanisms, "must be a list of names")
    kind = kind or kind_of(conditions)
    acting = chosen(mechanisms, CATALOGUE)
    for mechanism in acting:
        if kind not in mechanism.kinds:
            raise conflicting("mechanisms", mechanism.name, f"does not act on recordings of kind {kind}")
    if kind == "frf":
        require_fields(acting, conditions)
    model = forward_model(acting, conditions, table, kind)
    declared = conditions.skin.d33_pc_per_n
    has_d33 = any(parameter.name == D33.name for parameter in model.parameters)
    values = {D33.name: declared} if declared is not None and has_d33 else {}
    values |= parameters
    mechanism_count = sum(map(len, parameters_together(acting, conditions, kind).values()))
    fit = _fit_coordinates(model, values, mechanism_count)
    prediction = model.predict(fit)
    unit = float(to_lab("frf_pc_per_n", 1.0)) if kind == "frf" else 1.0
    return Predicted(
        value=unit * prediction.value,
        derivatives={
            parameter.name: unit * slopes / (parameter.from_fit(at) if parameter.scale == "log" else 1.0)
            for parameter, slopes, at in zip(model.parameters, prediction.slopes, fit.tolist(), strict=True)
        },
        recording=model.recording,
        inside=model.valid & prediction.inside,
    )


def needed_fields(mechanisms: Sequence[Mechanism]) -> dict[str, str]:
    """Fields of an FRF's conditions needed besides sphere, preload and lines, each with the mechanism that needs it."""
    needed: dict[str, str] = {}
    for mechanism in mechanisms:
        needed |= {name: mechanism.name for name in mechanism.reads if name in NEEDED_FIELDS and name not in needed}
    return needed


def require_fields(mechanisms: Sequence[Mechanism], conditions: Conditions, model: str = "the model") -> None:
    """Raises InvalidInput for the first FRF whose conditions lack a field that a mechanism of this model needs."""
    for name, mechanism in needed_fields(mechanisms).items():
        for recording in conditions.recordings:
            if isinstance(recording, FrfConditions) and getattr(recording, name) is None:
                raise required(f"recordings[{recording.id}].{name}", f"is required: {model} has {mechanism}")


def _fit_coordinates(model: Model, values: Mapping[str, float], mechanism_count: int) -> NDArray[np.float64]:
    """The fit coordinates (parameters,) of values by name; nuisances that are not given are at their priors' centres.

    `mechanism_count`: how many of the parameters, the first ones, are the mechanisms'.
    """
    names = [parameter.name for parameter in model.parameters]
    for name in values:
        if name not in names:
            raise not_one_of("parameters", name, names)
    needed = {
        *(parameter.name for parameter in model.parameters[:mechanism_count] if parameter.relative_to is None),
        "d33",
    }
    return np.array(
        [_coordinate(parameter, _fitted(parameter, values), parameter.name in needed) for parameter in model.parameters]
    )


def _fitted(parameter: Parameter, values: Mapping[str, float]) -> float | None:
    """The given value, as a multiple where the parameter is one of another."""
    value = values.get(parameter.name)
    return value if value is None or parameter.relative_to is None else value / values[parameter.relative_to]


def _coordinate(parameter: Parameter, value: float | None, needed: bool) -> float:
    if value is None:
        if needed:
            raise required(
                f"parameters.{parameter.name}", f"required{_unit(parameter.unit, ', in ')}: {parameter.reason}"
            )
        return parameter.start
    if not parameter.low <= value <= parameter.high:
        raise out_of_range(
            f"parameters.{parameter.name}",
            value,
            f"must be {parameter.low:g} to {parameter.high:g}{_unit(parameter.unit)}",
        )
    return parameter.to_fit(value)


def _unit(unit: str, lead: str = " ") -> str:
    return "" if unit == "-" else f"{lead}{unit}"
