"""The virtual bench: noise, companions and what a law does to the state."""

from dataclasses import replace

import numpy as np
import pytest

from bench.soak import SOAK
from rig.unlisted.bench import (
    Companion,
    base_state,
    companion_column,
    companion_response,
    log_amplitude,
    measure,
    state,
)
from rig.unlisted.design import FINITE_STRAIN_CHI2, Design, axes, draw_design
from rig.unlisted.fits import Lines, base_chi2
from rig.unlisted.forms import candidates
from rig.unlisted.laws import Law
from rig.unlisted.observed import amplitudes


def _design(seed: int, **needs: bool) -> Design:
    return draw_design(np.random.default_rng(seed), frozenset(needs))


def test_designs_keep_their_promises() -> None:
    for seed in range(20):
        design = _design(seed)
        assert design.finite_strain_chi2 <= FINITE_STRAIN_CHI2
        assert np.unique(design.value("indenter_radius_mm")).size >= 2
        assert np.unique(design.value("preload_n")).size >= 4
        assert (np.diff(design.value("recorded_at")) > 0.0).all()
        assert float(np.hypot(*design.offset_xy.T).max()) < 0.9 * design.thickness_mm
        assert 0.005 <= design.noise.gain <= 0.08
        assert design.noise.position_mm <= 0.5
        assert {"preload_n", "indenter_radius_mm", "order", "previous_preload_n"} <= set(axes(design))


@pytest.mark.slow
def test_amplitudes_have_the_declared_covariance() -> None:
    """chi2 of the base model over many quiet campaigns: its mean and its spread."""
    chi2, freedom = [], []
    for seed in range(60 if SOAK else 30):
        design = _design(seed)
        data = measure(np.random.default_rng(1000 + seed), design, None, None)
        ones = np.ones(data.frf.shape, dtype=np.complex128)
        chi2.append(base_chi2(amplitudes(design, data, ones, None, base_state(design))))
        freedom.append(design.count - 1)
    total, dof = float(np.sum(chi2)), float(np.sum(freedom))
    # Nuisances of the diagnosis (E, h, sensor gains) are wider than the bench's own, so chi2 may fall a little short.
    assert 0.9 * dof < total < dof + 4.0 * np.sqrt(2.0 * dof)


def test_lines_have_the_declared_variance() -> None:
    total, dof = 0.0, 0
    for seed in range(20):
        design = _design(seed)
        data = measure(np.random.default_rng(seed), design, None, None)
        total += Lines(design, data, None, base_state(design)).base()[1]
        dof += 2 * data.frf.size - design.count
    assert total / dof == pytest.approx(1.0, abs=0.02)


def test_coherence_states_the_line_noise() -> None:
    design = _design(3)
    data = measure(np.random.default_rng(0), design, None, None)
    rel = design.noise.relative(design.frequency_hz)
    c, n = data.coherence[0], design.noise.averages
    np.testing.assert_allclose((1.0 - c) / (2.0 * n * c), rel**2)


def test_gain_error_is_log_normal() -> None:
    design = _design(4)
    quiet = replace(design, noise=replace(design.noise, gain=0.05, line=1e-6, floor=1e-9, position_mm=0.0))
    drawn = [measure(np.random.default_rng(seed), quiet, None, None) for seed in range(40)]
    logs = np.concatenate([np.log(np.abs(d.frf / d.exact)[:, 0]) for d in drawn])
    assert logs.std() == pytest.approx(0.05, rel=0.06)
    assert abs(logs.mean()) < 0.005


def test_contact_laws_are_one_and_the_same() -> None:
    """Modulus over s^3, force times s^3 and radius times s give one contact."""
    design, u = _design(5), 0.12
    values = []
    for acts_on, factor in (("contact_radius", 1.0), ("force", 3.0), ("modulus", -3.0)):
        law = Law(acts_on, "order", "exponential", (), (factor * u,))
        values.append(state(design, law).radius_mm)
    np.testing.assert_allclose(values[0], values[1])
    np.testing.assert_allclose(values[0], values[2])


def test_altered_hertz_exponent() -> None:
    design = _design(6)
    law = Law("contact_radius", "preload_n", "power", (), (0.4 - 1.0 / 3.0,), altered=True)
    a, f, r = state(design, law).radius_mm, design.value("preload_n"), design.value("indenter_radius_mm")
    slope = np.polyfit(np.log(f), np.log(a / np.cbrt(r)), 1)[0]
    assert slope == pytest.approx(0.4, abs=1e-9)


def test_tables_agree_with_the_exact_state() -> None:
    design = _design(7)
    data = measure(np.random.default_rng(0), design, None, None)
    observed = amplitudes(design, data, np.ones(data.frf.shape, dtype=np.complex128), None, base_state(design))
    base = log_amplitude(design, base_state(design))
    for acts_on, c in (("modulus", 0.5), ("force", 0.5), ("thickness", 0.15), ("position", 0.3)):
        along = "x" if acts_on == "position" else ""
        law = Law(acts_on, "order", "linear", (), (c,), along)
        exact = log_amplitude(design, state(design, law)) - base
        np.testing.assert_allclose(observed.phi(acts_on, along)(law.u(design))[0], exact, atol=4e-4)


def test_companions() -> None:
    design, s = _design(8), base_state(_design(8))
    resonance = companion_response(design, "contact_resonance", np.array([1e-6, 0.1]), s)
    np.testing.assert_allclose(resonance, 1.0, atol=1e-2)
    heavy = companion_response(design, "contact_resonance", np.array([1.0, 0.1]), s)
    assert (heavy.imag[:, 1] < 0.0).all()
    assert (companion_response(design, "amplifier_high_pass", np.array([1.0]), s).imag > 0.0).all()
    assert companion_column(design, Companion("ageing", (0.05,)), s)[0].max() < 0.0
    assert companion_column(design, Companion("preload_dependent_d33", (0.05,)), s)[0].min() > 0.0


def test_every_form_is_finite_on_every_axis() -> None:
    design = _design(9, recorded_at=True, temperature_c=True, operator=True, dwell_s=True)
    for name in axes(design):
        for shape in candidates(name, design.columns[name]):
            assert shape.basis.shape[1] == design.count, (name, shape.form)
            assert np.isfinite(shape.basis).all(), (name, shape.form)
