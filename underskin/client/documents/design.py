"""A skin before it is built. Written by scripts/client_documents.py."""

from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class ResponseAnswer(Document):
    """The response of a sensor to a load beside its centre."""

    offset_mm: tuple[float, ...]
    """Distance of the load from the sensor's centre [mm]."""

    sigma: tuple[float | None, ...]
    """σ there under the sphere."""

    gamma: tuple[float | None, ...]
    """γ there under a point load on the linear layer."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SweepAnswer(Document):
    """σ and γ above a sensor along one axis, the other two as designed."""

    axis: Literal["a_over_h", "rt_over_h", "load_parameter"]
    """Which axis."""

    value: tuple[float, ...]
    """Along it."""

    sigma: tuple[float | None, ...]
    """σ under the sphere; null outside the table."""

    gamma: tuple[float | None, ...]
    """γ under a point load on the linear layer; null outside the table."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignAnswer(Document):
    """What the skin tells of a load, and of two."""

    contact: Literal["paper", "solved"]
    """As asked."""

    table_sha256: str
    """SHA-256 of the table of this contact."""

    status: Literal["ok", "out_of_domain"]
    """`out_of_domain`: outside the table, and null what depends on it; never extrapolated."""

    limit: str | None
    """Which limit it exceeds, with the highest force; null where it is `ok`."""

    contact_radius_mm: float
    """Radius a of the contact [mm]."""

    a_over_h: float
    """a/h."""

    rt_over_h: float
    """rT/h."""

    load_parameter: float
    """L = F/(R²E)."""

    sigma: float | None
    """σ above the sensor's centre."""

    rel_error: float | None
    """Bound on its relative error."""

    gamma: float | None
    """γ of a point load above the sensor's centre."""

    mean_stress_mpa: float | None
    """Mean static stress on the sensor, positive in compression [MPa]."""

    frf_pc_per_n: float | None
    """Charge over force, where d33 is given [pC/N]."""

    resolution_mm: float | None
    """Spatial resolution: full width at half maximum of a sensor's response against the place of the load [mm]."""

    response_between_percent: float | None
    """Response to a load midway between two sensors, over that above a sensor [%]."""

    response_amid_percent: float | None
    """The same amid four sensors [%]."""

    two_point_separation_mm: float | None
    """From this distance on, two equal loads in line with a row of sensors are told apart wherever the row lies: a
    sensor between two others reads less than both by `dip_percent`; null where at this pitch they never are
    [mm]."""

    two_point_best_mm: float | None
    """The smallest distance at which they are where the row lies best; not less than where the contacts touch
    [mm]."""

    response: ResponseAnswer
    """Against the distance from the sensor."""

    sweeps: tuple[SweepAnswer, ...]
    """Against a/h, rT/h and L."""
