"""Composition of mechanisms into one model: their parameters in one vector, and the prediction.

Every model also has nuisance parameters: of FRFs d33 and factors on the declared modulus and thickness; of curves
the modulus and the contact points, and of indentations the share of finite strain's effect on the depth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.autodiff import Differentiated, log
from underskin.errors import ErrorCode, InvalidInput, not_one_of, not_unique, required
from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Uniform, Unsupported, Values
from underskin.recordings.campaign import Conditions, SkinDescription
from underskin.units import Array, Floats, Indices, Mask, to_lab

_D33 = "what is measured; PVDF and its copolymers have 5 to 40 pC/N, ceramics up to some hundred"
_DECLARED_MODULUS = "a declared modulus is good to 2 %; a larger error is the mechanism modulus_error"
_DECLARED_THICKNESS = "a declared thickness is good to 1 %; a larger error is the mechanism thickness_error"
_FREE_MODULUS = "what is measured; wide around the base model's own fit"
_CONTACT_POINT = "where the curve leaves zero, found by the base model"

D33 = Parameter(
    "d33", "pC/N", 1e-3, 1e5, Normal(float(np.log(15.0)), 1.5), "log", limit=None, proportional=True, reason=_D33
)
YOUNGS_MODULUS = Parameter(
    "youngs_modulus", "-", 0.9, 1.1, Normal(0.0, 0.02), "log", limit=1.0, reason=_DECLARED_MODULUS
)
THICKNESS = Parameter("thickness", "-", 0.95, 1.05, Normal(0.0, 0.01), "log", limit=1.0, reason=_DECLARED_THICKNESS)
_STRAIN_SHARE = "0 is the linear contact, 1 the solved frictionless one of a neo-Hookean layer; friction lies between"
STRAIN_SHARE = Parameter(
    "finite_strain", "-", 0.0, 1.0, Uniform(), "linear", limit=None, reason=_STRAIN_SHARE, closed=(0.0, 1.0)
)
_LEAST_SD = 1e-4  # of a factor on a value that is declared to be exact
_BOUNDS = 5.0  # standard deviations
WIDE_SD = 1.5  # of the logarithm of an undeclared modulus


def frf_nuisances(skin: SkinDescription) -> tuple[Parameter, ...]:
    """d33, and the factors on the declared modulus and thickness, within the skin's tolerances where stated."""
    tolerances = skin.tolerances
    if tolerances is None:
        return D33, YOUNGS_MODULUS, THICKNESS
    return D33, _within(YOUNGS_MODULUS, tolerances.youngs_modulus_percent), thickness_parameter(skin)


def thickness_parameter(skin: SkinDescription) -> Parameter:
    """The factor on the declared thickness."""
    tolerances = skin.tolerances
    return THICKNESS if tolerances is None else _within(THICKNESS, tolerances.thickness_percent)


def _within(factor: Parameter, percent: float) -> Parameter:
    sd = max(percent / 100, _LEAST_SD)
    reach = float(np.exp(_BOUNDS * sd))
    reason = f"the skin's tolerances: declared within {percent:g} %"
    return replace(factor, low=1 / reach, high=reach, prior=Normal(0.0, sd), reason=reason)


def modulus_parameter(skin: SkinDescription, estimates: Sequence[float]) -> Parameter:
    """A factor on the declared modulus; where none is declared, the modulus itself, around the estimates [Pa]."""
    if skin.youngs_modulus_mpa is not None:
        return YOUNGS_MODULUS
    middle = float(to_lab("youngs_modulus_mpa", np.median(estimates)))
    low, high, prior = middle * 1e-3, middle * 1e3, Normal(float(np.log(middle)), WIDE_SD)
    return Parameter(
        "youngs_modulus", "MPa", low, high, prior, "log", limit=None, proportional=True, reason=_FREE_MODULUS
    )


def required_modulus(skin: SkinDescription) -> float:
    """The declared modulus [MPa]; raises InvalidInput where it is missing and no measured curve determines it."""
    if skin.youngs_modulus_mpa is None:
        raise required("skin.youngs_modulus_mpa", "required to predict curves that were not measured")
    return skin.youngs_modulus_mpa


def contact_point(recording: str, middle: float, sd: float, bound: float) -> Parameter:
    """The displacement at which the contact of one recording begins, around `middle` [m]."""
    middle_mm, sd_mm, bound_mm = (float(to_lab("displacement_mm", value)) for value in (middle, sd, bound))
    low, high, prior = middle_mm - bound_mm, middle_mm + bound_mm, Normal(middle_mm, sd_mm)
    name = f"contact_point {recording}"
    return Parameter(name, "mm", low, high, prior, "linear", limit=None, reason=_CONTACT_POINT)


SENSOR_SPREAD = 0.01  # sd of the logarithms of the sensors' gains, without `sensor_spread`


@dataclass(frozen=True)
class Prediction:
    """A model's prediction of every row, with its derivatives with respect to the fit coordinates."""

    value: Array  # (rows,) complex FRF [C/N], or force [N]
    slopes: Array  # (parameters, rows)
    position_slopes: Array | None  # (2, rows) ∂value/∂x, ∂value/∂y of the contact's place [1/m] (frf)
    pickup: Floats | None  # sd of mains pick-up [C/N], of real and of imaginary part, on the rows that it reaches
    pickup_rows: Indices | None  # those rows
    # (rows,) False where the contact lies beyond the tables, which are continued there, or the sensor's disc beyond the
    # stress profile, behind whose end the value is 0
    inside: Mask

    @property
    def pickup_variance(self) -> Floats:
        """Of real and of imaginary part (rows,) [(C/N)²]."""
        variance = np.zeros(len(self.value))
        if self.pickup is not None and self.pickup_rows is not None:
            variance[self.pickup_rows] = self.pickup**2
        return variance


class Composition:
    """The mechanisms of a model, in order, and the indices of their parameters and of the nuisances in the fit
    coordinates.

    Attributes: `indices`, the index of each mechanism's parameter by both names; `nuisances`, those of the nuisances.
    """

    def __init__(
        self, mechanisms: Sequence[Mechanism], conditions: Conditions, kind: Kind, nuisances: Sequence[Parameter]
    ) -> None:
        """Arrange the parameters of each mechanism, then the nuisances."""
        self.mechanisms = tuple(mechanisms)
        groups = parameters_together(mechanisms, conditions, kind)
        self.parameters = (*(parameter for group in groups.values() for parameter in group), *nuisances)
        starts = np.cumsum([0, *(len(group) for group in groups.values())])
        self.indices = {
            name: {parameter.name: start + index for index, parameter in enumerate(group)}
            for (name, group), start in zip(groups.items(), starts[:-1], strict=True)
        }
        self.nuisances = {parameter.name: int(starts[-1]) + index for index, parameter in enumerate(nuisances)}
        self._log = np.array([parameter.scale == "log" for parameter in self.parameters])

    def values(self, fit: Floats) -> tuple[dict[str, Values], Values]:
        """Each mechanism's parameters by name, and the nuisances, as values in their units without derivatives.

        `fit` is (…, parameters), one or several points. Raises InvalidInput where it has another length.
        """
        count = len(self.parameters)
        if np.shape(fit)[-1:] != (count,):
            allowed = f"must hold {count} coordinates"
            raise InvalidInput("fit", np.shape(fit), allowed, code=ErrorCode.UNEQUAL_LENGTHS)
        value = np.where(self._log, np.exp(np.where(self._log, fit, 0.0)), fit)
        numbers = [Differentiated(value[..., [index]], np.zeros((0, *np.shape(fit)[:-1], 1))) for index in range(count)]
        by_mechanism = {name: self.values_of(name, numbers.__getitem__) for name in self.indices}
        return by_mechanism, {name: numbers[index] for name, index in self.nuisances.items()}

    def values_of(self, mechanism: str, value: Callable[[int], Differentiated]) -> Values:
        """A mechanism's parameters in their units, from the `value` of the parameter at an index."""
        indices = self.indices[mechanism]
        values = {name: value(index) for name, index in indices.items()}
        for name, index in indices.items():
            if other := self.parameters[index].relative_to:
                values[name] = values[name] * values[other]
        return values


def parameters_together(
    mechanisms: Sequence[Mechanism], conditions: Conditions, kind: Kind
) -> dict[str, tuple[Parameter, ...]]:
    """The parameters of each mechanism by its name, in a model with all of these mechanisms."""
    return {mechanism.name: mechanism.parameters(conditions, kind, mechanisms) for mechanism in mechanisms}


def fit_coordinates(parameters: Sequence[Parameter], values: Values) -> Values:
    """Values of parameters as fit coordinates, by their names; those of other parameters as they are."""
    logarithmic = {parameter.name for parameter in parameters if parameter.scale == "log"}
    return {name: log(value) if name in logarithmic else value for name, value in values.items()}


def kind_of(conditions: Conditions) -> Kind:
    """The kind of the campaign's recordings; raises InvalidInput for several kinds, or none."""
    kinds = {recording.kind for recording in conditions.recordings}
    if len(kinds) != 1:
        raise InvalidInput("kind", sorted(kinds), "name one: the campaign's recordings are of several kinds, or none")
    kind: Kind = kinds.pop()  # type: ignore[assignment]
    return kind


def check_supported(mechanisms: Sequence[Mechanism], conditions: Conditions, kind: Kind) -> None:
    """Raise Unsupported at the first mechanism that the conditions, or this kind of recording, cannot support."""
    for mechanism in mechanisms:
        if kind not in mechanism.kinds:
            raise Unsupported(mechanism.name, f"does not act on recordings of kind {kind}")
        reason = mechanism.unsupported(conditions, kind)
        if reason is not None:
            raise Unsupported(mechanism.name, reason)


def chosen(names: Sequence[str], catalogue: Mapping[str, Mechanism]) -> list[Mechanism]:
    """The mechanisms of these names in order of composition; raises InvalidInput for an unknown or repeated name."""
    for name in names:
        if name not in catalogue:
            raise not_one_of("mechanisms", name, catalogue)
        if list(names).count(name) > 1:
            raise not_unique("mechanisms", name, "must be named once")
    return [mechanism for name, mechanism in catalogue.items() if name in names]
