"""FRFs of layers that stiffen or are compressible, against contacts solved anew between the table's nodes."""

import itertools

import numpy as np
import pytest

from bench.soak import SOAK
from tablegen.contact_column import press_spheres
from tablegen.neo_hookean import Material
from underskin.mechanisms.models.composed import compose
from underskin.recordings.campaign import Conditions, FrfConditions, Sensor, SkinDescription
from underskin.surrogate.sigma_table import load_table

RHO, LARGEST_LOAD = np.array([0.2, 0.6, 1.2]), 0.15
MATERIALS = [Material(0.5), Material(2.0), Material(5.0), Material(0.0, 0.33), Material(0.0, 0.47)]
SPOTS = list(itertools.product(MATERIALS, (0.37, 0.13, 0.86, 1.5, 2.2), (0.9, 0.4)))
HIGHEST = 0.5  # of the largest a/R that the largest load of a thick neo-Hookean layer gives, on a thin stiff one


def frf(laws: tuple[str, ...], force: float, radius: float, rho: float, material: Material) -> float:
    """The response over d33 · (3/2) ρ² of a layer of 1 mm with G = 1 MPa; lengths in mm, force in N."""
    skin = SkinDescription(
        thickness_mm=1.0,
        youngs_modulus_mpa=material.youngs_modulus,
        poisson_ratio=material.poisson_ratio,
        sensor_radius_mm=rho,
        sensors=(Sensor("s", 0.0, 0.0),),
    )
    recording = FrfConditions(
        "r", "s", preload_n=force, indenter_radius_mm=radius, dynamic_force_n=0.0, frequency_hz=np.array([30.0])
    )
    model = compose(laws, Conditions("spot", skin, (recording,)), load_table(), "frf")
    fit = np.array([parameter.start for parameter in model.parameters])
    values = {"stiffening": 0.0, "second_over_first": material.second_over_first, "mobile_fraction": 1.0}
    for index, parameter in enumerate(model.parameters):
        if parameter.name in values:
            fit[index] = values[parameter.name]
    d33 = np.exp(fit[[parameter.name for parameter in model.parameters].index("d33")])
    return float(model.predict(fit).value.real[0] / (1.5e-12 * rho**2 * d33))


@pytest.mark.slow
@pytest.mark.parametrize(("material", "edge", "share"), SPOTS if SOAK else SPOTS[10::20])
def test_spot_solves(material: Material, edge: float, share: float) -> None:
    """σ within 0.5 %, its increment d(Fσ)/dF within 1 %."""
    strain = (
        share * 0.44 / np.cbrt(1 + edge + 0.3 * edge**2) * (1.0 if material.second_over_first * edge < 1 else HIGHEST)
    )
    (sphere,) = press_spheres(edge, np.array([edge / strain]), RHO, 5, material)
    assert sphere.cbrt_load**3 < LARGEST_LOAD
    for number, rho in enumerate(RHO):
        law = ("strain_stiffening",) if material.second_over_first else ()
        laws = ("layered_contact", *law)
        still, moving = (
            frf(names, sphere.force, sphere.radius, float(rho), material)
            for names in (laws, (*laws, "moving_contact_edge"))
        )
        assert still == pytest.approx(sphere.sigma[number], rel=5e-3)
        assert moving == pytest.approx(sphere.sigma_increment[number], rel=1e-2)
