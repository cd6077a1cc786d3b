"""FRF estimation: right on systems whose FRF is known, at least as accurate as pyFRF, honest about its uncertainty."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from bench.soak import SOAK
from tests.recordings.known_signals import GAIN, RATE, answer_to, dwelling, known_frf, rms_error, shaken, swept
from underskin.errors import InvalidInput
from underskin.recordings.frf.estimation import broadband, estimate, periodic, resonance, stepped_sine
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.frf.spectra import Frf, period_of
from underskin.recordings.frf.stepped_sine import find_steps
from underskin.units import Floats


def test_broadband_recovers_a_known_system_and_a_lagging_charge_has_a_negative_phase() -> None:
    frf = broadband(*shaken(1), RATE, block_samples=2000)
    assert rms_error(frf) < 2e-3
    below = frf.frequency < 500
    assert np.all(np.angle(frf.values[below]) < 0)


def test_stepped_sine_recovers_a_known_system_and_its_phase() -> None:
    tones = [3.3, 10.0, 31.7, 100.0, 317.0, 700.0]
    force = dwelling(tones)
    frf = stepped_sine(force, answer_to(force), RATE)
    np.testing.assert_allclose(frf.frequency, tones, rtol=1e-4)
    np.testing.assert_allclose(frf.values, known_frf(np.array(tones)), rtol=2e-3)
    assert np.all(np.angle(frf.values) < 0)


def test_a_sweep_is_not_taken_for_tones() -> None:
    time = np.arange(round(1.25 * 4096)) / 4096
    force = 2.0 + 0.09 * np.sin(2 * np.pi * (2.0 + (600.0 - 2.0) / 2.5 * time) * time)
    assert find_steps(force, 4096.0) == []


def test_a_pure_delay_turns_the_phase_by_minus_omega_t() -> None:
    force = dwelling([20.0, 50.0])
    charge = 3e-12 * np.interp(np.arange(len(force)) - 5, np.arange(len(force)), force)
    frf = stepped_sine(force, charge, RATE)
    np.testing.assert_allclose(np.angle(frf.values), -2 * np.pi * frf.frequency * 5 / RATE, rtol=1e-3)


def test_preload_and_drift_of_the_charge_change_nothing() -> None:
    drift = 4e-12 * np.linspace(0, 1, 60_000)
    force, charge = shaken(2)
    clean, drifting = (broadband(force, charge + extra, RATE, block_samples=2000) for extra in (0.0, 7e-12 + drift))
    np.testing.assert_allclose(drifting.values, clean.values, rtol=1e-6)
    tones = dwelling([2.0, 40.0])
    charge = answer_to(tones)
    drift = 4e-12 * np.linspace(0, 1, len(tones))
    clean, drifting = (stepped_sine(tones, charge + extra, RATE) for extra in (0.0, 7e-12 + drift))
    np.testing.assert_allclose(drifting.values, clean.values, rtol=1e-4)


def repeated(period: Floats, times: int) -> tuple[Floats, Floats]:
    """A force that repeats itself about a preload, and the charge behind a high-pass at 3 Hz, settled."""
    force = np.tile(period, times + 20)
    charge = lfilter([GAIN, -GAIN], [1, -0.99], force)
    return 2.0 + force[20 * len(period) :], charge[20 * len(period) :]


@pytest.mark.parametrize("kind", ["sweep", "noise"])
def test_of_a_periodic_force_the_lowest_lines_are_right_too(kind: str) -> None:
    """A straight line taken off each block would take a part of them, and a window's neighbours mix with them."""
    force, charge = repeated(swept(1000) if kind == "sweep" else 0.05 * np.random.default_rng(3).normal(size=1000), 8)
    drift = np.linspace(0, 1, len(force))
    frf = estimate(force - 0.3 * drift, charge + 4e-12 * drift, RATE)
    np.testing.assert_allclose(frf.frequency[:3], [2.0, 4.0, 6.0])
    delay = np.exp(-2j * np.pi * frf.frequency / RATE)
    strong = frf.frequency < 290
    np.testing.assert_allclose(frf.values[strong], (GAIN * (1 - delay) / (1 - 0.99 * delay))[strong], rtol=1e-5)
    assert frf.independent
    assert frf.coherence is not None
    assert frf.coherence[strong].min() > 1 - 1e-9


def test_periods_are_found_and_only_where_there_are_some() -> None:
    random = np.random.default_rng(5)
    noise = random.normal(size=20_000)
    creep = 0.5 * np.exp(-np.arange(8000) / 3000.0)
    assert period_of(repeated(swept(1000), 8)[0] + 0.01 * noise[:8000] + creep) == 1000
    uneven = np.interp(np.arange(8000) % 800.4, np.arange(900), swept(900))
    assert period_of(uneven) in (800, 1601)
    narrow = lfilter([1.0], np.poly([0.995 * np.exp(0.1j), 0.995 * np.exp(-0.1j)]), noise)
    blow = np.zeros(8000)
    blow[100:110] = np.hanning(10)
    for force in (noise, narrow, blow, swept(8000), np.full(8000, 2.0), noise[:50]):
        assert period_of(force) == 0
    with pytest.raises(InvalidInput, match="repeat itself"):
        periodic(noise, noise, RATE)


@pytest.mark.slow
@pytest.mark.parametrize(("block", "overlap"), [("broadband", 0.0), ("broadband", 0.5), ("stepped", 0.0)])
def test_the_stated_uncertainty_and_the_variance_of_coherence_are_those_seen(block: str, overlap: float) -> None:
    random = np.random.default_rng(4)
    errors, coherences, stated, variances = [], [], [], []
    for _ in range(150 if SOAK else 100):
        if block == "broadband":
            force = random.standard_normal(8192)
            charge = force + random.standard_normal(8192)
            frf = broadband(force, charge, RATE, block_samples=512, overlap=overlap)
        else:
            force = np.sin(2 * np.pi * 50 * np.arange(4000) / RATE)
            charge = force + 1.5 * random.standard_normal(4000)
            frf = stepped_sine(force, charge, RATE)
        assert frf.coherence is not None
        assert frf.relative_uncertainty is not None
        assert frf.averages is not None
        errors.append(np.log(np.abs(frf.values)))
        coherences.append(frf.coherence)
        stated.append(np.mean(frf.relative_uncertainty**2))
        variances.append(np.mean(2 * frf.coherence * (1 - frf.coherence) ** 2 / frf.averages))
    assert np.mean(stated) == pytest.approx(np.mean(np.var(errors, axis=0)), rel=0.25)
    if block == "broadband":  # a fixed tone has less scatter in γ² than the random signals that the formula is for
        assert np.mean(variances) == pytest.approx(np.mean(np.var(coherences, axis=0)), rel=0.25)


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_at_least_as_accurate_as_pyfrf(estimator: Estimator, drift: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pyFRF import FRF
    random = np.random.default_rng(60)
    force, charge = shaken(6)
    force, charge = (x + 0.04 * np.std(x) * random.standard_normal(len(x)) for x in (force, charge))
    charge = charge + GAIN * drift * np.arange(len(force)) / RATE
    ours = broadband(force, charge, RATE, block_samples=2000, estimator=estimator)
    peer = FRF(
        int(RATE),
        force,
        charge * 1e12,
        exc_type="f",
        resp_type="d",
        window="hann",
        fft_len=2000,
        nperseg=2000,
        noverlap=1000,
    )
    theirs = Frf(ours.frequency, peer.get_FRF(frf_estimator=estimator)[0, 0, 1:1000] * 1e-12)
    assert len(peer.get_f_axis()) == 1001
    assert rms_error(ours) <= 1.005 * rms_error(theirs)  # what chance alone may do
    if drift:
        assert rms_error(ours) < 0.6 * rms_error(theirs)


@pytest.mark.parametrize(("natural_hz", "damping"), [(211.0, 0.004), (211.0, 0.05), (60.0, 0.2)])
def test_the_resonance_of_a_mass_on_a_spring_is_read_from_its_magnitude(natural_hz: float, damping: float) -> None:
    """Whatever the polarity and a delay do to the phase."""
    frequency = np.geomspace(1.0, 1000.0, 120)
    ratio = frequency / natural_hz
    values = -3e-11 * np.exp(-2e-3j * frequency) / (1 - ratio**2 + 2j * damping * ratio)
    random = np.random.default_rng(5)
    noise = 1e-13 * (random.normal(size=120) + 1j * random.normal(size=120))
    found = resonance(Frf(frequency, values + noise, None))
    assert found is not None
    assert found.frequency == pytest.approx(natural_hz, rel=0.005)
    assert found.damping == pytest.approx(damping, rel=0.1)


def test_no_resonance_is_read_where_none_stands_out_within_the_band() -> None:
    frequency = np.geomspace(1.0, 100.0, 60)
    rising = 1 / (1 - (frequency / 110.0) ** 2 + 0.02j * frequency)
    flat = np.random.default_rng(6).normal(1.0, 0.02, 60)
    assert resonance(Frf(frequency, rising.astype(np.complex128), None)) is None
    assert resonance(Frf(frequency, flat.astype(np.complex128), None)) is None


@pytest.mark.skipif("UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS does not name the folder")
@pytest.mark.parametrize(
    ("channel", "peaks", "median"),
    [(1, {21.1: None}, 0.024), (2, {19.7: 27.2, 40.0: 3.3, 160.7: 6.8, 461.3: 4.7}, 0.43)],
)
def test_a_hammer_blow_on_a_structure(channel: int, peaks: dict[float, float | None], median: float) -> None:
    """Resonances of a measured response as the folder's description gives them, in the file's units."""
    path = Path(os.environ["UNDERSKIN_RECORDINGS"]) / "impact-hammer-lvm" / "long_single_header_multi_ch.lvm"
    lines = path.read_text(encoding="latin-1").split("X_Value", 1)[1].splitlines()[1:]
    values = np.array([line.split("\t")[1:4] for line in lines if line], dtype=float)
    frf = broadband(values[:, 0], values[:, channel], 1 / 0.000977, block_samples=8192, overlap=0, window="boxcar")
    size = np.abs(frf.values)
    for peak, height in peaks.items():
        near = np.flatnonzero(np.abs(frf.frequency - peak) < 1)
        top = near[np.argmax(size[near])]
        assert frf.frequency[top] == pytest.approx(peak, abs=0.15)
        if height is not None:
            assert size[top] == pytest.approx(height, rel=0.02)
    low = (frf.frequency > 5) & (frf.frequency < 50)
    assert np.median(size[low]) == pytest.approx(median, rel=0.02)


@pytest.mark.parametrize(
    ("force", "charge", "field"),
    [
        (np.ones(20), np.ones(19), "charge_pc"),
        (np.ones(4), np.ones(4), "force_n"),
        (np.array([*np.ones(20), np.nan]), np.ones(21), "force_n"),
    ],
)
def test_unusable_series_are_refused_by_name(force: Floats, charge: Floats, field: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        estimate(force, charge, RATE)
    assert refusal.value.field == field
