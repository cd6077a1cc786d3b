"""Parameters that every model has, whatever its mechanisms: of FRFs d33 and factors on the declared modulus and
thickness; of a curve its modulus and where its contact begins,
and of an indentation what finite strain adds to its depth.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.errors import required
from underskin.mechanisms.parameter import Normal, Parameter, Uniform
from underskin.recordings.conditions import SkinDescription
from underskin.units import to_lab

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
_WIDE_SD = 1.5  # of the logarithm of a modulus that nobody declared


def frf_nuisances(skin: SkinDescription) -> tuple[Parameter, ...]:
    """d33, and the factors on the declared modulus and thickness, within the skin's tolerances where it states them."""
    off = skin.tolerances
    if off is None:
        return D33, YOUNGS_MODULUS, THICKNESS
    return D33, _within(YOUNGS_MODULUS, off.youngs_modulus_percent), thickness_parameter(skin)


def thickness_parameter(skin: SkinDescription) -> Parameter:
    """The factor on the declared thickness."""
    off = skin.tolerances
    return THICKNESS if off is None else _within(THICKNESS, off.thickness_percent)


def _within(factor: Parameter, percent: float) -> Parameter:
    sd = max(percent / 100, _LEAST_SD)
    reach = float(np.exp(_BOUNDS * sd))
    reason = f"the skin's tolerances: declared within {percent:g} %"
    return replace(factor, low=1 / reach, high=reach, prior=Normal(0.0, sd), reason=reason)


def modulus_parameter(skin: SkinDescription, estimates: Sequence[float]) -> Parameter:
    """A factor on the declared modulus, or the modulus itself, around the estimates [Pa], where none is declared."""
    if skin.youngs_modulus_mpa is not None:
        return YOUNGS_MODULUS
    middle = float(to_lab("youngs_modulus_mpa", np.median(estimates)))
    low, high, prior = middle * 1e-3, middle * 1e3, Normal(float(np.log(middle)), _WIDE_SD)
    return Parameter(
        "youngs_modulus", "MPa", low, high, prior, "log", limit=None, proportional=True, reason=_FREE_MODULUS
    )


def required_modulus(skin: SkinDescription) -> float:
    """The declared modulus [MPa]; raises InvalidInput where there is none and no measured curve tells it either."""
    if skin.youngs_modulus_mpa is None:
        raise required("skin.youngs_modulus_mpa", "required to predict curves that were not measured")
    return skin.youngs_modulus_mpa


def contact_point(recording: str, middle: float, sd: float, bound: float) -> Parameter:
    """The displacement at which the contact of one recording begins, around `middle` [m]."""
    middle_mm, sd_mm, bound_mm = (float(to_lab("displacement_mm", value)) for value in (middle, sd, bound))
    low, high, prior = middle_mm - bound_mm, middle_mm + bound_mm, Normal(middle_mm, sd_mm)
    name = f"contact_point {recording}"
    return Parameter(name, "mm", low, high, prior, "linear", limit=None, reason=_CONTACT_POINT)
