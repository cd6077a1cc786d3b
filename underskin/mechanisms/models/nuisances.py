"""Parameters that every model has, whatever its mechanisms: of FRFs d33 and factors on the declared modulus and
thickness; of a curve its modulus and where its contact begins.
"""

from collections.abc import Sequence

import numpy as np

from underskin.errors import required
from underskin.mechanisms.base import Normal, Parameter
from underskin.recordings.conditions import SkinDescription
from underskin.units import to_lab

D33 = Parameter(
    name="d33",
    unit="pC/N",
    low=1e-3,
    high=1e5,
    prior=Normal(float(np.log(15.0)), 1.5),
    scale="log",
    limit=None,
    proportional=True,
    reason="what is measured; PVDF and its copolymers have 5 to 40 pC/N, ceramics up to some hundred",
)
YOUNGS_MODULUS = Parameter(
    name="youngs_modulus",
    unit="-",
    low=0.9,
    high=1.1,
    prior=Normal(0.0, 0.02),
    scale="log",
    limit=1.0,
    reason="a declared modulus is good to 2 %; a larger error is the mechanism modulus_error",
)
THICKNESS = Parameter(
    name="thickness",
    unit="-",
    low=0.95,
    high=1.05,
    prior=Normal(0.0, 0.01),
    scale="log",
    limit=1.0,
    reason="a declared thickness is good to 1 %; a larger error is the mechanism thickness_error",
)
FRF_NUISANCES = (D33, YOUNGS_MODULUS, THICKNESS)
_WIDE_SD = 1.5  # of the logarithm of a modulus that nobody declared


def modulus_parameter(skin: SkinDescription, estimates: Sequence[float]) -> Parameter:
    """A factor on the declared modulus, or the modulus itself, around the estimates [Pa], where none is declared."""
    if skin.youngs_modulus_mpa is not None:
        return YOUNGS_MODULUS
    middle = float(to_lab("youngs_modulus_mpa", np.median(estimates)))
    return Parameter(
        name="youngs_modulus",
        unit="MPa",
        low=middle * 1e-3,
        high=middle * 1e3,
        prior=Normal(float(np.log(middle)), _WIDE_SD),
        scale="log",
        limit=None,
        proportional=True,
        reason="what is measured; wide around the base model's own fit",
    )


def required_modulus(skin: SkinDescription) -> float:
    """The declared modulus [MPa]; raises InvalidInput where there is none and no measured curve tells it either."""
    if skin.youngs_modulus_mpa is None:
        raise required("skin.youngs_modulus_mpa", "required to predict curves that were not measured")
    return skin.youngs_modulus_mpa


def contact_point(recording: str, middle: float, sd: float, bound: float) -> Parameter:
    """The displacement at which the contact of one recording begins, around `middle` [m]."""
    middle_mm, sd_mm, bound_mm = (float(to_lab("displacement_mm", value)) for value in (middle, sd, bound))
    return Parameter(
        name=f"contact_point {recording}",
        unit="mm",
        low=middle_mm - bound_mm,
        high=middle_mm + bound_mm,
        prior=Normal(middle_mm, sd_mm),
        scale="linear",
        limit=None,
        reason="where the curve leaves zero, found by the base model",
    )
