"""The rig's own physics against exact values, limits and other routes; nothing of it is shared with the library."""

import math

import numpy as np
import pytest

import underskin
from rig import effects, finite_strain_solve, linear_filters
from rig.contact import sphere_contact
from rig.description import parse
from rig.errors import RigError
from rig.finite_strain import added_spectrum
from rig.layer import WAVENUMBERS, Layer, base_stress, hertz_shape
from rig.layer_contacts import LayerContacts
from rig.recorded import make_response
from rig.true_response import TrueResponse
from tests.support.cases import first
from tests.support.oracle import layer_rows, sphere_rows
from tests.support.rig_experiments import PARAMETERS, described
from underskin.surrogate.off_centre_sigma import positioned_sigma

RHO = 0.6


def number(cell: str) -> float:
    return float(cell or 0.0)


def test_stress_on_the_base_is_exact_for_every_layer() -> None:
    layers: dict[tuple[float, float], np.ndarray] = {}
    for row in layer_rows("sigma_hertz", "gamma_n"):
        kind = number(row["poisson_ratio"]), 2 * float(row["glue_stiffness_h_over_2g"])
        if kind not in layers:
            layers[kind] = Layer(*kind).transmission(WAVENUMBERS)
        spectrum = layers[kind] * hertz_shape(WAVENUMBERS * number(row["a_over_h"]))
        found = base_stress(spectrum[None], number(row["rt_over_h"]), np.array([number(row["offset_over_h"])]))
        assert found[0] == pytest.approx(float(row["value"]), rel=1e-7, abs=2e-8), row
    assert len(layers) == 8


def test_sphere_on_the_layer_is_exact() -> None:
    contact = sphere_contact(Layer())
    for row in sphere_rows():
        a, radius = np.array([row["a_over_h"]]), 10.0
        hertz_force, hertz_stiffness = 4 / 3 / 0.75 * a**3 / radius, 2 * a / 0.75
        assert contact.force(a, radius, 1.0) / hertz_force == pytest.approx(row["force_over_hertz"], rel=2e-5)
        depth = contact.depth(a, radius, 1.0) * radius / a**2
        assert depth == pytest.approx(row["indentation_r_over_a2"], rel=1e-5)
        stiffness = contact.stiffness(a, 1.0) / hertz_stiffness
        assert stiffness == pytest.approx(row["stiffness_over_hertz"], rel=1e-6)


def test_stiffness_is_the_slope_of_force_over_depth() -> None:
    contact = sphere_contact(Layer(0.4))
    a, step = np.array([0.2, 0.8, 1.9]), 1e-4
    force, depth = (
        np.array([curve(a * (1 + s * step), 5.0, 1.0) for s in (-1, 1)]) for curve in (contact.force, contact.depth)
    )
    assert np.diff(force, axis=0)[0] / np.diff(depth, axis=0)[0] == pytest.approx(contact.stiffness(a, 1.0), rel=1e-4)


def test_adhesion_on_a_deep_layer_is_that_of_johnson_kendall_and_roberts() -> None:
    a, radius, work = np.array([0.02, 0.04]), 0.5, 1e-5
    plane = 1 / 0.75
    expected = 4 * plane * a**3 / (3 * radius) - np.sqrt(8 * math.pi * work * plane * a**3)
    assert sphere_contact(Layer()).force(a, radius, 1.0, work) == pytest.approx(expected, rel=1e-3)
    found = sphere_contact(Layer()).radius_of(expected, np.full(2, radius), np.ones(2), work)
    assert found == pytest.approx(a, rel=1e-3)


def centred_sigma(a: float, load: float) -> float:
    spectrum = Layer().transmission(WAVENUMBERS) * hertz_shape(WAVENUMBERS * a)
    return float(base_stress(spectrum + added_spectrum(np.array([a]), np.array([load])), RHO, np.zeros(1))[0])


@pytest.mark.parametrize(("load", "ratio"), [(1e-3, 1.01293), (1e-2, 1.02966), (3e-2, 1.04522), (1e-1, 1.07489)])
def test_finite_strain_at_the_prototypes_contact(load: float, ratio: float) -> None:
    """Computed independently by Richardson extrapolation: known to 5e-5."""
    assert centred_sigma(0.3, load) / centred_sigma(0.3, 0.0) == pytest.approx(ratio, abs=2e-4)


@pytest.mark.slow
def test_finite_strain_as_kept_is_what_the_solver_gives_between_the_nodes() -> None:
    k = WAVENUMBERS[WAVENUMBERS < finite_strain_solve.HIGHEST_WAVENUMBER]
    for a in first(1, (1.03, 0.35)):
        solved = finite_strain_solve.added_spectrum(a, k, np.array([0.15, 0.3]))
        kept = added_spectrum(np.full(2, a), np.array([0.15, 0.3]) ** 3)[:, : len(k)]
        assert kept == pytest.approx(solved, abs=2e-5)


@pytest.mark.slow
def test_the_solver_carries_the_whole_load_to_the_base() -> None:
    layer = finite_strain_solve.FiniteStrainLayer(finite_strain_solve.make_mesh(0.6))
    assert layer.load(0.6).sum() == pytest.approx(-1, rel=1e-12)
    state = np.zeros(layer.size)
    state[2 * len(layer.mesh.r) :: 3] = 1.0
    pressed = layer.solve(state, 0.3 * layer.load(0.6))
    assert layer.spectrum(layer.residual(pressed)[0], np.zeros(1))[0] == pytest.approx(0.3, rel=1e-8)


def test_base_contact_is_hertz() -> None:
    pressed = LayerContacts(2.5, 16.0, {}, np.array([4.0]), np.array([1.0]), np.zeros(1))
    assert pressed.contact_radius[0] ** 3 == pytest.approx(0.75 * 0.75 * 1.0 * 4.0 / 16.0)


def response(**changes: object) -> TrueResponse:
    return make_response(parse(described(**changes)))


def test_the_frf_is_real_and_positive_in_compression_and_what_the_paper_says() -> None:
    lines = response(effects={}).lines(np.array([10.0, 100.0]))
    assert (lines.imag == 0).all()
    assert (lines.real > 0).all()
    a = (0.5625 * 0.5 * 4 / 16) ** (1 / 3)
    assert lines[0, 0].real == pytest.approx(14 * 1.5 * RHO**2 * centred_sigma(a / 2.5, 0.5 / (16 * 16)), rel=1e-9)


def test_resonance_where_tip_mass_and_contact_spring_say() -> None:
    rig = response(effects={"contact_resonance": {"tip_mass_g": 2.0, "damping": 0.01}})
    frequency = np.linspace(100, 2500, 24001)
    peak = frequency[np.argmax(np.abs(rig.lines(frequency)), axis=1)]
    expected = np.sqrt(rig.stiffness * 1e3 / 2e-3) / (2 * np.pi)
    assert peak == pytest.approx(expected, rel=1e-3)
    assert len(np.unique(peak.round())) == len(rig.contacts.force)  # it moves with preload and indenter


@pytest.mark.parametrize(
    ("name", "sign"),
    [
        ("contact_resonance", -1),
        ("amplifier_high_pass", 1),
        ("amplifier_low_pass", -1),
        ("sensor_relaxation", -1),
        ("timing_delay", -1),
    ],
)
def test_signs_of_phase(name: str, sign: int) -> None:
    """e^(+iωt): what comes late or follows with inertia has a negative phase, a high-pass leads."""
    lines = response(effects={name: PARAMETERS[name]}).lines(np.array([20.0]))
    assert (np.sign(lines.imag) == sign).all()


def test_relaxation_ladder_is_a_power_law() -> None:
    frequency = np.geomspace(0.5, 2000, 40)
    chain = linear_filters.electrical({"sensor_relaxation": {"law": "ladder", "exponent": 0.05}}, 1.0)
    power = (1j * frequency / 30) ** -0.05
    ratio = linear_filters.response(chain, frequency) / power
    assert np.abs(ratio / ratio[20] - 1).max() < 2e-3


def test_edges_that_move_agree_in_the_limit_of_a_small_amplitude() -> None:
    moving, cycling = (
        response(effects={name: {key: 1.0}}, design={"dynamic_forces_n": [1e-3]}).effective_sigma
        for name, key in (("moving_contact_edge", "mobile_fraction"), ("amplitude_nonlinearity", "mobility"))
    )
    assert moving == pytest.approx(cycling, rel=1e-5)


def test_a_fast_oscillation_meets_the_unrelaxed_modulus_on_the_contact_that_crept() -> None:
    crept = response(effects={"contact_creep": {"fraction": 0.4, "time_s": 10.0}}, design={"dwells_s": [1e6]})
    softer = response(effects={"modulus_error": {"factor": 0.6}})
    assert crept.contacts.contact_radius == pytest.approx(softer.contacts.contact_radius, rel=1e-12)
    assert crept.stiffness == pytest.approx(softer.stiffness / 0.6, rel=1e-12)


LIMITS: dict[str, dict[str, float]] = {
    "moving_contact_edge": {"mobile_fraction": 0}, "misalignment": {"x_mm": 0, "y_mm": 0},
    "adhesion": {"work_j_per_m2": 0}, "strain_stiffening": {"coefficient": 0},
    "compressible_layer": {"poisson_ratio": 0.5}, "interface_slip": {"glue_stiffness": 1e6},
    "preload_dependent_d33": {"beta_per_mpa": 0}, "sensor_spread": {"sd": 0}, "ageing": {"rate": 0, "cycles": 10},
    "contact_resonance": {"tip_mass_g": 0, "damping": 0.1}, "amplifier_high_pass": {"corner_hz": 0},
    "amplifier_low_pass": {"corner_hz": 1e9},
    "sensor_relaxation": {"exponent": 0}, "contact_creep": {"fraction": 0, "time_s": 10},
    "amplitude_nonlinearity": {"mobility": 0}, "crosstalk": {"fraction": 0}, "timing_delay": {"delay_us": 0},
    "modulus_error": {"factor": 1}, "thickness_error": {"factor": 1},
    "bending_substrate": {"amplitude": 0}, "preload_leak": {"corner_hz": 0, "power": 1},
    "temperature_drift": {"amplitude": 0, "period_h": 24}, "stage_wobble": {"amplitude_mm": 0, "period_recordings": 7},
    "hysteretic_d33": {"amplitude": 0}, "rattle": {"hz": 100, "amplitude": 0, "damping": 0.1},
    "notch": {"hz": 50, "left": 1, "width_hz": 10}, "cable_motion": {"hz": 300, "amplitude": 0},
    "cracked_electrode": {"amplitude": 0, "at_cycle": 10},
}  # fmt: skip
FREQUENCY = np.geomspace(2, 500, 12)


@pytest.mark.parametrize("name", LIMITS)
def test_every_effect_has_the_base_model_as_its_limit(name: str) -> None:
    base = response(effects={}).lines(FREQUENCY)
    assert response(effects={name: LIMITS[name]}).lines(FREQUENCY) == pytest.approx(base, rel=2e-6)


@pytest.mark.parametrize("name", [name for name in PARAMETERS if name not in ("mains_pickup", "layered_contact")])
def test_every_effect_changes_the_response(name: str) -> None:
    base = response(effects={}).lines(FREQUENCY)
    changed = response(effects={name: PARAMETERS[name]}).lines(FREQUENCY)
    assert np.abs(changed / base - 1).max() > 5e-3


def test_every_effect_of_a_recording_of_kind_frf_is_tested() -> None:
    assert set(PARAMETERS) == {name for name, effect in effects.ALL_EFFECTS.items() if effects.FRF in effect.kinds}
    assert set(LIMITS) == set(PARAMETERS) - {"mains_pickup", "layered_contact"}


def test_layered_contact_tends_to_hertz_on_a_thick_layer() -> None:
    thick = {"skin": {"thickness_mm": 60.0, "sensor_radius_mm": 36.0, "array": {"pitch_mm": 72.0}}}
    base, layered = (response(effects=on, **thick).contacts.contact_radius for on in ({}, {"layered_contact": None}))
    assert layered == pytest.approx(base, rel=1e-4)


def test_a_neighbours_charge_is_what_it_makes_of_its_own_stress() -> None:
    under = {"preload_dependent_d33": {"beta_per_mpa": 3.0, "law": "linear"}}
    made = {
        "skin": {"array": {"columns": 2, "pitch_mm": 4.0}},
        "design": {"preloads_n": [3.0], "indenters_mm": [10.0], "offsets_mm": [[1.5, 0.0], [-2.5, 0.0]]},
    }
    alone = response(effects=under, **made).level
    coupled = response(effects={**under, "crosstalk": {"fraction": 0.4}}, **made).level
    first, second = 0, 3  # the sphere in one place, 1.5 mm from the first sensor and 2.5 mm from the second
    assert coupled[first] == pytest.approx(alone[first] + 0.4 * alone[second], rel=1e-12)
    assert coupled[second] == pytest.approx(alone[second] + 0.4 * alone[first], rel=1e-12)


def test_a_neighbour_far_off_on_a_thin_skin_adds_no_charge() -> None:
    thin = {
        "skin": {"thickness_mm": 0.2, "sensor_radius_mm": 0.1, "array": {"columns": 2, "pitch_mm": 8.0}},
        "design": {"preloads_n": [0.2], "indenters_mm": [4.0], "offsets_mm": [[0.0, 0.0]]},
    }
    alone, coupled = (response(effects=on, **thin).level for on in ({}, {"crosstalk": {"fraction": 1.0}}))
    assert coupled == pytest.approx(alone, rel=1e-12)


@pytest.mark.slow
def test_all_effects_of_the_catalogue_work_together() -> None:
    together = {name: PARAMETERS[name] for name in PARAMETERS if name in effects.EFFECTS}
    assert np.isfinite(response(effects=together).lines(FREQUENCY)).all()


def test_a_contact_beyond_what_was_solved_is_refused() -> None:
    with pytest.raises(RigError, match=r"load parameter.*must be at most 0\.1"):
        response(skin={"youngs_modulus_mpa": 0.5}).lines(FREQUENCY)
    with pytest.raises(RigError, match=r"contact radius.*lower preload_n"):
        response(skin={"thickness_mm": 0.2, "sensor_radius_mm": 0.1}).lines(FREQUENCY)


def test_the_base_model_is_that_of_the_tables() -> None:
    """Two finite-element codes and two ways to transform, over what draws reach; sensors beside the contact too."""
    random = np.random.default_rng(11)
    a, load = random.uniform(0.05, 2.0, 300), 10 ** random.uniform(-4, -1, 300)
    table = underskin.load_table()
    spectrum = Layer().transmission(WAVENUMBERS) * hertz_shape(np.multiply.outer(a, WAVENUMBERS))
    spectrum = spectrum + added_spectrum(a, load)
    for rho in (0.3, 0.6, 1.2):
        for offset in (0.0, 0.5, 1.0):
            tabled = positioned_sigma(table, a, rho, load, np.full(300, offset), 0.0).sigma
            found = base_stress(spectrum, rho, np.full(300, offset))
            assert found == pytest.approx(tabled, rel=5e-4, abs=1e-5)
            assert np.median(np.abs(found / tabled - 1)) < 2e-5
