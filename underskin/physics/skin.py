"""The skin and the indenter, in SI.

Source: Seminara, Sensors 18 (2018) 459, section 2.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.errors import out_of_range
from underskin.units import Floats, checked

INCOMPRESSIBLE = 0.5


@dataclass(frozen=True)
class Skin:
    """An elastomer layer on a rigid base with circular sensors under it; scalars or arrays that broadcast.

    Attributes
    ----------
    thickness : ndarray
        h [m].
    youngs_modulus : ndarray
        E [Pa].
    sensor_radius : ndarray
        rT [m].
    poisson_ratio : ndarray
        ν [-].
    """

    thickness: Floats
    youngs_modulus: Floats
    sensor_radius: Floats
    poisson_ratio: Floats

    @classmethod
    def from_lab(
        cls,
        *,
        thickness_mm: ArrayLike,
        youngs_modulus_mpa: ArrayLike,
        sensor_radius_mm: ArrayLike,
        poisson_ratio: ArrayLike = INCOMPRESSIBLE,
        units_checked: bool = False,
    ) -> "Skin":
        """The skin from a lab's units.

        Raises
        ------
        InvalidInput
            Names the field that cannot be used, and guesses the unit that was meant.
        """
        return cls(
            thickness=checked("thickness_mm", thickness_mm, units_checked=units_checked),
            youngs_modulus=checked("youngs_modulus_mpa", youngs_modulus_mpa, units_checked=units_checked),
            sensor_radius=checked("sensor_radius_mm", sensor_radius_mm, units_checked=units_checked),
            poisson_ratio=_checked_poisson_ratio(poisson_ratio),
        )

    @property
    def rt_over_h(self) -> Floats:
        """Sensor radius over thickness, ρ [-]."""
        return self.sensor_radius / self.thickness


@dataclass(frozen=True)
class Indenter:
    """A rigid sphere of radius R [m], a scalar or an array."""

    radius: Floats

    @classmethod
    def from_lab(cls, *, indenter_radius_mm: ArrayLike, units_checked: bool = False) -> "Indenter":
        """The sphere from a lab's units; raises InvalidInput as `Skin.from_lab` does."""
        return cls(checked("indenter_radius_mm", indenter_radius_mm, units_checked=units_checked))


def _checked_poisson_ratio(value: ArrayLike) -> Floats:
    values = np.asarray(value, dtype=float)
    bad = ~((values >= 0.0) & (values <= INCOMPRESSIBLE))
    if bad.any():
        first = int(np.argmax(bad))
        raise out_of_range(
            "poisson_ratio", float(values.flat[first]), "must be 0 to 0.5", index=first if values.ndim else None
        )
    return values
