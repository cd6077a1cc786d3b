"""Mechanisms of the catalogue as rivals of a hidden law: what they explain, and what they cannot."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from rig.unlisted.bench import Companion, base_state, log_amplitude, measure, state
from rig.unlisted.design import Design, draw_design
from rig.unlisted.fits import Lines, base_chi2, fit_shapes, value
from rig.unlisted.laws import Law
from rig.unlisted.layer import log_transmission
from rig.unlisted.listed_lines import lines_chi2
from rig.unlisted.listed_static import Skin, static_chi2
from rig.unlisted.observed import Observed, amplitudes
from rig.unlisted.truth import IDENTIFIABLE, describe, observe
from tests.support.cases import first

CATALOGUE = {
    "modulus_error", "thickness_error", "compressible_layer", "interface_slip", "adhesion", "layered_contact",
    "strain_stiffening", "preload_dependent_d33", "ageing", "contact_creep", "moving_contact_edge",
    "amplitude_nonlinearity", "misalignment", "sensor_spread", "crosstalk",
}  # fmt: skip
SPECTRAL = {"timing_delay", "amplifier_high_pass", "sensor_relaxation", "contact_resonance", "mains_pickup"}


def _design(seed: int, *needs: str, gain: float = 0.01, position_mm: float = 0.0) -> Design:
    design = draw_design(np.random.default_rng(seed), frozenset(needs))
    return replace(design, noise=replace(design.noise, gain=gain, position_mm=position_mm))


def _entry(design: Design, law: Law, companion: Companion | None = None) -> dict[str, Any]:
    data = measure(np.random.default_rng(9), design, law, companion)
    return describe(design, data, law, companion, np.arange(0, design.count, 3))


def _quiet(design: Design, change: np.ndarray[Any, Any] | None = None) -> Observed:
    """The amplitudes of a base model measured without noise (but its covariance), with a change of ln |FRF|."""
    drawn = measure(np.random.default_rng(1), design, None, None)
    still = replace(drawn, frf=np.ones_like(drawn.frf) * np.exp(log_amplitude(design, base_state(design)))[:, None])
    observed = amplitudes(design, still, np.ones_like(drawn.frf), None, base_state(design))
    return replace(observed, residual=np.zeros(design.count) if change is None else change)


def only_of(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Of the static mechanisms try these alone."""
    every = Skin.forms
    monkeypatch.setattr(Skin, "forms", lambda skin: {name: f for name, f in every(skin).items() if name in names})


@pytest.mark.slow
def test_every_mechanism_that_can_act_is_fitted() -> None:
    full = _design(4, "load_cycles", "dwell_s", "sensor")
    assert set(static_chi2(_quiet(full))) == CATALOGUE
    bare = replace(full, shown=(), sensor=np.zeros_like(full.sensor), sensor_xy=full.sensor_xy[:1])
    assert CATALOGUE - set(Skin(bare).forms()) == {"sensor_spread"}
    assert CATALOGUE - set(static_chi2(_quiet(bare))) == {"ageing", "contact_creep", "sensor_spread", "crosstalk"}


@pytest.mark.slow
def test_mechanisms_reproduce_a_skin_with_another_parameter(monkeypatch: pytest.MonkeyPatch) -> None:
    """The base model of a skin with another E, h or position, made without the mechanism's own code."""
    design = _design(4, "sensor", "y_mm", gain=0.002)
    base = log_amplitude(design, base_state(design))
    softer = replace(design, modulus_mpa=0.6 * design.modulus_mpa)
    thicker = replace(design, thickness_mm=1.25 * design.thickness_mm)
    shift = np.tile([0.2 * design.thickness_mm, -0.1 * design.thickness_mm], (design.count, 1))
    member = np.random.default_rng(3).normal(0.0, 0.1, size=len(design.sensor_xy))
    changes = {
        "modulus_error": log_amplitude(softer, base_state(softer)) - base,
        "thickness_error": log_amplitude(thicker, base_state(thicker)) - base,
        "misalignment": log_amplitude(design, state(design, None, shift)) - base,
        "sensor_spread": member[design.sensor],
    }
    only_of(monkeypatch, *changes)
    for name, change in changes.items():
        seen = _quiet(design, change)
        assert base_chi2(seen) > 10.0, name
        assert static_chi2(seen)[name] < 0.01, name


@pytest.mark.parametrize("name", sorted(CATALOGUE - {"sensor_spread"}))
def test_mechanisms_recover_themselves(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From every form's own prediction away from the starts; whoever has no parameter is exact."""
    design = _design(4, "load_cycles", "dwell_s", "sensor", gain=0.001)
    base, forms = log_amplitude(design, base_state(design)), Skin(design).forms()[name]
    monkeypatch.setattr(Skin, "forms", lambda _: {name: forms})
    for form in forms:
        p = 0.8 * np.array(form.starts[-1]) + 0.2 * (0.7 * np.array(form.low) + 0.3 * np.array(form.high))
        seen = _quiet(design, form.predict(p) - base)
        assert static_chi2(seen)[name] < 0.02 * base_chi2(seen) + 0.01, p


def test_stiffening_is_self_consistent() -> None:
    """9 F R/16 = E a^3 with E at the strain 0.2 a/R, or at the mean pressure, of the radius a itself."""
    design = _design(4)
    skin, s = Skin(design), 3.0
    strain, pressure = (form.predict(np.array([s])) for form in skin.forms()["strain_stiffening"])
    for i in range(0, design.count, 7):
        force, radius = float(skin.force[i]), float(skin.sphere[i])
        e0, most = design.modulus_mpa, float(skin.radius[i])
        stiffness = {
            "strain": lambda a, e0=e0, radius=radius: e0 * (1.0 + s * 0.2 * a / radius),
            "pressure": lambda a, e0=e0, force=force: e0 + s * force / (np.pi * a * a),
        }
        for name, found in (("strain", strain), ("pressure", pressure)):
            e = stiffness[name]
            a = brentq(lambda a, e=e, f=force, r=radius: e(a) * a**3 - 9.0 * f * r / 16.0, 0.05 * most, most)
            exact = log_transmission(np.array([a]), skin.h, skin.r_t, float(skin.offset[i]))[0]
            assert found[i] == pytest.approx(exact, abs=1e-8), name


def test_a_small_amplitude_sees_a_moving_edge() -> None:
    """The first harmonic tends to d(F sigma)/dF as Fd/F tends to nothing, and departs from it at Fd/F = 0.8."""
    design = _design(4)
    predicted = {}
    for swing in (1e-3, 0.8):
        column = replace(design.columns["dynamic_force_n"], values=swing * design.value("preload_n"))
        driven = Skin(replace(design, columns=design.columns | {"dynamic_force_n": column})).forms()
        edge, harmonic = (
            driven[n][0].predict(np.array([1.0])) for n in ("moving_contact_edge", "amplitude_nonlinearity")
        )
        predicted[swing] = float(np.abs(edge - harmonic).max())
    assert predicted[1e-3] < 1e-5
    assert predicted[0.8] > 1e-3


def test_crosstalk_adds_the_charge_of_near_sensors_only() -> None:
    """Midway between two sensors both give the same; the third is 2 pitches away."""
    design = _design(4)
    xy = np.array([[0.0, 0.0], [2.0, 0.0], [-4.0, 0.0]])
    middle = {n: replace(design.columns[n], values=np.full(design.count, v)) for n, v in (("x_mm", 1.0), ("y_mm", 0.0))}
    for sensor, factor in ((0, 1.3), (1, 1.3), (2, 1.0)):
        own = replace(design, sensor_xy=xy, sensor=np.full(design.count, sensor), columns=design.columns | middle)
        change = Skin(own).forms()["crosstalk"][0].predict(np.array([0.3])) - log_amplitude(own, base_state(own))
        np.testing.assert_allclose(change, np.log(factor), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("companion", "name"),
    first(
        1,
        [
            (Companion("ageing", (0.06,)), "ageing"),
            (Companion("preload_dependent_d33", (0.3,)), "preload_dependent_d33"),
        ],
    ),
)
def test_static_mechanisms_of_the_bench_are_recognised(companion: Companion, name: str) -> None:
    design = _design(4, "load_cycles")
    data = measure(np.random.default_rng(2), design, None, companion)
    seen = amplitudes(design, data, np.ones_like(data.frf), None, base_state(design))
    found = static_chi2(seen)
    assert min(found, key=lambda n: found[n]) == name
    assert base_chi2(seen) > found[name] + 50.0
    assert found[name] < design.count + 4.0 * np.sqrt(2.0 * design.count)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parameters"),
    [("timing_delay", (500.0,)), ("amplifier_high_pass", (0.4,)), ("contact_resonance", (1.5, 0.08))],
)
def test_spectral_mechanisms_of_the_bench_are_recognised(name: str, parameters: tuple[float, ...]) -> None:
    design = _design(4)
    data = measure(np.random.default_rng(2), design, None, Companion(name, parameters))
    lines = Lines(design, data, None, base_state(design))
    found, freedom = lines_chi2(lines), 2 * data.frf.size - design.count
    assert set(found) <= SPECTRAL
    assert min(found, key=lambda n: found[n]) == name
    assert lines.base()[1] > found[name] + 100.0
    assert found[name] < freedom + 4.0 * np.sqrt(2.0 * freedom)


@pytest.mark.slow
def test_pick_up_of_the_mains_is_recognised() -> None:
    """A charge of random phase at 50 Hz and its harmonics, larger where the dynamic force is smaller."""
    design = replace(_design(4), frequency_hz=np.array([2.0, 5.0, 10.0, 20.0, 35.0, 49.0, 75.0, 101.0, 125.0, 149.0]))
    rng = np.random.default_rng(2)
    data = measure(rng, design, None, None)
    near = np.isin(design.frequency_hz, [49.0, 101.0, 149.0])
    phase = np.exp(2j * np.pi * rng.random(data.frf.shape))
    force = design.value("dynamic_force_n")[:, None]
    charge = 0.1 * float(np.median(np.abs(data.exact))) * float(np.median(force)) / force
    polluted = replace(data, frf=data.frf + near * charge * phase)
    clean, lines = (Lines(design, seen, None, base_state(design)) for seen in (data, polluted))
    assert -1e-3 < clean.base()[1] - lines_chi2(clean)["mains_pickup"] < 5.0
    freedom = 2 * data.frf.size - design.count
    share = near * 0.5 * charge**2 * lines.root**2
    expected = freedom + 2.0 * float(np.log1p(share).sum())
    found = lines_chi2(lines)["mains_pickup"]
    assert lines.base()[1] > found + 200.0
    assert found == pytest.approx(expected, abs=4.0 * np.sqrt(2.0 * freedom))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "needs", "names"),
    first(2, [
        (Law("frequency_response", "frequency_hz", "threshold", (), (-2.0, 9.5)), "order",
         {"timing_delay", "sensor_relaxation"}),
        (Law("contact_radius", "dwell_s", "saturating", (100.0,), (0.12,)), "dwell_s", {"contact_creep"}),
        (Law("gain", "load_cycles", "saturating", (2000.0,), (-0.12,)), "load_cycles", {"ageing"}),
    ]),
)  # fmt: skip
def test_a_law_that_is_a_listed_mechanism_is_not_identifiable(law: Law, needs: str, names: set[str]) -> None:
    """A radius that saturates over the dwell time; a gain that falls with load cycles; H near exp(-i w t0). A
    relaxation far above the band is a delay as well."""
    entry = _entry(_design(4, needs), law)
    assert entry["chi2_gain_over_base"] > 2.0 * IDENTIFIABLE
    assert entry["chi2_gain_over_best_listed"] < IDENTIFIABLE
    assert entry["best_listed"] in names
    assert not entry["identifiable"]


@pytest.mark.slow
def test_a_companion_of_the_catalogue_does_not_hide_a_law() -> None:
    law = Law("gain", "temperature_c", "linear", (), (0.2,))
    entry = _entry(_design(4, "temperature_c"), law, Companion("preload_dependent_d33", (0.3,)))
    assert entry["chi2_gain_over_best_listed"] > 0.7 * entry["chi2_gain_over_base"] > 100.0


@pytest.mark.slow
def test_a_companion_is_replaced_by_its_own_mechanism_and_kept_beside_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    only_of(monkeypatch, "crosstalk", "misalignment", "preload_dependent_d33")
    design, companion = _design(4), Companion("preload_dependent_d33", (1.0,))
    data = measure(np.random.default_rng(2), design, None, companion)
    flat = np.ones_like(data.frf)
    beside, untouched = (amplitudes(design, data, flat, c, base_state(design)) for c in (companion, None))
    found, alone, others = static_chi2(beside, companion.name, untouched), static_chi2(untouched), static_chi2(beside)
    assert found == others | {companion.name: alone[companion.name]}
    assert alone["crosstalk"] > found["crosstalk"] + 50.0


@pytest.mark.soak
def test_the_base_model_is_within_reach_of_the_mechanisms() -> None:
    """Where there is no law, the best mechanism gains what a few parameters gain from noise, and never less than 0."""
    gains = []
    for seed in range(5):
        design = _design(seed, gain=0.02)
        data = measure(np.random.default_rng(seed), design, None, None)
        seen = amplitudes(design, data, np.ones_like(data.frf), None, base_state(design))
        gains.append(base_chi2(seen) - min(static_chi2(seen).values()))
    assert min(gains) > -1e-6
    assert np.median(gains) < 12.0


def test_gains_of_a_loss_angle_are_the_same_on_angles_and_on_lines() -> None:
    """The gain over the base model is counted on angles, that of the mechanisms on lines."""
    design = _design(4)
    law = Law("frequency_response", "order", "linear", (), (0.05,))
    data = measure(np.random.default_rng(2), design, law, None)
    seen, lines = observe(design, data, law, None), Lines(design, data, None, base_state(design))
    fit = min(fit_shapes(seen, law.acts_on, "", [law.on(design)], np.array(law.coefficients)), key=lambda f: f.chi2)
    turned = np.exp(-1j * value(fit, seen, law.acts_on, ""))[:, None] * np.ones_like(data.frf)
    on_lines = lines.base()[1] - float((lines.misfit(turned) ** 2).sum())
    assert on_lines == pytest.approx(base_chi2(seen) - fit.chi2, rel=0.05)
