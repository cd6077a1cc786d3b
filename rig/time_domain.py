"""Recordings as time series: shaker, tip, contact, sensor, amplifier, converter (mm, N, pC, s).

The shaker's force about the preload is made on a grid `_FINER` times finer than the converter's; tip and electronics
are integrated there (`linear_filters.apply`), the charge of a moving edge follows the curve Fσ(F) at every instant.
Noise is white plus 1/f; the converter has an anti-aliasing filter, rounds to its steps and saturates at its range.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import chirp, resample_poly

from rig import effects, linear_filters
from rig.experiment import Drive, Experiment
from rig.layer import Floats
from rig.recorded import make_response, recording_gains
from rig.true_response import TrueResponse

_FINER = 8
_RUN_IN_S = 2.0  # before the recording, for filters to settle
_SWEEPS = 16
_CYCLES_A_STEP = 10
_CURVE = np.linspace(-1.0, 1.0, 9)  # nodes of the curve of charge over force, in units of its reach


@dataclass(frozen=True)
class TimeSeries:
    """One recording: `force_n` and `charge_pc`, sampled together."""

    force_n: Floats
    charge_pc: Floats


def record_series(experiment: Experiment) -> tuple[TrueResponse, list[TimeSeries]]:
    """Carry out an experiment that records time series."""
    response = make_response(experiment)
    gains = recording_gains(experiment, len(response.contact))
    return response, [_recording(response, row, float(gain)) for row, gain in enumerate(gains)]


def _recording(response: TrueResponse, row: int, gain: float) -> TimeSeries:
    drive = response.experiment.drive
    assert drive is not None
    random = np.random.default_rng([response.experiment.seed, 4, row])
    rate = drive.sample_rate_hz * _FINER
    preload, dynamic = float(response.plan.preload_n[row]), float(response.plan.dynamic_n[row])
    applied = dynamic * shaker(drive, rate, random)
    tip = linear_filters.apply(linear_filters.resonance(response.on, float(response.stiffness[row])), applied, 1 / rate)
    charge = gain * _charge(response, row, tip)
    charge = linear_filters.apply(linear_filters.electrical(response.on, preload), charge, 1 / rate)
    time = np.arange(len(charge)) / rate
    charge += _mains(response, time, random)
    late = 1e-6 * effects.of(response.on, "timing_delay", "delay_us")
    if late:
        charge = CubicSpline(time, charge)(np.clip(time - late, 0, time[-1]))
    applied, charge = _sampled(applied, rate), _sampled(charge, rate)
    noise = coloured_noise(len(applied), drive, random)
    return TimeSeries(
        converted(preload + applied + drive.force_noise_n * random.normal(size=len(noise)),
                  drive.force_range_n, drive.converter_bits),
        converted(charge + noise, drive.charge_range_pc, drive.converter_bits),
    )  # fmt: skip


def shaker(drive: Drive, rate: float, random: np.random.Generator) -> Floats:
    """Force of the shaker over its peak amplitude, with the run-in; random excitation has the rms of such a sine.

    Parameters
    ----------
    drive : Drive
    rate : float
        Samples per second.
    random : numpy Generator

    Returns
    -------
    ndarray, (samples,)
    """
    if drive.kind == "stepped_sine":
        return _stepped_sine(drive, rate)
    samples = round((_RUN_IN_S + drive.duration_s) * rate)
    time = np.arange(samples) / rate
    if drive.kind == "sweep":
        period = drive.duration_s / _SWEEPS
        return chirp(time % period, drive.low_hz, period, drive.high_hz)
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    spectrum = random.normal(size=(2, len(frequency)))
    inside = (frequency >= drive.low_hz) & (frequency <= drive.high_hz)
    signal = np.fft.irfft(np.where(inside, spectrum[0] + 1j * spectrum[1], 0), samples)
    return signal / (np.sqrt(2) * signal.std())


def _stepped_sine(drive: Drive, rate: float) -> Floats:
    """Stepped sine of rising frequency; each tone has ten cycles and its share of the duration; the phase is
    continuous."""
    tones = np.geomspace(drive.low_hz, drive.high_hz, drive.steps)
    lengths = np.round((_CYCLES_A_STEP / tones + drive.duration_s / drive.steps) * rate).astype(int)
    lengths[0] += round(_RUN_IN_S * rate)
    return np.sin(np.cumsum(2 * np.pi * np.repeat(tones, lengths) / rate))


def _charge(response: TrueResponse, row: int, force: Floats) -> Floats:
    """Charge under the force about the preload, before the electronics: linear, or along the curve of a moving
    contact edge."""
    linear_charge = response.level[row] * force
    mobility = effects.of(response.on, "amplitude_nonlinearity", "mobility")
    if not mobility:
        return linear_charge
    preload = response.plan.preload_n[row]
    reach = min(float(np.abs(force).max()) / preload, 0.999)
    at_rest = response.sigma()[row]
    factor = np.maximum(1 + reach * _CURVE, 1e-6)
    curve = [(f * response.sigma(f)[row] - at_rest) * preload for f in factor]
    moved = CubicSpline(reach * preload * _CURVE, curve)(np.maximum(force, -reach * preload))
    linear = response.level[row] / response.effective_sigma[row]
    still = response.effective_sigma[row] - mobility * (response.first_harmonic[row] - at_rest)
    return linear * (still * force + mobility * (moved - at_rest * force))


def _mains(response: TrueResponse, time: Floats, random: np.random.Generator) -> Floats:
    """Mains with a third of the amplitude at the third harmonic, and a random phase."""
    charge, mains = (effects.of(response.on, "mains_pickup", name) for name in ("charge_pc", "mains_hz"))
    phase = 2 * np.pi * mains * time + 2 * np.pi * random.random()
    return charge * (np.sin(phase) + np.sin(3 * phase) / 3)


def _sampled(signal: Floats, rate: float) -> Floats:
    """The signal at the converter's rate, anti-aliased, without the run-in."""
    # The force jumps at the start of each sweep.
    return resample_poly(signal, 1, _FINER, padtype="line")[round(_RUN_IN_S * rate / _FINER) :]


def coloured_noise(samples: int, drive: Drive, random: np.random.Generator) -> Floats:
    """White noise of the drive's rms [pC] plus 1/f noise, equal to it at the corner frequency; (samples,)."""
    frequency = np.fft.rfftfreq(samples, 1 / drive.sample_rate_hz)
    frequency[0] = frequency[1]
    spectrum = np.fft.rfft(random.normal(size=samples)) * np.sqrt(1 + drive.flicker_corner_hz / frequency)
    return drive.charge_noise_pc * np.fft.irfft(spectrum, samples)


def converted(signal: Floats, end: float, bits: int) -> Floats:
    """The signal in steps of 2 end / 2^bits, saturated at the ends of the range."""
    step = 2 * end / 2**bits
    return np.clip(np.round(signal / step) * step, -end, end - step)
