"""Pictures of the mechanisms: each is its law's own, weaker and stronger as it says; twins are those of the physics."""

from functools import cache

import numpy as np
import pytest

from underskin import load_table
from underskin.figures.law_effect import LawEffect, Twin, law_effect, law_twins
from underskin.mechanisms.registry import built_in
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

NAMES = [mechanism.name for mechanism in built_in()]


@cache
def table() -> SigmaTable:
    return load_table()


@cache
def effect(name: str) -> LawEffect:
    return law_effect(name, table())


def number(words: str) -> float:
    """The first number of a strength in words."""
    return float(next(part for part in words.replace(",", "").split() if part[0].isdigit()))


def response(name: str, strength: int) -> Floats:
    """The complex factor that a law is on the base model's FRF."""
    magnitude, phase = effect(name).panels
    turned = np.exp(1j * np.radians(phase.curves[strength] - phase.base))
    return np.asarray(magnitude.curves[strength] / magnitude.base * turned)


@pytest.mark.parametrize("name", NAMES)
def test_each_law_changes_something_and_the_more_the_stronger_it_is(name: str) -> None:
    drawn = effect(name)
    sizes = []
    for curves in zip(*(panel.curves for panel in drawn.panels), strict=True):
        assert all(np.isfinite(curve).all() for curve in curves)
        sizes.append(sum(float(np.abs(curve - p.base).sum()) for curve, p in zip(curves, drawn.panels, strict=True)))
    assert sizes[0] > 0
    assert sizes == sorted(sizes)
    assert len(set(drawn.strengths)) == len(sizes) == (1 if name in ("layered_contact", "cell_collapse") else 3)
    assert len(drawn.changes) == len(sizes)


def test_a_delay_turns_the_phase_back_and_leaves_the_magnitude() -> None:
    for strength, words in enumerate(effect("timing_delay").strengths):
        delay = number(words) * 1e-6
        exact = np.exp(-2j * np.pi * effect("timing_delay").x * delay)  # e^(+iωt): what comes late lags
        np.testing.assert_allclose(response("timing_delay", strength), exact, atol=1e-9)


def test_a_high_pass_is_half_in_power_at_its_corner_and_leads() -> None:
    for strength, words in enumerate(effect("amplifier_high_pass").strengths):
        ratio = 1j * effect("amplifier_high_pass").x / number(words)
        np.testing.assert_allclose(response("amplifier_high_pass", strength), ratio / (1 + ratio), atol=1e-9)


def test_the_resonance_falls_with_the_root_of_the_mass() -> None:
    drawn = effect("contact_resonance")
    masses = [number(words) for words in drawn.strengths]
    assert masses == pytest.approx([1, 2, 4])
    resonances = []
    for curve in drawn.panels[1].curves:  # a tip on a spring lags by a quarter of a turn at its own frequency
        at = int(np.argmax(curve < -90))
        resonances.append(float(np.interp(90, -curve[at - 1 : at + 1], drawn.x[at - 1 : at + 1])))
    assert resonances[0] / resonances[1] == pytest.approx(np.sqrt(2), rel=0.01)
    assert resonances[1] / resonances[2] == pytest.approx(np.sqrt(2), rel=0.01)


def test_what_the_scatter_is_one_deviation_of_is_drawn_there() -> None:
    for strength, words in enumerate(effect("sensor_spread").strengths):
        np.testing.assert_allclose(response("sensor_spread", strength), np.exp(number(words)), rtol=1e-9)
    pickup = effect("mains_pickup")
    change = pickup.panels[0].curves[1] - pickup.panels[0].base
    assert pickup.x[int(np.argmax(change))] == 50.0
    assert change[np.abs(pickup.x - 30).argmin()] == pytest.approx(0, abs=1e-6)


@cache
def twins() -> dict[str, dict[str, Twin]]:
    return {name: {twin.name: twin for twin in rivals} for name, rivals in law_twins(table()).items()}


def test_a_moving_edge_and_a_wrong_modulus_are_twins_that_curves_tell_apart() -> None:
    wrong = twins()["moving_contact_edge"]["modulus_error"]  # E acts through the contact's radius, as the edge does
    assert wrong.alike > 0.95
    assert set(wrong.kinds) == {"indentation", "compression"}


def test_laws_on_other_axes_are_no_twins_and_all_are_alike_both_ways() -> None:
    assert twins()["contact_resonance"]["ageing"].alike < 0.2
    assert twins()["timing_delay"]["thickness_error"].alike < 0.2
    for name, rivals in twins().items():
        assert name not in rivals
        for other, twin in rivals.items():
            assert 0 <= twin.alike <= 1 + 1e-9
            assert twins()[other][name].alike == pytest.approx(twin.alike)
