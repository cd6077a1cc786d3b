"""The FRF of a layer that stiffens by Yeoh's law, against the contact solved anew between the table's nodes."""

import numpy as np
import pytest

from bench.soak import SOAK
from tablegen.contact_column import press_spheres
from tests.support.cases import first
from underskin.mechanisms.models.composed import compose
from underskin.recordings.campaign import Conditions, FrfConditions, Sensor, SkinDescription
from underskin.surrogate.sigma_table import load_table

RHO, LARGEST_LOAD = np.array([0.2, 0.6, 1.2]), 0.15
SPOTS = [(c2, edge, share) for c2 in (0.5, 2.0, 5.0) for edge in (0.13, 0.37, 0.86, 1.5, 2.2) for share in (0.4, 0.9)]
HIGHEST = 0.5  # of the largest a/R that the largest load of a thick neo-Hookean layer gives, on a thin stiff one


def frf(laws: tuple[str, ...], force: float, radius: float, rho: float, c2: float) -> float:
    """The response over d33 · (3/2) ρ² of a layer of 1 mm and 3 MPa (G = 1 MPa), lengths in mm, force in N."""
    skin = SkinDescription(
        thickness_mm=1.0,
        youngs_modulus_mpa=3.0,
        poisson_ratio=0.5,
        sensor_radius_mm=rho,
        sensors=(Sensor("s", 0.0, 0.0),),
    )
    recording = FrfConditions(
        "r", "s", preload_n=force, indenter_radius_mm=radius, dynamic_force_n=0.0, frequency_hz=np.array([30.0])
    )
    model = compose(laws, Conditions("spot", skin, (recording,)), load_table(), "frf")
    fit = np.array([parameter.start for parameter in model.parameters])
    values = {"stiffening": 0.0, "second_over_first": c2, "mobile_fraction": 1.0}
    for index, parameter in enumerate(model.parameters):
        if parameter.name in values:
            fit[index] = values[parameter.name]
    d33 = np.exp(fit[[parameter.name for parameter in model.parameters].index("d33")])
    return float(model.predict(fit).value.real[0] / (1.5e-12 * rho**2 * d33))


@pytest.mark.slow
@pytest.mark.parametrize(("c2", "edge", "share"), first(1, SPOTS) if not SOAK else SPOTS)
def test_spot_solves(c2: float, edge: float, share: float) -> None:
    """σ within 0.5 %, its increment d(Fσ)/dF within 1 %."""
    strain = share * 0.44 / np.cbrt(1 + edge + 0.3 * edge**2) * (1.0 if c2 * edge < 1 else HIGHEST)
    (sphere,) = press_spheres(edge, np.array([edge / strain]), RHO, 5, c2)
    assert sphere.cbrt_load**3 < LARGEST_LOAD
    for number, rho in enumerate(RHO):
        laws = ("layered_contact", "strain_stiffening")
        still, moving = (
            frf(names, sphere.force, sphere.radius, float(rho), c2) for names in (laws, (*laws, "moving_contact_edge"))
        )
        assert still == pytest.approx(sphere.sigma[number], rel=5e-3)
        assert moving == pytest.approx(sphere.sigma_increment[number], rel=1e-2)
