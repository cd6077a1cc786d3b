"""Finite strain in the force of an indentation, against an independent solution and the contact table."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from rig.solved.layer import Material, PressedLayer, Sublayer
from tests.support.mechanism_campaigns import SKIN, hertz_force, predicted
from underskin.mechanisms.models.sphere_contact import Layers, Sphere, Stiffening, layer_ratios
from underskin.mechanisms.models.sphere_kernels import LARGEST_CBRT_LOAD
from underskin.physics.sphere_law import SphereLaw
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.surrogate.hdf5_format import load_contact
from underskin.units import Floats

E_MPA, H_MM = 2.0, 2.5


def force_of(names: list[str], radius_mm: float, depth_mm: Floats, share: float, **values: float) -> Floats:
    """[N], with the contact beginning at 0."""
    depth = np.concatenate([np.linspace(0.0, 0.9 * depth_mm[0], 10), depth_mm])
    skin = replace(SKIN, thickness_mm=H_MM, youngs_modulus_mpa=E_MPA)
    recording = IndentationRecording("i", radius_mm, depth, hertz_force(depth, radius_mm, E_MPA))
    campaign = Campaign("one", skin, (recording,))
    return predicted(names, campaign, **{"contact_point i": 0.0, "finite_strain": share, **values})[10:]


def solved_force(material: Material, radius: float, depths: Floats) -> Floats:
    """[N] by the rig's solver, lengths in thicknesses."""
    pressed = PressedLayer((Sublayer(1.0, material),), radius, float(np.sqrt(radius * depths[-1])), 1.5)
    return np.array([pressed.press(depth) for depth in depths]) * E_MPA * H_MM**2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "depths"), [(1.5, [0.03, 0.08, 0.15]), (4.0, [0.04, 0.15, 0.25])], ids=["deep", "wide"]
)
def test_solved_force(radius: float, depths: list[float]) -> None:
    """The force is within 0.5 % of the finite-strain solution of the rig's solver, which shares no code; the linear
    layer's is up to several percent above."""
    solved = solved_force(Material(), radius, np.array(depths))
    at = ["layered_contact"], radius * H_MM, np.array(depths) * H_MM
    assert force_of(*at, share=1.0) == pytest.approx(solved, rel=5e-3)
    assert force_of(*at, share=0.0)[-1] > 1.015 * solved[-1]


@pytest.mark.slow
def test_solved_stiffening() -> None:
    """Yeoh's layer is followed within 0.3 % by the stiffening of the neo-Hookean contact, with E within 1.5 %; taken as
    stiffening of the linear contact it has E twice as far off."""
    depths = np.linspace(0.02, 0.16, 10)
    solved = solved_force(Material(c2=1.0), 1.0, depths)

    def misfit(fit: Floats, share: float) -> Floats:
        values = {"youngs_modulus": np.exp(fit[0]), "stiffening_coefficient": np.exp(fit[1]), "stiffening_form": 1.0}
        values["stiffening_exponent"] = 2.0
        return force_of(["layered_contact", "strain_stiffening"], H_MM, H_MM * depths, share, **values) / solved - 1

    right, linear = (least_squares(misfit, [0.0, 1.0], args=(share,)) for share in (1.0, 0.0))
    assert np.sqrt(np.mean(right.fun**2)) < 3e-3
    assert abs(right.x[0]) < 0.015
    assert abs(linear.x[0]) > 1.8 * abs(right.x[0])


@pytest.mark.parametrize("stiffening", [None, Stiffening(*(np.full((1, 1, 1), value) for value in (0.5, 1.0, 2.0)))])
@pytest.mark.parametrize("thickness", [None, 1e-3])
def test_share(stiffening: Stiffening | None, thickness: float | None) -> None:
    """At each radius the depth is the table's multiple of the linear contact's at the same force, in proportion to the
    share; the radius at a depth is that which has this depth."""
    layers = None if thickness is None else Layers(np.full((1, 1, 1), thickness), [layer_ratios(0.5)])
    modulus, radius = np.full((1, 1, 1), 2e6), np.full((1, 1), 2e-3)
    table = load_contact()
    nodes, cbrt_load = table.contact_axes
    node, load = (0 if thickness is None else 12), 9
    ratio = table.indentation[node, load]
    linear = Sphere(modulus, radius, layers)
    # On the half space L = (16/9)(a/R)³; on the layer R is such that L is the table's at its a/h.
    if thickness is None:
        a = np.full((1, 1, 1), (9 / 16) ** (1 / 3) * cbrt_load[load] * 2e-3)
    else:
        a = np.full((1, 1, 1), nodes[node] * thickness)
        force = linear.at(a)[0] * radius  # F R, which does not change with R
        linear = replace(linear, radius=np.cbrt(force * 4 / 3 / (modulus * cbrt_load[load] ** 3))[0])
    softer = linear.at(a)[1] * ratio
    assert replace(linear, strain_share=1.0).at(a)[1] == pytest.approx(softer, rel=3e-5)
    half = replace(linear, strain_share=0.5, stiffening=stiffening)
    assert half.at(a)[1] / linear.at(a)[1] == pytest.approx((1 + ratio) / 2, rel=3e-5)
    assert half.radius_at(half.at(a)[1], None) == pytest.approx(a, rel=1e-6)


@pytest.mark.parametrize("names", [[], ["layered_contact"]])
def test_depth_beyond_the_table(names: list[str]) -> None:
    """Beyond the table's load the correction stays, so that the force goes on without a kink."""
    assert load_contact().largest_solved == pytest.approx(LARGEST_CBRT_LOAD, rel=1e-12)
    depth = np.linspace(0.02, 1.2, 400)
    force = force_of(names, 2.0, depth, 1.0)
    assert (np.diff(force) > 0).all()
    assert np.abs(np.diff(np.diff(force) / np.diff(depth), 2)).max() < 0.02 * np.ptp(np.diff(force) / np.diff(depth))


@pytest.mark.parametrize("over_radius", [0.5, 0.8])
def test_whole_sphere(over_radius: float) -> None:
    """The softening of a sphere that is pressed deep is the same in the fit of one curve as in a diagnosis."""
    radius, depth = 2e-3, over_radius * 2e-3
    law = SphereLaw(radius, None, 0.5, load_contact().softening, full_sphere=True)
    sphere = Sphere(np.full((1, 1, 1), 1.0), np.full((1, 1), radius), deep=1.0, strain_share=1.0)
    a = sphere.radius_at(np.full((1, 1, 1), depth), None)
    assert law(np.array([depth])) == pytest.approx(sphere.at(a)[0].ravel(), rel=1e-4)
