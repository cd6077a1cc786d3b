"""The stress in the layer under a sphere. Written by scripts/client_documents.py."""

from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class FieldAnswer(Document):
    """The stress σ_zz in the layer: from the table on the base, approximate above; exact on the surface in the contact
    `paper`."""

    model: Literal["layer", "linear_layer"]
    """`layer`: finite strain from the table, at ν = 0.5. `linear_layer`: small strain, at other ν."""

    contact: Literal["paper", "solved"]
    """As asked."""

    table_sha256: str
    """SHA-256 of the table of this contact, whose domain holds for both models."""

    status: Literal["ok", "out_of_domain"]
    """`out_of_domain`: outside the table, and null what depends on it; never extrapolated."""

    limit: str | None
    """Which limit it exceeds, with the highest force; null where it is `ok`."""

    contact_radius_mm: float | None
    """Radius a of the contact; null of a solved one at ν other than 0.5 [mm]."""

    a_over_h: float | None
    """a/h."""

    rt_over_h: float
    """rT/h."""

    load_parameter: float
    """L = F/(R²E)."""

    sigma: float | None
    """σ of the sensor, as POST /v1/frf has it."""

    rel_error: float | None
    """Bound on its relative error; null where no table was read."""

    mean_stress_mpa: float | None
    """Mean of −σ_zz over the sensor's disc, positive in compression [MPa]."""

    section_error: float | None
    """Bound on the error of σ_zz between surface and base, over the largest stress at the same depth: what finite
    strain changes is tabulated on the base alone, and is added in proportion to the depth; null for `linear_layer`,
    which leaves finite strain out, and for the contact `solved`, of which no bound is known."""

    r_mm: tuple[float, ...] | None
    """Distances from the axis of the contact [mm]."""

    depth_mm: tuple[float, ...] | None
    """Depths below the surface, the last is the base [mm]; before deformation, like r_mm."""

    sigma_zz_mpa: tuple[tuple[float, ...], ...] | None
    """Normal stress σ_zz per undeformed area, a row for each depth and a column for each distance; compression is
    negative [MPa]."""
