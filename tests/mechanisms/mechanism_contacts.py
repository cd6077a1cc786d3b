"""Single contacts for the tests of the FRF's mechanisms, what is felt of them, and independent values."""

from tests.support.mechanism_campaigns import SKIN, campaign, frf_recording, predicted
from tests.support.oracle import sphere_rows
from underskin.recordings.campaign import FrfRecording, SkinDescription

H, E = 2.5e-3, 2e6  # of mechanism_campaigns.SKIN [m, Pa]
RHO = 0.6
LINEAR_MM = 1e12  # a sphere so large that L, and with it finite strain, vanishes at any a/h


def level(names: list[str], recording: FrfRecording, skin: SkinDescription = SKIN, **values: float) -> complex:
    """The first line of a recording for d33 = 1 C/N, in units of (3/2) ρ²: the σ that is felt."""
    assert skin.sensor_radius_mm is not None
    assert skin.thickness_mm is not None
    first = predicted(names, campaign([recording], skin), d33=1e12, **values)[0]
    return complex(first / (1.5 * (skin.sensor_radius_mm / skin.thickness_mm) ** 2))


def linear_contact(a_over_h: float, poisson_ratio: float = 0.5, offset_over_h: float = 0.0) -> FrfRecording:
    """A contact of this Hertz radius at vanishing L; the preload follows from a³ = 3FR(1 − ν²)/(4E)."""
    a = a_over_h * H
    preload = a**3 * 4 * E / (3 * LINEAR_MM * 1e-3 * (1 - poisson_ratio**2))
    return frf_recording(
        indenter_radius_mm=LINEAR_MM,
        preload_n=preload,
        dynamic_force_n=preload / 1e3,
        position_mm=(offset_over_h * H * 1e3, 0.0),
    )


def contacts_within_the_table() -> list[dict[str, float]]:
    """The independent contact values with a/h up to 2."""
    return [row for row in sphere_rows() if row["a_over_h"] <= 2]
