"""A skin as its campaign declares it, and how the base model's FRF follows from what is declared."""

import numpy as np

from underskin.physics.skin import Indenter, Skin
from underskin.prediction.pressed_skin import frf_gradient, transmission
from underskin.recordings.conditions import SkinDescription
from underskin.surrogate.contact_model import ContactModel
from underskin.units import Floats

DECLARED = ("thickness", "sensor_radius", "youngs_modulus")


def declared_skin(described: SkinDescription) -> Skin:
    """In SI; the campaign's reader has checked that it is whole, as FRFs need it, and its units."""
    assert described.thickness_mm is not None
    assert described.youngs_modulus_mpa is not None
    assert described.sensor_radius_mm is not None
    return Skin.from_lab(
        thickness_mm=described.thickness_mm,
        youngs_modulus_mpa=described.youngs_modulus_mpa,
        sensor_radius_mm=described.sensor_radius_mm,
        poisson_ratio=described.poisson_ratio,
        units_checked=True,
    )


def log_slopes(contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: Floats) -> dict[str, Floats]:
    """∂ ln FRF/∂ ln of each of `DECLARED` (rows,); NaN where the row is outside the domain."""
    slopes = frf_gradient(contact_model, skin, indenter, preload, 1.0)
    size = transmission(contact_model, skin, indenter, preload).frf(1.0)
    return {name: np.asarray(slopes[name] * getattr(skin, name) / size) for name in DECLARED}
