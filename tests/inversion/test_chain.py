"""d33 of time series through chains with delays, filters and noise in the force."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.shaken_series import D33, delayed, high_pass, low_pass, shaken
from underskin.diagnosis.slips.inspection import inspect
from underskin.findings.codes import FindingCode
from underskin.inversion.invert import Inversion, NoD33, invert
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import broadband
from underskin.recordings.frf.line_choice import without_noise_bias
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


def array_d33(inversion: Inversion) -> tuple[float, float, float]:
    assert inversion.campaign_d33 is not None
    value, _, low, high = inversion.campaign_d33.d33_rows()[0]
    return value, low, high


def codes(inversion: Inversion) -> set[str]:
    return {str(finding.code) for finding in inversion.findings}


@pytest.mark.parametrize(
    "chain",
    [
        {"charge": delayed(5e-3)},
        {"charge": delayed(20e-3)},
        {"charge": delayed(60e-3)},
        {"force": delayed(3e-3)},
        {"force": delayed(45e-3)},
        {"charge": delayed(150e-3), "samples": 8192},
    ],
)
def test_a_delay_of_either_channel_leaves_d33(chain: dict[str, Any], table: SigmaTable) -> None:
    """Neither the flat zone nor the check for dead sensors takes Re FRF of a delayed charge for its level."""
    inversion = invert(shaken(**chain), table)
    value, low, high = array_d33(inversion)
    assert value == pytest.approx(D33, rel=0.02)
    assert low < D33 < high
    assert inversion.flags == ()
    assert inversion.findings == ()
    assert "ms late (a delay, a filter or a resonance), which is taken off" in inversion.zone.reason


def test_turn_filter_not_stated_delay(table: SigmaTable) -> None:
    """A turn by a filter is not stated as a delay: phases behind a high-pass of two poles turn as by one."""
    inversion = invert(shaken(charge=lambda f: high_pass(150.0)(f) ** 2), table)
    assert "late" not in inversion.zone.reason
    assert FindingCode.BEHIND_FILTER in codes(inversion)


def test_an_inverted_sensor_is_told_whatever_the_delay(table: SigmaTable) -> None:
    turned = invert(shaken(charge=lambda f: -delayed(20e-3)(f)), table)
    assert array_d33(turned)[0] == pytest.approx(-D33, rel=0.02)


@pytest.mark.parametrize("share", [0.03, 0.1, 0.3])
@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_noise_in_the_force_biases_no_estimator(share: float, estimator: str, table: SigmaTable) -> None:
    """Where it was not excited the force is its own noise, which is in the excited band as well."""
    inversion = invert(shaken(force_noise=share, estimator=estimator), table)
    value, low, high = array_d33(inversion)
    assert value == pytest.approx(D33, rel=0.02)
    assert low < D33 < high
    if estimator == "H1":
        assert FindingCode.NOISE_IN_FRF in codes(inversion)
        assert inversion.zone.high_hz < 190


def struck(seed: int, blows: int, milliseconds: float, noise_n: float, rail: float = np.inf) -> Campaign:
    """One recording of blows under 1 N; the charge is clipped at `rail` of its largest, then 0.1 pC of noise added."""
    random, rate, seconds = np.random.default_rng(seed), 10240.0, 7.0
    time = np.arange(int(rate * seconds)) / rate
    after = time[:, None] - (0.4 + (seconds - 0.5) / blows * np.arange(blows) + random.uniform(-0.05, 0.05, blows))
    during = (after > 0) & (after < milliseconds / 1000)
    force = (during * np.sin(np.pi * after / (milliseconds / 1000)) ** 2 @ random.uniform(10, 30, blows)).astype(float)
    campaign = shaken(samples=8192)
    (recording, *_) = campaign.of(FrfRecording)
    charge = 7.3958 * force  # of D33 at the preload of 1 N
    series = replace(
        recording,
        preload_n=1.0,
        sample_rate_hz=rate,
        force_n=force + random.normal(0, noise_n, len(time)),
        charge_pc=np.minimum(charge, rail * charge.max()) + random.normal(0, 0.1, len(time)),
    )
    return replace(campaign, recordings=(series,))


@pytest.mark.parametrize(
    ("seed", "blows", "milliseconds", "noise_n"), [(1, 5, 6.0, 1.0), (3, 3, 6.0, 2.0), (1, 5, 2.0, 2.0)]
)
def test_blows_with_a_noisy_force_tell_their_bias(
    seed: int, blows: int, milliseconds: float, noise_n: float, table: SigmaTable
) -> None:
    """Few short blows leave most of the force's power to its noise: the lines they excite are found all the same.

    The bias is stated, and the interval holds d33, however little of it the noise leaves certain.
    """
    inversion = invert(struck(seed, blows, milliseconds, noise_n), table)
    _, low, high = array_d33(inversion)
    assert low < D33 < high
    assert inversion.zone.low_hz > 2.0
    assert FindingCode.NOISE_IN_FRF in codes(inversion)


def test_blows_clipped_before_noise_leave_d33(table: SigmaTable) -> None:
    """What reaches the end of the range is left out, which one finding says; where every blow does, the sensor is not
    called dead."""
    inversion = invert(struck(2, 5, 6.0, 0.02, rail=0.6), table)
    value, low, high = array_d33(inversion)
    (overload,) = [finding for finding in inversion.findings if finding.code == FindingCode.DAMAGED_SAMPLES]
    assert "overload; 2 more like it" in overload.statement
    assert low < D33 < high
    assert value == pytest.approx(D33, rel=0.02)
    with pytest.raises(NoD33, match="overload"):
        invert(struck(2, 5, 6.0, 0.02, rail=0.3), table)


@pytest.mark.parametrize("rail", [1.0, 1.55, 2.0])
def test_shaken_charge_clipped_before_noise_is_refused(rail: float, table: SigmaTable) -> None:
    """A charge clipped at so many standard deviations, with 0.5 % of noise behind, gives no d33: every block is hit."""
    random, campaign = np.random.default_rng(3), shaken(charge_noise=0.0)
    recordings = []
    for recording in campaign.of(FrfRecording):
        charge = np.asarray(recording.charge_pc, dtype=np.float64)
        end = rail * charge.std()
        behind = np.clip(charge, -end, end) + random.normal(0, 0.005 * end, len(charge))
        recordings.append(replace(recording, charge_pc=behind))
    with pytest.raises(NoD33, match="overload"):
        invert(replace(campaign, recordings=tuple(recordings)), table)


@pytest.mark.parametrize(
    "limited",
    [lambda q: np.clip(q, -0.9, 0.9), lambda q: np.minimum(q, 0.7), lambda q: 1.2 * np.tanh(q / 1.2)],
    ids=["hard", "one-sided", "soft"],
)
def test_shaken_charge_limited_behind_much_noise_is_refused(
    limited: Callable[[Floats], Floats], table: SigmaTable
) -> None:
    """A third of the samples at a limit, behind noise of 9 %, gives no d33; the same noise alone does."""
    random, campaign = np.random.default_rng(4), shaken(charge_noise=0.0)

    def of(limiter: Callable[[Floats], Floats]) -> Campaign:
        recordings = []
        for recording in campaign.of(FrfRecording):
            charge = np.asarray(recording.charge_pc, dtype=np.float64)
            rms = charge.std()
            behind = rms * (limiter(charge / rms) + 0.09 * random.standard_normal(len(charge)))
            recordings.append(replace(recording, charge_pc=behind))
        return replace(campaign, recordings=tuple(recordings))

    _, low, high = array_d33(invert(of(lambda charge: charge), table))
    assert low < D33 < high
    with pytest.raises(NoD33, match="as behind a limit: overload"):
        invert(of(limited), table)


def test_a_contact_that_bends_the_response_is_no_overload(table: SigmaTable) -> None:
    """A charge as F^1.4 under a sine of 0.8 of the preload is used; a charge that its amplifier limits is refused."""
    random, time = np.random.default_rng(5), np.arange(40000) / 2000.0

    def of(answer: Callable[[Floats], Floats]) -> Campaign:
        campaign = shaken(sample_rate_hz=2000.0)
        recordings = []
        for recording in campaign.of(FrfRecording):
            relative = 1 + 0.8 * np.sin(2 * np.pi * 20 * time)
            charge = 7.4 * recording.preload_n * (answer(relative) + 0.001 * random.standard_normal(len(time)))
            recordings.append(replace(recording, force_n=recording.preload_n * relative, charge_pc=charge))
        return replace(campaign, recordings=tuple(recordings))

    assert invert(of(lambda force: force**1.4), table).left_out == ()
    with pytest.raises(NoD33, match="overload"):
        invert(of(lambda force: np.tanh(force - 1)), table)


@pytest.mark.parametrize(("in_force", "in_charge"), [(0.08, 0.01), (0.0, 0.2)])
def test_nothing_tells_channel_noisy_interval(in_force: float, in_charge: float, table: SigmaTable) -> None:
    """Where nothing tells which channel is noisy the interval holds d33.

    Force and charge are white up to half the sample rate: γ² tells the noise of both together alone.
    """
    campaign = shaken(force_noise=in_force, charge_noise=in_charge, high_hz=400.0)
    value, low, high = array_d33(invert(campaign, table))
    assert low < D33 < high
    assert value == pytest.approx(D33, rel=0.12)


@pytest.mark.parametrize(("in_force", "in_charge"), [(0.0, 0.003), (0.0, 0.0045), (0.0, 0.01), (0.02, 0.0)])
def test_a_little_noise_over_all_lines_leaves_an_frf(in_force: float, in_charge: float) -> None:
    """Force and charge are white: no noise has a larger share of either's power than γ² lost, and what γ² does not tell
    apart is in the uncertainty."""
    random, samples, gain = np.random.default_rng(1), 2**16, 7.4e-12
    force, noise = 0.05 * random.standard_normal(samples), random.standard_normal((2, samples))
    charge = gain * (force + 0.05 * np.sqrt(in_charge) * noise[1])
    frf = broadband(force + 0.05 * np.sqrt(in_force) * noise[0], charge, 2000.0)
    level = without_noise_bias(frf, np.ones(len(frf.frequency), dtype=bool))
    assert level.bias_unsure > 0.003
    assert np.median(level.values.real) == pytest.approx(gain, rel=0.002 + 1.3 * level.bias_unsure)


@pytest.mark.parametrize(
    ("chain", "named"),
    [
        (high_pass(150.0), "high-pass of about 1"),
        (high_pass(40.0), "high-pass of about"),
        (low_pass(100.0), "low-pass of about"),
        (low_pass(60.0), "low-pass of about"),
        (low_pass(120.0, 2), "low-pass of about"),
    ],
)
def test_a_band_behind_a_filter_is_told_beside_d33(chain: Any, named: str, table: SigmaTable) -> None:
    """The flattest part of a flank is no flat zone."""
    inversion = invert(shaken(charge=chain), table)
    value, low, high = array_d33(inversion)
    told = [finding.sentence for finding in inversion.findings if finding.code == FindingCode.BEHIND_FILTER]
    assert low < D33 < high or any(named in sentence for sentence in told), (value, told)


@pytest.mark.parametrize("corner_hz", [60.0, 80.0, 120.0])
@pytest.mark.parametrize("polarity", [1.0, -1.0])
def test_two_poles_hide_no_sign(corner_hz: float, polarity: float, table: SigmaTable) -> None:
    """Behind a high-pass of two poles the filter is named, and the sign is that of the plateau.

    The phase goes from a half turn to nothing over the band, so that Re FRF has the opposite sign at its low end.
    """
    filtered = shaken(charge=lambda f: polarity / (1 - (corner_hz / f) ** 2 - 1j * np.sqrt(2) * corner_hz / f))
    inversion = invert(filtered, table)
    assert FindingCode.BEHIND_FILTER in codes(inversion)
    assert any("negative" in finding.sentence for finding in inversion.findings) == (polarity < 0)
    assert polarity * array_d33(inversion)[0] > 0.7 * D33
    inspected = inspect(filtered, table)
    assert ("sign_flipped" in {finding.code for finding in inspected.findings}) == (polarity < 0)


def test_a_quiet_chain_has_no_findings(table: SigmaTable) -> None:
    inversion = invert(shaken(), table)
    value, low, high = array_d33(inversion)
    assert value == pytest.approx(D33, rel=0.01)
    assert low < D33 < high
    assert codes(inversion) == set()
    assert "late" not in inversion.zone.reason


def test_a_filter_far_off_the_band_is_not_told(table: SigmaTable) -> None:
    inversion = invert(shaken(charge=high_pass(0.5)), table)
    assert codes(inversion) == set()
    assert array_d33(inversion)[0] == pytest.approx(D33, rel=0.01)


def test_a_dead_sensor_stays_dead(table: SigmaTable) -> None:
    """No delay is read from noise."""
    inversion = invert(shaken(charge=lambda f: np.zeros(len(f), dtype=complex)), table)
    assert [flag.sentence for flag in inversion.flags] == ["sensor s01: dead: no charge beyond noise"]
