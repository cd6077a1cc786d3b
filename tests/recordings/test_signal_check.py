"""Damage in a recorded signal is seen where it is, and nowhere else."""

import numpy as np
import pytest

from bench.soak import SOAK
from tests.recordings.known_signals import RATE, answer_to, dwelling, known_frf, rms_error, shaken, swept
from underskin.errors import InvalidInput
from underskin.recordings.frf.estimation import broadband, stepped_sine
from underskin.recordings.frf.spectra import Frf, defects, defects_of_pair
from underskin.units import Floats


def test_overload_is_seen_where_it_is_and_nowhere_else() -> None:
    _, charge = shaken(7)
    ceiling = np.quantile(charge, 0.98)
    found = defects("charge_pc", np.minimum(charge, ceiling))
    assert {defect.kind for defect in found} == {"overload"}
    assert all(charge[defect.first_sample : defect.first_sample + defect.samples].min() >= ceiling for defect in found)
    assert defects("charge_pc", charge) == []


@pytest.mark.parametrize("bits", [1, 2])
def test_overload_of_a_converter_whose_last_bits_flicker(bits: int) -> None:
    """At the limit of a converter its last bits flicker; samples accumulate on the levels that they make."""
    random, (_, charge) = np.random.default_rng(bits), shaken(7)
    step = np.ptp(charge) / 2**14
    ceiling = np.quantile(charge, 0.98)
    levels = np.round(np.minimum(charge, ceiling) / step)
    flickering = levels - (levels == levels.max()) * random.integers(0, 2**bits, len(charge))
    found = defects("charge_pc", step * flickering)
    assert {defect.kind for defect in found} == {"overload"}
    steady = defects("charge_pc", step * levels)
    assert sum(defect.samples for defect in found) == pytest.approx(sum(defect.samples for defect in steady), rel=0.05)
    assert defects("charge_pc", step * np.round(charge / step)) == []


@pytest.mark.parametrize("digits", [3, 4, 5])
def test_rounded_slow_sweeps_are_whole(digits: int) -> None:
    """Rounding is no jump, also where numbers of so many digits pass 1 and their last digit changes."""
    time = np.arange(16_384) / 1000.0
    force = 1.2 + 0.3 * np.sin(2 * np.pi * 1.0 * 90.0 ** (time / time[-1]) * time[-1] / np.log(90.0))
    rounded = np.array([float(f"{value:.{digits}g}") for value in force])
    assert defects("force_n", rounded) == []
    jumped = np.delete(rounded, slice(8000, 8080))
    assert any(abs(defect.first_sample - 8000) < 3 for defect in defects("force_n", jumped))


def test_tones_that_change_at_any_phase_are_whole() -> None:
    """Where one tone follows another with a jump, none of its samples was dropped."""
    time = np.arange(4000) / RATE
    force = 2.0 + 0.09 * np.concatenate([np.sin(2 * np.pi * hz * time) for hz in (3.1, 3.98, 5.98, 12.1)])
    frf = stepped_sine(force, answer_to(force), RATE)
    assert frf.defects == ()
    assert rms_error(frf) < 0.01


@pytest.mark.parametrize("lost", [11_950, 15_900])
def test_samples_lost_in_the_last_cycle_of_a_tone(lost: int) -> None:
    """Before the jump to the next tone, or where none follows, lost samples are told apart from that jump."""
    time = np.arange(4000) / RATE
    force = 2.0 + 0.09 * np.concatenate([np.sin(2 * np.pi * hz * time) for hz in (3.1, 3.98, 5.98, 12.1)])
    force, charge = (np.delete(signal, slice(lost, lost + 4)) for signal in (force, answer_to(force)))
    found = stepped_sine(force, charge, RATE).defects
    assert {defect.channel for defect in found} == {"force_n", "charge_pc"}
    assert all(abs(defect.first_sample - lost) < 3 for defect in found)


def test_a_channel_of_one_value_is_not_connected() -> None:
    """A charge that never changes is no charge of which samples were dropped."""
    force, _ = shaken(3, samples=4000)
    with pytest.raises(InvalidInput, match="are all one value: a dead sensor, or a channel that is not connected"):
        broadband(force, np.zeros(4000), RATE)


@pytest.mark.parametrize("samples", [0, 1, 2, 3])
def test_a_few_samples_show_no_defect(samples: int) -> None:
    signal = np.arange(float(samples))
    assert defects("charge_pc", signal) == []
    assert defects_of_pair(signal, signal) == []


def test_broadband_leaves_damaged_blocks_out() -> None:
    force, charge = shaken(10)
    damaged = charge.copy()
    damaged[30_000:30_100] = damaged[30_000]
    frf = broadband(force, damaged, RATE, block_samples=2000)
    whole = broadband(force, charge, RATE, block_samples=2000)
    assert [defect.kind for defect in frf.defects] == ["held_samples"]
    assert rms_error(frf) < 1.2 * rms_error(whole)
    assert frf.averages is not None
    assert whole.averages is not None
    assert frf.averages[0] < whole.averages[0]


def test_a_coarse_but_whole_sine_is_not_called_overloaded_or_held() -> None:
    for amplitude in (7.3, 20.0, 50.5, 203.2):
        sine = np.round(amplitude * np.sin(2 * np.pi * np.arange(20_000) * 3.1 / RATE))
        assert defects("force_n", sine) == []


def test_where_a_periodic_sweep_begins_anew_nothing_is_damaged() -> None:
    """It jumps there in force and charge, at one distance; so do samples lost at the end of each buffer, which are."""
    time = np.arange(1000) / RATE
    period = 1.0 + np.cos(2 * np.pi * (1.0 + 40.0 * time) * time + 0.7)
    force = np.tile(period, 8) + 1e-4 * np.random.default_rng(3).normal(size=8000)
    assert {defect.kind for defect in defects("force_n", force)} == {"jump"}
    assert defects_of_pair(force, 1e12 * answer_to(force)) == []
    spiked = 1e12 * answer_to(force)
    spiked[4321] += 3.0
    assert [(found.kind, found.channel) for found in defects_of_pair(force, spiked)] == [("jump", "charge_pc")]
    sine = np.sin(2 * np.pi * 3.73 * np.arange(9000) / RATE)
    lossy = np.delete(sine, [sample for start in range(1000, 9000, 1000) for sample in range(start, start + 30)])
    assert len([defect for defect in defects_of_pair(lossy, 7.0 * lossy) if defect.channel == "force_n"]) == 8


@pytest.mark.parametrize("period", [300.4, 251.25])
def test_a_period_need_not_be_a_whole_number_of_samples(period: float) -> None:
    time = np.arange(8000) % period / RATE
    force = 1.0 + np.cos(2 * np.pi * (4.0 + 120.0 * time) * time + 0.7)
    force = force + 1e-4 * np.random.default_rng(3).normal(size=8000)
    assert {defect.kind for defect in defects("force_n", force)} == {"jump"}
    assert defects_of_pair(force, 1e12 * answer_to(force)) == []


@pytest.mark.parametrize("kind", ["overload", "held_samples", "jump"])
def test_damage_is_named_and_left_out(kind: str) -> None:
    random = np.random.default_rng(8)
    force = dwelling([10.0], cycles=100)
    charge = answer_to(force) + 1e-16 * random.standard_normal(len(force))
    if kind == "overload":
        charge[6000:6400] *= 1.5
        charge = np.minimum(charge, 1.04 * np.quantile(charge, 0.9))
    elif kind == "held_samples":
        charge[7005:7045] = charge[7005]
    else:
        charge = np.concatenate([charge[:7010], charge[7030:], charge[-20:]])
    frf = stepped_sine(force, charge, RATE)
    assert kind in {defect.kind for defect in frf.defects}
    if kind != "jump":  # after lost samples of one channel, the phase is off for good
        np.testing.assert_allclose(frf.values, known_frf(frf.frequency), rtol=5e-3)


def test_coarse_levels_are_no_held_samples() -> None:
    """Noise of few levels repeats one by chance, and a slow signal turns on one; a hold within either is still seen."""
    random = np.random.default_rng(9)
    noise = np.round(4.0 * random.normal(size=100_000))
    sweeps = np.tile(np.round(400.0 * swept(1000)), 8)
    assert defects("force_n", noise) == []
    assert {found.kind for found in defects("force_n", sweeps)} <= {"jump"}
    noise[5000:5020] = noise[5000]
    assert [(found.kind, found.first_sample) for found in defects("force_n", noise)] == [("held_samples", 5000)]


def test_a_spike_is_a_defect_and_a_blow_is_not() -> None:
    random = np.random.default_rng(11)
    force = 0.001 * random.standard_normal(8192)
    spiked = force.copy()
    spiked[3000] = 5.0
    assert [defect.kind for defect in broadband(spiked, 1e-12 * force, RATE).defects] == ["jump"]
    force[3000:3005] += np.hanning(7)[1:-1]
    frf = broadband(force, answer_to(force), RATE, block_samples=8192, window="boxcar")
    assert frf.defects == ()
    struck = frf.frequency < 300  # the blow's own spectrum ends at 670 Hz
    assert rms_error(Frf(frf.frequency[struck], frf.values[struck])) < 0.03


def test_force_window_between_blows_is_no_overload() -> None:
    """A force that is exactly one value between blows, as a force window sets it, is undamaged; a cut peak is not."""
    force = np.full(16_384, 0.5)
    for first in (2000, 6000, 10_000, 14_000):
        force[first : first + 39] += np.hanning(41)[1:-1]
    charge = answer_to(force - 0.5) + 1e-16 * np.random.default_rng(12).standard_normal(len(force))
    assert defects_of_pair(force, charge) == []
    assert defects_of_pair(-force, charge) == []
    assert {found.kind for found in defects_of_pair(np.minimum(force, 1.2), charge)} == {"overload"}


def _whole(kind: str, random: np.random.Generator, samples: int) -> Floats:
    """A force of that kind, of magnitude about 1."""
    time = np.arange(samples) / RATE
    if kind == "sine":
        return np.sin(2 * np.pi * RATE / random.uniform(5.0, 300.0) * time)
    if kind == "sweep":
        return swept(samples) / 0.09
    if kind == "noise":
        spectrum = np.fft.rfft(random.standard_normal(samples))
        spectrum[int(random.uniform(0.1, 0.9) * len(spectrum)) :] = 0.0
        return np.fft.irfft(spectrum, samples) * 0.5
    if kind == "square":
        harmonics = np.arange(1, 2 * random.integers(2, 8), 2)
        turns = 2 * np.pi * np.outer(harmonics, time * RATE / (samples // 8))
        return np.asarray((np.sin(turns) / harmonics[:, None]).sum(axis=0))
    blows, length = np.zeros(samples), int(random.integers(8, 60))
    for first in np.linspace(100, samples - 200, 6).astype(int) + random.integers(0, 90, 6):
        blows[first : first + length] += random.uniform(0.3, 1.0) * np.hanning(length)
    return blows


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sine", "sweep", "noise", "square", "blows"])
def test_clipped_before_noise_was_added(kind: str) -> None:
    """A rail with noise behind it is overload in either channel; signals that dwell at their extremes are whole."""
    clipped_pairs = seen = 0
    for seed in range(20 if SOAK else 12):
        random = np.random.default_rng(seed)
        force, gain = _whole(kind, random, 8192), 7.4
        noise = random.normal(0.0, 10 ** random.uniform(-3.0, -1.5), (2, len(force)))
        whole = defects_of_pair(force + noise[0], gain * (force + noise[1]))
        assert {defect.kind for defect in whole} <= {"held_samples", "jump"}
        rail = 0.6 * np.abs(force).max()
        clipped = np.clip(force, -rail, rail) + 0.005 * rail * random.standard_normal(len(force))
        for channel, pair in (("force_n", (clipped, gain * force)), ("charge_pc", (force, gain * clipped))):
            found = {d.channel for d in defects_of_pair(*pair) if d.kind in ("overload", "limited")}
            assert found <= {channel}
            clipped_pairs += 1
            seen += bool(found)
    assert seen >= 0.9 * clipped_pairs


@pytest.mark.parametrize("limit", [1.0, 2.0, 2.5, 3.0])
@pytest.mark.parametrize("beyond", ["resonance", "low-pass", "nothing"])
def test_a_drive_of_limited_peaks_is_whole(limit: float, beyond: str) -> None:
    """A drive limited at so many standard deviations is not clipped, whatever follows it: charge past a contact
    resonance or a low-pass, or charge of its own."""
    random = np.random.default_rng(3)
    drive = _whole("noise", random, 32_768)
    drive = np.clip(drive, -limit * drive.std(), limit * drive.std())
    line = np.fft.rfftfreq(len(drive), 1 / RATE)
    passed = {
        "resonance": 1 / (1 - (line / 120.0) ** 2 + 0.06j * line / 120.0),
        "low-pass": 1 / (1 + 1j * line / 40.0),
        "nothing": np.zeros(len(line)),
    }[beyond]
    noise = 0.005 * random.standard_normal((2, len(drive)))
    charge = 7.4 * np.fft.irfft(np.fft.rfft(drive) * passed, len(drive))
    assert defects_of_pair(drive + noise[0], charge + noise[1]) == []


def test_limited_tones_are_refused_with_the_reason() -> None:
    random, force = np.random.default_rng(1), dwelling([10.0, 20.0, 30.0], cycles=100)
    force += 1e-3 * random.standard_normal(len(force))
    charge = answer_to(force) + 1e-14 * random.standard_normal(len(force))
    assert len(stepped_sine(force, charge, RATE).frequency) == 3
    charge -= charge.mean()
    with pytest.raises(InvalidInput, match="as behind a limit: overload"):
        stepped_sine(force, charge.std() * np.tanh(charge / charge.std()), RATE)


@pytest.mark.parametrize("power", [0.9, 1.1])
@pytest.mark.parametrize("kind", ["sine", "noise", "tones"])
def test_skin_and_noise_limit_no_charge(kind: str, power: float) -> None:
    """A charge that goes as such a power of a force of 0.3 rms of its preload is whole behind noise of up to 9 %; one
    limited softly, hard or on one side behind the same noise is not."""
    for seed in range(6 if SOAK else 2):
        random = np.random.default_rng([seed, len(kind)])
        turns = 2 * np.pi * np.outer(random.uniform(0.002, 0.05, 7), np.arange(8192)) + random.uniform(0, 6, (7, 1))
        force = np.sin(turns).sum(axis=0) if kind == "tones" else _whole(kind, random, 8192)
        force /= force.std()
        noise = 0.09 * random.standard_normal(len(force))
        with_preload = np.maximum(1 + 0.3 * force, 0.0)
        assert defects_of_pair(with_preload, with_preload**power + 0.3 * noise) == []
        for charge in (1.2 * np.tanh(force / 1.2), np.clip(force, -0.8, 0.8), np.minimum(force, 0.7)):
            assert {d.kind for d in defects_of_pair(with_preload, charge + noise)} & {"limited", "overload"}


def test_noise_of_the_force_limits_no_sweep() -> None:
    """A charge linear in a slow sweep is whole where a tenth of the power of the recorded force is noise."""
    time = np.arange(16_384) / 1000.0
    growth = np.log(75.0) / time[-1]
    shaker = np.sin(2 * np.pi * 2.0 * np.expm1(growth * time) / growth)
    for seed in range(12 if SOAK else 3):
        random = np.random.default_rng(seed)
        force = 10.0 + shaker + np.sqrt(0.1 * shaker.var() / 0.3) * random.standard_normal(len(time))
        charge = shaker + 0.01 * random.standard_normal(len(time))
        assert defects_of_pair(force, charge) == []
