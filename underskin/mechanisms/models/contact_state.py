"""The contacts of a campaign on their way through a model: what is pressed, by what, and how. SI throughout."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.autodiff import Differentiated, chain, stacked
from underskin.units import Floats, Indices


@dataclass
class Contacts:
    """One row a contact, (…, contacts); a Differentiated of a single row stands for all of them."""

    force: Floats  # F [N]
    indenter_radius: Floats  # R [m]
    dwell: Floats  # time since the preload was put on [s]; 0 where no mechanism asks
    modulus: Differentiated  # E [Pa] in force in each contact: that of the static contact
    thickness: Differentiated  # h [m], of one row
    poisson_ratio: Differentiated  # ν, of one row
    slip: Differentiated | None = None  # of the glue line, 1/(1 + κ), of one row; None where it is rigid
    work_of_adhesion: Differentiated | None = None  # w [J/m²], of one row; None without adhesion
    relaxed: Differentiated | None = None  # that E over the one that a fast oscillation meets; None where they are one
    layered: bool = False  # contact by the layer of finite thickness, not by the half space
    stiffness: Differentiated | None = None  # dF/dδ [N/m] at the radius in force, where a mechanism asks

    def at_points(self, some: Indices | None) -> Contacts:
        """At some of several points (points, contacts), at all for None."""
        if some is None:
            return self
        return self._with({name: x.at_points(some) for name, x in self._differentiated().items()})

    @classmethod
    def stacked(cls, parts: Sequence[Contacts], points: Sequence[int]) -> Contacts:
        """Contacts of the same structure at several sets of points, of so many each."""
        if len(parts) == 1:
            return parts[0]
        each = [part._differentiated() for part in parts]
        return parts[0]._with({name: stacked([own[name] for own in each], points) for name in each[0]})

    def _with(self, changed: dict[str, Any]) -> Contacts:
        other = copy(self)
        vars(other).update(changed)
        return other

    def _differentiated(self) -> dict[str, Differentiated]:
        return {name: value for name, value in vars(self).items() if isinstance(value, Differentiated)}

    @property
    def reduced_modulus(self) -> Differentiated:
        """E' = E/(1 − ν²) [Pa]."""
        return self.modulus / (1 - self.poisson_ratio**2.0)

    @property
    def hertz_radius(self) -> Differentiated:
        """a [m] of a sphere on a half space without adhesion, a³ = 3 F R/(4 E'): `hertz.contact_radius` with slopes."""
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        a = np.cbrt(0.75 * self.force * self.indenter_radius * area / self.modulus.value)
        return chain(a, (-a / (3 * self.modulus.value), self.modulus), (a * (-2 * nu / (3 * area)), self.poisson_ratio))

    @property
    def cbrt_load(self) -> Differentiated:
        """L^(1/3) with which to enter the tables, which are for ν = 0.5: L = F/(R² E) · (0.75/(1 − ν²))²."""
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        x = np.cbrt(self.force / self.indenter_radius**2 / self.modulus.value * (0.75 / area) ** 2)
        return chain(x, (-x / (3 * self.modulus.value), self.modulus), (x * (4 * nu / (3 * area)), self.poisson_ratio))
