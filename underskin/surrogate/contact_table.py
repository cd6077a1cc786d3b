"""The finite-strain contact of a sphere with the layer: reference data that ships beside the tables that answer.

A rigid frictionless sphere of radius R is pressed with the force F into an incompressible neo-Hookean layer bonded to a
rigid base; L = F/(R² E). The library verifies and lists the file and computes nothing from it.
"""

from collections.abc import Mapping
from pathlib import Path

from underskin.surrogate.hdf5_format import CONTACT_SCHEMA
from underskin.surrogate.sigma_table import tables_folder
from underskin.surrogate.table_file import Table
from underskin.units import Floats

CONTACT_TABLE = "contact.h5"


class ContactTable(Table):
    """A verified table of contacts: its axes, domain and origin."""

    schema = CONTACT_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        self.axes = (
            data["contact/indenter_radius_over_h"],
            data["contact/cbrt_load_parameter"],
            data["stress/rt_over_h"],
        )

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest indenter_radius_over_h, load_parameter and rt_over_h, limits included."""
        radius, x, rho = self.axes
        return {
            "indenter_radius_over_h": (float(radius[0]), float(radius[-1])),
            "load_parameter": (float(x[0]) ** 3, float(x[-1]) ** 3),
            "rt_over_h": (float(rho[0]), float(rho[-1])),
        }


def load_contact(path: Path | None = None) -> ContactTable:
    """The contact table at `path`, or the default one; raises TableError with the reason."""
    return ContactTable(path or tables_folder() / CONTACT_TABLE)
