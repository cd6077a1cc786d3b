"""Which sign convention the phases of FRFs have."""

from collections.abc import Callable

import numpy as np
import pytest

from underskin.diagnosis.screening.phase_convention import in_one_convention
from underskin.findings.codes import Reason
from underskin.recordings.campaign import FrfRecording
from underskin.units import Complexes, Floats

FREQUENCY = np.geomspace(1.0, 1000.0, 60)


def recordings(responses: list[Complexes], noise: float, seed: int = 5) -> list[FrfRecording]:
    """One for each response over `FREQUENCY`, with relative noise on each part."""
    random = np.random.default_rng(seed)
    lines = [7.0 * one * (1 + noise * (random.normal(size=60) + 1j * random.normal(size=60))) for one in responses]
    return [
        FrfRecording(
            f"r{number}", "s01", 4.0, 1.0, 0.09, frequency_hz=FREQUENCY, frf_re_pc_per_n=one.real,
            frf_im_pc_per_n=one.imag,
        )
        for number, one in enumerate(lines)
    ]  # fmt: skip


def reasons(entries: list[FrfRecording]) -> list[Reason]:
    return [finding.reason for finding in in_one_convention(entries)[1]]


def as_given(entries: list[FrfRecording]) -> bool:
    """Whether nothing is changed."""
    return all(one is other for one, other in zip(in_one_convention(entries)[0], entries, strict=True))


def delayed(microseconds: float) -> Complexes:
    return np.asarray(np.exp(-2e-6j * np.pi * FREQUENCY * microseconds))


def high_passed(corner_hz: float) -> Complexes:
    return np.asarray(1 / (1 - 1j * corner_hz / FREQUENCY))


@pytest.mark.parametrize("seed", range(4))
def test_channels_of_unlike_phase_are_no_other_convention(seed: int) -> None:
    """Each recording of its own phase, some milliradians, of either sign: far more than the noise of its lines."""
    phase = 0.004 * np.random.default_rng(seed).normal(size=12)
    entries = recordings([np.full(60, np.exp(1j * one)) for one in phase], 0.002, seed)
    turned, findings = in_one_convention(entries)
    assert findings == []
    assert all(one is other for one, other in zip(turned, entries, strict=True))


def test_a_phase_of_milliradians_in_two_signs_is_conjugated() -> None:
    """A delay of 3 µs: 4 mrad of root mean square."""
    wrong = np.arange(24) % 3 == 1
    entries = recordings([delayed(3.0).conj() if one else delayed(3.0) for one in wrong], 0.005)
    (finding,) = in_one_convention(entries)[1]
    assert finding.reason == Reason.RECORDINGS_CONJUGATED
    assert finding.arguments["conjugated"] == [f"r{number}" for number in np.flatnonzero(wrong)]


SMALL: list[tuple[Callable[[float], Complexes], float]] = [(delayed, 5.0), (high_passed, 0.1)]


@pytest.mark.parametrize(("law", "strength"), SMALL)
def test_a_small_phase_that_no_listed_mechanism_has_is_conjugated(
    law: Callable[[float], Complexes], strength: float
) -> None:
    given = recordings([law(strength)] * 24, 0.01)
    assert reasons(given) == []
    conjugated = recordings([law(strength).conj()] * 24, 0.01)
    assert reasons(conjugated) == [Reason.ALL_CONJUGATED]
    assert as_given(conjugated) == (law is delayed)


@pytest.mark.parametrize("microseconds", [20.0, 50.0, 500.0])
def test_a_pure_lead_is_either_conjugated_or_a_lag_of_the_force_channel(microseconds: float) -> None:
    """A conjugated delay is a force channel that lags, to the last digit: both are said, and nothing is changed."""
    leading = recordings([delayed(-microseconds)] * 24, 0.01)
    (finding,) = in_one_convention(leading)[1]
    assert finding.reason == Reason.ALL_CONJUGATED
    assert finding.arguments["lag_us"] == pytest.approx(microseconds, rel=0.1)
    assert "either the FRFs are conjugated" in finding.statement
    assert "nothing was changed" in finding.statement
    assert "e+" not in finding.statement
    assert as_given(leading)


def test_a_filter_on_the_force_channel_alone_is_a_lag() -> None:
    """Of second order at 10 kHz, critically damped: 2/ω0 late, 32 µs, far below its corner."""
    filtered = recordings([np.asarray((1 + 1j * FREQUENCY / 10e3) ** 2, dtype=np.complex128)] * 24, 0.01)
    (finding,) = in_one_convention(filtered)[1]
    assert finding.arguments["lag_us"] == pytest.approx(32.0, rel=0.1)
    assert as_given(filtered)


def test_a_lag_of_the_force_channel_beside_a_high_pass_is_no_other_convention() -> None:
    """The high pass tells that the phase is as it should be; conjugated, it tells that it is not."""
    lagging = high_passed(0.5) * delayed(-100.0)
    assert reasons(recordings([lagging] * 24, 0.01)) == []
    turned = recordings([(high_passed(0.5) * delayed(100.0)).conj()] * 24, 0.01)
    assert reasons(turned) == [Reason.ALL_CONJUGATED]
    assert not as_given(turned)


def _resonance(natural_hz: Floats, damping: float) -> list[Complexes]:
    ratio = [FREQUENCY / one for one in natural_hz]
    return [1 / (1 - one**2 + 2j * damping * one) for one in ratio]


def test_a_resonance_inside_the_band_is_not_conjugated_where_its_turn_cannot_be_followed() -> None:
    """Beyond a sharp resonance the phase is half a turn away, and noise decides which way round it is counted."""
    for seed in range(6):
        assert reasons(recordings(_resonance(np.geomspace(120, 150, 20), 0.01), 0.03, seed)) == []


def test_a_resonance_at_the_top_of_the_band_tells_the_convention() -> None:
    natural = np.geomspace(900.0, 1100.0, 20)
    assert reasons(recordings(_resonance(natural, 0.1), 0.005)) == []
    conjugated = recordings([one.conj() for one in _resonance(natural, 0.1)], 0.005)
    assert reasons(conjugated) == [Reason.ALL_CONJUGATED]
    assert not as_given(conjugated)


def test_a_conjugated_resonance_far_above_the_band_may_be_one_beside_a_lag_of_the_force_channel() -> None:
    """Its damping delays the charge by 2ζ/ω0, whatever the frequency."""
    natural = np.geomspace(1200.0, 2000.0, 20)
    assert reasons(recordings(_resonance(natural, 0.02), 0.005)) == []
    for either in (
        [one.conj() for one in _resonance(natural, 0.02)],
        [one * delayed(-20.0) for one in _resonance(natural, 0.02)],
    ):
        entries = recordings(either, 0.005)
        assert reasons(entries) == [Reason.ALL_CONJUGATED]
        assert as_given(entries)


@pytest.mark.parametrize("amplitude", [0.03, 0.3])
def test_a_vibrating_cable_leads_and_is_not_conjugated(amplitude: float) -> None:
    turn = 1j * FREQUENCY / 280.0
    assert reasons(recordings([1 + amplitude * turn**2 / (turn**2 + 1.4 * turn + 1)] * 24, 0.01)) == []
