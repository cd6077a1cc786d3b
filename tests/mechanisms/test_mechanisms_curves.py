"""Mechanisms of indentation and compression curves against exact laws, independent values and measured silicones."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from tests.support.mechanism_campaigns import (
    SKIN,
    compression_campaign,
    fit_of,
    hertz_force,
    predicted,
    table,
)
from tests.support.oracle import sphere_rows
from tests.support.sphere_contact import SphereOnLayer
from underskin.mechanisms import Normal, compose
from underskin.physics.elastic_layer import Layer
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, SkinDescription
from underskin.units import Floats

E_MPA, R_MM, H_MM = 2.0, 4.0, 2.5


def indentation(depth_mm: Floats, time_s: Floats | None = None, skin: SkinDescription = SKIN) -> Campaign:
    """One curve through these depths, as Hertz would give it."""
    force = hertz_force(depth_mm, R_MM, E_MPA)
    return Campaign("one", skin, (IndentationRecording("i", R_MM, depth_mm, force, time_s=time_s),))


def force_at(
    names: Sequence[str], depth_mm: Floats, time_s: Floats | None = None, begins: float = 0.0, **values: float
) -> Floats:
    """[N], with the contact beginning at 0."""
    return predicted(names, indentation(depth_mm, time_s), **{"contact_point i": begins, **values})


DEPTH = np.linspace(-0.05, 0.5, 56)


def test_the_base_model_is_hertz_with_a_contact_point() -> None:
    assert force_at([], DEPTH) == pytest.approx(hertz_force(DEPTH, R_MM, E_MPA))
    assert force_at([], DEPTH, begins=0.1) == pytest.approx(hertz_force(DEPTH - 0.1, R_MM, E_MPA))


def test_where_no_modulus_is_declared_it_is_free_and_found_by_hertz() -> None:
    recorded = indentation(DEPTH, skin=replace(SKIN, youngs_modulus_mpa=None))
    model = compose([], recorded, table())
    assert [parameter.unit for parameter in model.parameters] == ["MPa", "-", "-", "mm"]
    start = fit_of(model)
    assert np.exp(start[0]) == pytest.approx(E_MPA, rel=1e-3)
    assert model.predict(start).value == pytest.approx(hertz_force(DEPTH, R_MM, E_MPA), abs=2e-3)


def test_the_layer_pushes_back_as_the_independent_contact_says() -> None:
    rows = sphere_rows()
    a = H_MM * np.array([row["a_over_h"] for row in rows])
    depth = a**2 / R_MM * [row["indentation_r_over_a2"] for row in rows]
    force = 4 / 3 * E_MPA / 0.75 * a**3 / R_MM * [row["force_over_hertz"] for row in rows]
    shallow = depth < 0.4 * R_MM  # beyond, the sphere is no paraboloid
    assert shallow.sum() > 20
    assert force_at(["layered_contact"], depth[shallow]) == pytest.approx(force[shallow], rel=1e-5)


def test_adhesion_pulls_until_it_lets_go_at_the_jkr_depth() -> None:
    down, up = np.linspace(-0.1, 0.2, 31), np.linspace(0.2, -0.2, 4001)
    depth, w = np.concatenate([down, up]), 0.3
    force = force_at(["adhesion"], depth, work_of_adhesion=w)
    assert force[:10] == pytest.approx(np.zeros(10))  # nothing before the first touch
    unloading = force[len(down) :]
    assert unloading.min() == pytest.approx(-1.5 * np.pi * w * R_MM * 1e-3, rel=1e-4)
    radius, reduced = R_MM * 1e-3, E_MPA * 1e6 / 0.75
    pull_off = -0.75 * np.cbrt(np.pi**2 * w**2 * radius / reduced**2)  # JKR, under displacement control
    last = up[np.flatnonzero(unloading)[-1]] * 1e-3
    assert last == pytest.approx(pull_off, abs=1.1e-7)


def test_adhesion_on_the_layer_agrees_with_the_single_exact_contact() -> None:
    exact = SphereOnLayer(R_MM * 1e-3, E_MPA * 1e6, H_MM * 1e-3, Layer(), work_of_adhesion=0.3).at_force(2.0)
    depth = np.append(np.linspace(0, 1, 20) * exact.indentation * 1e3, 1.0)
    found = force_at(["layered_contact", "adhesion"], depth, work_of_adhesion=0.3)
    assert found[19] == pytest.approx(2.0, rel=1e-6)


def test_a_stiff_and_a_poisson_ratio_of_the_half_space_are_gains() -> None:
    found = force_at(["compressible_layer"], DEPTH, poisson_ratio=0.3)
    assert found == pytest.approx(hertz_force(DEPTH, R_MM, E_MPA) * 0.75 / 0.91)
    found = force_at(["modulus_error"], DEPTH, modulus_factor=1.5)
    assert found == pytest.approx(1.5 * hertz_force(DEPTH, R_MM, E_MPA))


def test_the_stage_gives_by_force_over_stiffness() -> None:
    force = force_at(["instrument_compliance"], DEPTH, stage_stiffness=5.0)
    assert force == pytest.approx(hertz_force(DEPTH - force / 5.0, R_MM, E_MPA), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("form", "exponent", "law"),
    [
        (1.0, 2.0, lambda x: 1 + x),  # Yeoh
        (0.0, 2.0, np.exp),  # Demiray
        (-1.0, 2.0, lambda x: 1 / (1 - x)),  # Gent
        (0.5, 2.0, lambda x: (1 + 0.5 * x) ** 2),
        (1.0, 1.0, lambda x: 1 + np.sqrt(3 * 8.0 * x)),  # grows with the strain itself
    ],
)
def test_stiffening_contact(form: float, exponent: float, law: Callable[[Floats], Floats]) -> None:
    depth = np.linspace(0.01, 0.5, 50)
    strain = 0.2 * np.sqrt(depth / R_MM)
    stretch = 1 - strain
    invariant = stretch**2 + 2 / stretch - 3
    ratio = law(8.0 * invariant)
    values = {"stiffening_coefficient": 8.0, "stiffening_form": form, "stiffening_exponent": exponent}
    found = force_at(["strain_stiffening"], depth, None, **values)
    assert found == pytest.approx(ratio * hertz_force(depth, R_MM, E_MPA))
    shallow = (1e-5 if exponent == 2.0 else 1e-7) * (depth + 1e-2)  # where the law in the strain itself is small, too
    small = force_at(["strain_stiffening"], shallow, None, **values)
    assert small == pytest.approx(hertz_force(shallow, R_MM, E_MPA), rel=1e-3)


def test_what_relaxes_and_stiffens_is_stiffer_by_the_contact_of_the_moment() -> None:
    """On the way in and in a hold; on the way back the contact is that of Ting's law, smaller than in equilibrium."""
    depth = np.concatenate([np.linspace(0.01, 0.5, 50), np.full(20, 0.5), np.linspace(0.49, 0.2, 30)])
    time = np.arange(100.0)
    creep = {"relaxed_fraction": 0.4, "relaxation_time": 10.0}
    law = {"stiffening_coefficient": 8.0, "stiffening_form": 1.0, "stiffening_exponent": 2.0}
    both = force_at(["contact_creep", "strain_stiffening"], depth, time, **creep, **law)
    relaxed = force_at(["contact_creep"], depth, time, **creep)
    stiffer = force_at(["strain_stiffening"], depth, time, **law) / hertz_force(depth, R_MM, E_MPA)
    assert both[:70] == pytest.approx((stiffer * relaxed)[:70])
    held = both[70:] > 0
    assert (both[70:][held] < (stiffer * relaxed)[70:][held]).all()


def test_a_ramp_of_force_relaxes_as_its_closed_form() -> None:
    recorded = compression_campaign()
    ramp = CompressionRecording(
        "c", 30.0, 30.0, np.linspace(0, 3e-4, 200), np.linspace(0, 0.01414, 200), time_s=np.linspace(0, 40, 200)
    )
    time = ramp.time_s
    assert time is not None
    faster = replace(ramp, id="faster", time_s=time / 4)  # at one speed alone creep cannot be told from a shape
    recorded = replace(recorded, recordings=(ramp, faster))
    begins = {"contact_point c": 0.0, "contact_point faster": 0.0}
    relaxed = predicted(["contact_creep"], recorded, **begins, relaxed_fraction=0.5, relaxation_time=8.0)
    ratio = relaxed[1:200] / predicted([], recorded, **begins)[1:200]
    memory = 1 - (1 - np.exp(-time[1:] / 8.0)) * 8.0 / time[1:]
    assert ratio == pytest.approx(1 - 0.5 * memory, rel=1e-4)  # so little strain is linear to that


def cylinder(strain: Floats) -> Campaign:
    recording = CompressionRecording("c", 20.0, 30.0, 20.0 * strain, 100 * strain)
    return Campaign("cylinder", SKIN, (recording,))


def stress_over_modulus(names: Sequence[str], strain: Floats, **values: float) -> Floats:
    force = predicted(names, cylinder(strain), **{"contact_point c": 0.0, **values})
    return force / (E_MPA * np.pi / 4 * 30.0**2)


def test_a_cylinder_is_neo_hookean_or_follows_yeohs_law() -> None:
    strain = np.linspace(-0.6, 0.6, 61)
    neo_hookean = pytest.approx(((1 - strain) ** -2 - (1 - strain)) / 3)
    assert stress_over_modulus([], strain) == neo_hookean
    assert (
        stress_over_modulus(["strain_stiffening"], strain, second_over_first=0.0, third_over_first=0.0) == neo_hookean
    )
    small = 1e-4 * strain
    found = stress_over_modulus(["strain_stiffening"], small, second_over_first=0.3, third_over_first=0.3)
    assert found == pytest.approx(small, rel=1e-4, abs=1e-12)


def test_platens_that_hold_stiffen_by_gent_and_lindleys_factor() -> None:
    strain = np.linspace(0.0, 1e-6, 61)
    ratio = stress_over_modulus(["platen_friction"], strain, friction=1.0)[1:] / strain[1:]
    assert ratio == pytest.approx(np.full(60, 1 + 2 * (30 / 80) ** 2), rel=1e-5)


@pytest.mark.parametrize("alpha", [-20.0, -0.5, 3.0, 6.0])
def test_ogden_exponent_is_that_of_his_energy(alpha: float) -> None:
    """Stiffening by Ogden's exponent is the derivative of (2E/3α²)(λ^α + 2 λ^(−α/2) − 3)."""
    strain, step = np.linspace(-0.4, 0.4, 41), 1e-5
    stretch = 1 - strain

    def energy(stretch: Floats) -> Floats:
        return 2 / (3 * alpha**2) * (stretch**alpha + 2 * stretch ** (-alpha / 2) - 3)

    expected = -(energy(stretch + step) - energy(stretch - step)) / (2 * step)
    law = {"second_over_first": 0.0, "third_over_first": 0.0, "ogden_exponent": alpha}
    assert stress_over_modulus(["strain_stiffening"], strain, **law) == pytest.approx(expected, rel=1e-6, abs=1e-6)


FOAM = {"collapse_strain": 0.1, "densification_strain": 0.8}


def test_foam_collapses_and_densifies() -> None:
    """A foam's skeleton relaxes towards its plateau, dσ/dε = 1 − σ/ε_c, and 1/(1 − ε/ε_D) of it is left to bear; it is
    linear in tension, and platens do not hold it."""
    strain = np.linspace(0.0, 0.6, 61)
    skeleton = solve_ivp(lambda _, stress: 1 - stress / 0.1, (0.0, 0.6), [0.0], t_eval=strain, rtol=1e-9, atol=1e-12).y
    stress = stress_over_modulus(["cell_collapse"], strain, **FOAM)
    assert stress == pytest.approx(skeleton[0] * sum((strain / 0.8) ** n for n in range(200)), rel=1e-6)
    assert stress[40] == pytest.approx(0.1963369, rel=1e-6)  # at 0.4: 0.1 (1 − e^-4)/(1 − 0.5)
    pulled = np.linspace(-0.3, 0.3, 61)
    assert stress_over_modulus(["cell_collapse"], pulled, **FOAM)[:30] == pytest.approx(pulled[:30])
    held = stress_over_modulus(["cell_collapse", "platen_friction"], strain, friction=1.0, **FOAM)
    assert held == pytest.approx(stress)


def test_packed_foam_goes_on_as_its_tangent() -> None:
    """Pressed beyond densification a foam's force stays finite, continuous and rising."""
    strain = np.linspace(0.7, 0.9, 401)
    stress = stress_over_modulus(["cell_collapse"], strain, **FOAM)
    slope = np.gradient(stress, strain)
    assert (slope > 0).all()
    assert np.abs(np.diff(slope)).max() < 0.06 * slope.max()


def test_cycles_soften_below_the_largest_strain() -> None:
    """The first loading is not softened; below the largest strain so far a fraction is lost, the same way in and
    back; beyond it the first loading goes on."""
    ways = [(0.0, 0.3), (0.3, 0.0), (0.0, 0.3), (0.3, 0.5), (0.5, 0.1)]
    strain = np.concatenate([np.linspace(*way, 31) for way in ways])
    base = stress_over_modulus([], strain)
    softened = stress_over_modulus(["cyclic_softening"], strain, softened_fraction=0.4, softening_strain=0.2)
    largest = 0.0
    for at, virgin, found in zip(strain, base, softened, strict=True):
        largest = max(largest, at)
        assert found == pytest.approx(virgin * (0.6 + 0.4 * np.exp(-(largest - at) / 0.2)), abs=1e-12)
    assert softened[45] / base[45] == pytest.approx(0.7986341, rel=1e-6)  # at 0.16: 0.6 + 0.4 e^-0.7
    assert softened[:31] == pytest.approx(base[:31])
    assert softened[93:124] == pytest.approx(base[93:124])


NEEDS_RECORDINGS = pytest.mark.skipif(
    "UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS does not name the folder of real recordings"
)


def fitted(names: Sequence[str], recorded: Campaign, measured: Floats) -> tuple[Floats, float]:
    """Fit the linear contact with noise of 0.5 % and the priors: the fit coordinates, the residual in percent of the
    largest force."""
    model = compose(names, recorded, table())
    priors = [parameter.prior for parameter in model.parameters]
    centres = [(prior.mean, prior.sd) if isinstance(prior, Normal) else (0.0, 1e-3) for prior in priors]
    mean, sd = np.array(centres).T
    noise = 0.005 * measured.max()

    def misfit(fit: Floats) -> Floats:
        return np.append((model.predict(fit).value - measured) / noise, (fit - mean) / sd)

    def slopes(fit: Floats) -> Floats:
        return np.vstack([model.predict(fit).slopes.T / noise, np.diag(1 / sd)])

    found = least_squares(misfit, fit_of(model), jac=slopes, x_scale=sd)
    return found.x, 0.5 * float(np.sqrt(np.mean(found.fun[: len(measured)] ** 2)))


@NEEDS_RECORDINGS
def test_a_sphere_in_a_well_feels_the_thin_layer() -> None:
    folder = Path(os.environ["UNDERSKIN_RECORDINGS"]) / "sphere-in-well/run_732_20251030"
    for well, height_mm, modulus_mpa in (("E5", 7.95, 7.44), ("E6", 8.37, 6.78), ("E7", 8.85, 6.84)):
        (path,) = folder.glob(f"well_{well}_*.csv")
        lines = [line.split(",") for line in path.read_text().splitlines()]
        rows = np.array([line for line in lines if len(line) == 4 and line[0][:1].isdigit()], dtype=float)
        force = -rows[:, 3]
        recording = IndentationRecording(well, 2.5, -rows[:, 1], force - np.median(force[:200]))  # in the air
        recorded = Campaign("well", SkinDescription(poisson_ratio=0.5, thickness_mm=height_mm), (recording,))
        _, on_half_space = fitted([], recorded, recording.force_n)
        fit, on_layer = fitted(["layered_contact"], recorded, recording.force_n)
        assert on_layer < 0.9 * on_half_space
        assert np.exp(fit[0]) == pytest.approx(modulus_mpa, rel=0.02)


@pytest.mark.slow
@NEEDS_RECORDINGS
def test_measured_silicone_is_nearly_neo_hookean_and_yeohs() -> None:
    path = Path(os.environ["UNDERSKIN_RECORDINGS"]) / "silicone-compression/EF30_0T/EF30_0T_A1.csv"
    rows = np.array([line.split(",")[:3] for line in path.read_text().splitlines()[8:-1:4]], dtype=float)
    recording = CompressionRecording("c", 30.0, 50.0, rows[:, 1], rows[:, 2])
    recorded = Campaign("measured", replace(SKIN, youngs_modulus_mpa=None), (recording,))
    residual = [fitted(names, recorded, rows[:, 2])[1] for names in ([], ["strain_stiffening"])]
    assert 0.5 < residual[0] < 1.5
    assert residual[1] < 0.4
