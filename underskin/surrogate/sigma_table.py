"""The finite-element table of σ under a dead Hertz pressure, as a contact model: `paper`."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from underskin.physics import hertz
from underskin.surrogate.contact_model import ContactModel, ContactRadius
from underskin.surrogate.hdf5_format import SIGMA_SCHEMA, Table
from underskin.units import Floats

SIGMA_TABLE = "sigma.h5"


class SigmaTable(ContactModel, Table):
    """A verified table of the transmission factor σ(a/h, rT/h, L) and of the stress profile on the base.

    The contact is Hertz' on a half space.
    """

    name = "paper"
    schema = SIGMA_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        axes = data["sigma/a_over_h"], data["sigma/rt_over_h"], data["sigma/cbrt_load_parameter"]
        rel_error = data["sigma/discretisation_error"] + data["sigma/interpolation_error"]
        self._tabulate(axes, data["sigma/sigma"], rel_error, data["profile/r_over_h"], data["profile/profile"])
        self.fem_linear_error = data["sigma/fem_linear_error"]

    def radius(
        self, force: Floats, indenter_radius: Floats, youngs_modulus: Floats, poisson_ratio: Floats, thickness: Floats
    ) -> ContactRadius:
        """Hertz' radius, which finite strain does not change."""
        a = hertz.contact_radius(force, indenter_radius, youngs_modulus, poisson_ratio)
        return ContactRadius(a / thickness, a)

    def load_over_cube(self, a_over_h: Floats) -> tuple[Floats, Floats]:
        """4/3 and 1/3, by Hertz."""
        return np.full_like(a_over_h, 4 / 3), np.full_like(a_over_h, 1 / 3)


def tables_folder() -> Path:
    """The folder of the tables: `UNDERSKIN_TABLES`, else in the installed package, else next to it in a checkout."""
    override = os.environ.get("UNDERSKIN_TABLES")
    if override:
        return Path(override)
    package = Path(__file__).parents[1]
    shipped = package / "tables"
    return shipped if shipped.is_dir() else package.parent / "tables"


def load_table(path: Path | None = None) -> SigmaTable:
    """The σ table at `path`, or the default one; raises TableError with the reason."""
    return SigmaTable(path or tables_folder() / SIGMA_TABLE)
