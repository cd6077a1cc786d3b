"""Laws of the grammar over frequency: causal, kept as they are, late or falling off as their names say."""

import numpy as np
import pytest

from tests.mechanisms.test_unlisted_laws import coordinates
from underskin.autodiff import Differentiated
from underskin.mechanisms.declared.document import parse
from underskin.mechanisms.declared.mechanism import value_of
from underskin.mechanisms.declared.saving import document
from underskin.mechanisms.unlisted.grammar import frequency_laws, phase_of_bump
from underskin.units import Floats


def hilbert_phase(log_magnitude: Floats, log_frequency: Floats) -> Floats:
    """Bode's integral by brute force: φ = (1/π) ∫ dM/dx ln coth(|x − x0|/2) dx on a grid of equal strides."""
    stride = log_frequency[1] - log_frequency[0]
    slope = np.diff(log_magnitude) / stride
    between = log_frequency[:-1] + stride / 2
    kernel = -np.log(np.tanh(np.abs(between - log_frequency[:, None]) / 2))
    return np.asarray(kernel @ slope * stride / np.pi)


@pytest.mark.slow
def test_laws_over_frequency_are_of_minimum_phase_or_turn_the_phase_alone() -> None:
    wide = np.linspace(np.log(1e-5), np.log(1e8), 3001)
    inner = slice(1250, 1850)  # some 2 to 5000 Hz
    for law in frequency_laws(np.geomspace(1.0, 1000.0, 30)):
        if law.variant in ("echo", "magnitude"):  # neither falls off: their integrals have no end
            continue
        values = dict(zip([entry.name for entry in law.parameters_stated], coordinates(law, 0.5), strict=True))
        seeds = {
            name: differentiated(entry.from_fit(values[name]))
            for entry in law.parameters_stated
            for name in [entry.name]
        }
        factor = law.factor(np.exp(wide), seeds).value[0]
        if law.variant in ("phase", "delay"):
            assert np.abs(factor) == pytest.approx(1.0)
            continue
        if law.variant in ("corner", "high_pass"):
            continue  # rise and fall without end
        expected = hilbert_phase(np.log(np.abs(factor)), wide)
        assert np.unwrap(np.angle(factor))[inner] == pytest.approx(expected[inner], abs=0.02), law.name


def test_a_delay_is_late_and_a_high_pass_is_an_amplifiers_of_any_order() -> None:
    frequency = np.geomspace(1.0, 1000.0, 30)
    laws = {law.variant: law for law in frequency_laws(frequency)}
    late = laws["delay"].factor(frequency, {"law_lag": differentiated(0.1)}).value[0]
    assert np.unwrap(np.angle(late)) == pytest.approx(-0.1 * frequency / np.sqrt(1000.0))
    amplifier = 1 / (1 - 3j / frequency)
    for order in (1.0, 2.0, 0.5):
        values = {"law_exponent": differentiated(order), "law_corner": differentiated(3.0)}
        assert laws["high_pass"].factor(frequency, values).value[0] == pytest.approx(amplifier**order)


def test_what_is_kept_of_a_law_over_frequency_is_that_law() -> None:
    frequency = np.geomspace(2.0, 500.0, 9)
    for law in frequency_laws(np.geomspace(1.0, 1000.0, 30)):
        values = {entry.name: entry.from_fit(entry.quantile(0.7)) for entry in law.parameters_stated}
        found = {"law": law.name, "parameters": values}
        said = {"acts_on": "frequency_response", "axis": "frequency_hz", "form": law.description.form}
        stated = {**said, "expression": "FRF", "range": {"frequency_hz": [1.0, 1000.0]}}
        report = {"unnamed": stated, "provenance": {"unnamed": found}, "campaign": "c", "verdict": "unexplained"}
        if law.description.form == "free":
            continue
        kept = parse(document(report, "kept").encode(), "kept.yaml")
        short = {name.removeprefix("law_"): value for name, value in values.items()}
        exact = law.factor(frequency, {name: differentiated(value) for name, value in values.items()}).value[0]
        factor = value_of(kept.laws[0], {**short, "frequency_hz": frequency})
        assert factor == pytest.approx(exact, abs=2e-3), law.name


def differentiated(value: float) -> Differentiated:
    return Differentiated(np.array([[value]]), np.zeros((0, 1, 1)))


def test_the_phase_of_a_bump_is_odd_and_that_of_its_slope() -> None:
    u = np.linspace(-4.0, 4.0, 81)
    phase = phase_of_bump(u, 1.0)
    assert phase == pytest.approx(-phase[::-1], abs=1e-6)
    assert phase[u < -0.5].min() > 0  # the magnitude rises there
