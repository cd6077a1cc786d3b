"""The flat zone of campaigns with known resonances, roll-offs and mains, and averages over it."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from underskin.errors import InvalidInput
from underskin.recordings.campaign import FrfRecording, parse
from underskin.recordings.frf import thinned_lines
from underskin.recordings.frf.estimation import common_delay, estimate, lines_of, without_delay
from underskin.recordings.frf.flat_zone import (
    Condition,
    FlatZone,
    band_average,
    flat_zone,
    lower_half,
    mains_lines,
    roll_off,
    without_chain_phase,
)
from underskin.recordings.frf.line_choice import usable_lines
from underskin.recordings.frf.spectra import Frf, stacked
from underskin.units import Complexes, Floats

LOG_GRID = np.geomspace(1, 1000, 60)
LINEAR_GRID = np.arange(1.0, 401.0)
NEEDS_CAMPAIGNS = pytest.mark.skipif(
    "UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS does not name the folder of campaigns"
)
PRELOADS = (0.5, 1.0, 2.0, 3.0)
INDENTERS = (4.0, 10.0)


def resonance(frequency: Floats, radius: float, preload: float, mass_g: float = 1.0) -> Complexes:
    """A tip on a contact spring that stiffens with radius and preload; lowest at 4 mm and 0.5 N."""
    natural = 400 * np.cbrt(radius / 4 * preload / 0.5) ** 0.5 / np.sqrt(mass_g)
    x = frequency / natural
    return 1 / (1 - x**2 + 0.05j * x)


def recorded(
    frequency: Floats, shape: str, seed: int = 0, line: float = 0.01, copies: int = 3
) -> tuple[list[Frf], list[Condition]]:
    random = np.random.default_rng(seed)
    frfs, conditions = [], []
    for radius in INDENTERS:
        for preload in PRELOADS:
            for _ in range(copies):
                clean = np.ones_like(frequency, dtype=complex)
                if "resonance" in shape:
                    clean = clean * resonance(frequency, radius, preload)
                if "high-pass" in shape:
                    clean = clean * (1j * frequency / 2) / (1 + 1j * frequency / 2)
                if "rise" in shape:
                    clean = clean * (1 + (frequency / 80) ** 2)
                if "relaxation" in shape:
                    clean = clean * (1j * frequency / 30) ** -0.03
                noise = (
                    line
                    * np.abs(clean)
                    * (random.normal(size=len(frequency)) + 1j * random.normal(size=len(frequency)))
                )
                clean = clean + noise
                if "mains" in shape:
                    for harmonic in (50, 100, 150):
                        near = np.abs(frequency - harmonic) < 1.5
                        clean = clean + near * 0.4 * np.exp(2j * np.pi * random.random())
                frfs.append(Frf(frequency, 7e-12 * np.exp(0.03 * random.normal()) * clean.astype(np.complex128)))
                conditions.append((radius, preload))
    return frfs, conditions


def zone_of(shape: str, frequency: Floats = LOG_GRID, **options: Any) -> FlatZone:
    frfs, conditions = recorded(frequency, shape, **options)
    return flat_zone(stacked(frfs), conditions)


def test_a_flat_campaign_is_flat_throughout() -> None:
    zone = zone_of("")
    assert (zone.low_hz, zone.high_hz) == (LOG_GRID[0], LOG_GRID[-1])
    assert "whole recorded range" in zone.reason


@pytest.mark.parametrize(("excited_hz", "told"), [((20.0, 1e4), "below"), ((0.0, 9.0), "above")])
def test_what_was_not_excited_is_no_flat_zone_however_wide(excited_hz: tuple[float, float], told: str) -> None:
    """Uncorrelated noise over noise is as flat as a response where it is averaged long, and lies elsewhere."""
    frequency = np.geomspace(0.2, 300.0, 400)
    follows = (frequency >= excited_hz[0]) & (frequency <= excited_hz[1])
    frfs, conditions = recorded(frequency, "")
    noise = 1e-3 * np.random.default_rng(9).normal(size=len(frequency))
    idle = [
        Frf(frequency, np.where(follows, one.values, 0.3e-12 * (1 + noise)), np.where(follows, 0.99, 0.1))
        for one in frfs
    ]
    idle = [one.frf for one in usable_lines(idle)]
    zone = flat_zone(stacked(idle), conditions)
    assert zone.low_hz == pytest.approx(frequency[follows][0], rel=0.2)
    assert zone.high_hz == pytest.approx(frequency[follows][-1], rel=0.2)
    mean, _, _ = band_average(stacked(idle), zone)
    assert mean == pytest.approx(7e-12, rel=0.15)
    assert f"{told} " in zone.reason
    assert "it was not excited" in zone.reason
    assert "whole recorded range" not in zone.reason


def test_a_force_of_a_few_sines_leaves_out_the_lines_between_them() -> None:
    """One line in twenty is excited; between them the charge is noise, which nothing makes follow the force."""
    frequency = np.arange(1.0, 301.0)
    sines = frequency % 20 == 0
    frfs, conditions = recorded(frequency, "")
    noise = np.random.default_rng(4).normal(size=(len(frfs), len(frequency), 2)) @ [3e-12, 3e-12j]
    coherence = np.random.default_rng(5).uniform(0.0, 0.6, size=(len(frfs), len(frequency)))
    idle = [
        Frf(frequency, np.where(sines, one.values, apart), np.where(sines, 0.99, low))
        for one, apart, low in zip(frfs, noise, coherence, strict=True)
    ]
    idle = [one.frf for one in usable_lines(idle)]
    zone = flat_zone(stacked(idle), conditions)
    assert (zone.low_hz, zone.high_hz) == (20.0, 300.0)
    assert zone.holds(frequency).sum() == 15
    assert "266 lines inside it were not excited" in zone.reason
    assert "below 20 Hz it was not excited" in zone.reason
    mean, _, _ = band_average(stacked(idle), zone)
    assert mean == pytest.approx([one.values.real[sines].mean() for one in frfs], rel=0.01)


def test_sine_mains_beside_idle_lines_no_pick() -> None:
    """A sine at the mains beside idle lines is no pick up and low sines are in the zone.

    A multisine whose lowest lines share their bins with idle ones.
    """
    frequency = np.arange(1.0, 500.0)
    sines = np.isin(frequency, [5, 8, 12, 20, 31, 48, 75, 110])
    generator = np.random.default_rng(7)
    frfs = []
    for _ in range(4):
        noise = generator.normal(size=(len(frequency), 2)) @ [1e-12, 1e-12j]
        coherence = np.where(sines, 1.0, generator.uniform(0.0, 0.2, len(frequency)))
        frfs.append(Frf(frequency, np.where(sines, 7.4e-12, noise), coherence))
    frfs = [one.frf for one in usable_lines(frfs)]
    zone = flat_zone(stacked(frfs), [(4.0, 1.0), (4.0, 2.0)] * 2)
    assert (zone.low_hz, zone.high_hz, zone.left_out_hz) == (5.0, 110.0, ())
    assert "high-pass" not in zone.reason
    assert zone.holds(frequency).tolist() == sines.tolist()
    assert thinned_lines.lines_of("r", frfs[0]).frequency_hz.tolist() == frequency[sines].tolist()
    (first, _) = thinned_lines.spreads(frfs, [(4.0, 1.0), (4.0, 2.0)] * 2)
    assert first.frequency_hz.tolist() == frequency[sines].tolist()


def test_the_lowest_of_the_resonances_ends_the_zone_and_is_named() -> None:
    zone = zone_of("resonance")
    assert 40 < zone.high_hz < 110  # 1/(1 − (f/400)²) has risen by 1 % to 8 %
    assert zone.low_hz == LOG_GRID[0]
    assert "the sphere of 4 mm radius at 0.5 N" in zone.reason
    assert "moving with the contact" in zone.reason


def test_a_rise_to_the_last_line_is_no_peak() -> None:
    """A response that rises up to the end, as far below a resonance, has no peak."""
    assert "the response rises or scatters by more than 2 %, without a peak in range" in zone_of("rise").reason


def test_a_high_pass_begins_it_and_a_relaxation_does_not_end_it() -> None:
    zone = zone_of("high-pass")
    assert 4 < zone.low_hz < 20  # corner at 2 Hz: Re = 0.8 at 4 Hz, 0.99 at 20 Hz
    assert "high-pass" in zone.reason
    relaxing = zone_of("relaxation", LINEAR_GRID[:130])
    assert (relaxing.low_hz, relaxing.high_hz) == (1, 130)
    assert "fall alike, by 6." in relaxing.reason


def test_mains_lines_are_left_out_and_do_not_end_it() -> None:
    frfs, conditions = recorded(LINEAR_GRID[:200], "mains")
    zone = flat_zone(stacked(frfs), conditions)
    assert (zone.low_hz, zone.high_hz) == (1, 200)
    assert {50.0, 100.0, 150.0} <= set(zone.left_out_hz) <= {x + d for x in (50, 100, 150) for d in (-1.0, 0.0, 1.0)}
    assert "mains" in zone.reason
    mean, uncertainty, _ = band_average(stacked(frfs), zone)
    quiet, _ = recorded(LINEAR_GRID[:200], "")
    level, _, _ = band_average(stacked(quiet), FlatZone(1, 200, ""))
    assert np.median(uncertainty / mean) < 1.5e-3
    assert np.median(mean) == pytest.approx(np.median(level), rel=0.03)


FILTERS: dict[str, Callable[[Floats], Any]] = {
    "high-pass": lambda f: 1j * f / (80 + 1j * f),
    "two high-passes": lambda f: (1j * f / (20 + 1j * f)) ** 2,
    "Butterworth's high-pass": lambda f: -((f / 50) ** 2) / (1 - (f / 50) ** 2 + 1.41421356j * f / 50),
    "low-pass": lambda f: 1 / (1 + 1j * f / 20),
    "Butterworth's low-pass": lambda f: 1 / (1 - (f / 50) ** 2 + 1.41421356j * f / 50),
}


def test_line_at_0_hz_leaves_the_phase_of_the_chain_alone() -> None:
    """Two poles of a high-pass are found, and the polarity seen, also from spectra that begin at 0 Hz."""
    grid = np.concatenate([[0.0], np.geomspace(1, 400, 120)])
    x = 1j * grid / 40
    random = np.random.default_rng(0)
    noise = 0.003 * (random.normal(size=(4, len(grid))) + 1j * random.normal(size=(4, len(grid))))
    frfs = [Frf(grid, row) for row in -30e-12 * x**2 / (x**2 + np.sqrt(2) * x + 1) * (1 + noise)]
    (stack,), delay, _ = without_chain_phase(stacked(frfs), [(3.0, 1.0)] * 4)
    assert delay == 0
    assert np.isfinite(stack.values).all()
    assert np.abs(np.angle(-stack.values[:, 1:])).max() < 0.1


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("grid", [LINEAR_GRID[1:200], np.arange(5.0, 205.0, 5.0), np.geomspace(5, 200, 40)])
def test_filter_bends_no_mains_line_and_loses_what_is_said(name: str, grid: Floats) -> None:
    """Lines that a filter bends are no mains pick-up, one with pick-up among them is, and the stated loss is true."""
    random = np.random.default_rng(5)
    noise = 0.004 * (random.normal(size=(3, len(grid))) + 1j * random.normal(size=(3, len(grid))))
    values = 7e-12 * FILTERS[name](grid) * (1 + noise)
    stacks = without_delay(every := stacked([Frf(grid, row) for row in values]), common_delay(every))
    assert mains_lines(stacks) == ()
    zone = flat_zone(stacks, [(4.0, preload) for preload in PRELOADS[:3]])
    level, _, _ = band_average(stacks, zone)
    behind = roll_off(stacks, zone, level)
    stated = 0.0 if behind is None else behind.share  # losses below 2 % are not stated
    assert stated == pytest.approx(1 - abs(float(np.median(level))) / 7e-12, abs=0.02)
    at = int(np.argmin(np.abs(grid - 50)))
    values[:, at] += 0.1 * np.abs(values[:, at]) * np.exp(2j * np.pi * random.random(3))
    assert mains_lines(stacked([Frf(grid, row) for row in values])) == (round(float(grid[at]), 6),)


def test_the_users_band_overrides() -> None:
    frfs, conditions = recorded(LOG_GRID, "resonance")
    zone = flat_zone(stacked(frfs), conditions, (5.0, 300.0))
    assert (zone.low_hz, zone.high_hz, zone.chosen_by_user) == (5.0, 300.0, True)
    with pytest.raises(InvalidInput, match="band_hz"):
        flat_zone(stacked(frfs), conditions, (2000.0, 3000.0))


@pytest.mark.parametrize("with_coherence", [True, False])
def test_the_uncertainty_of_an_average_is_its_scatter_and_coherence_lowers_it(with_coherence: bool) -> None:
    random = np.random.default_rng(6)
    noise = np.where(np.arange(100) < 50, 0.002, 0.03)
    gamma2 = 1 / (1 + 2 * 16 * noise**2) if with_coherence else None
    frfs = [
        Frf(np.arange(1.0, 101.0), np.asarray(1 + noise * random.normal(size=100), dtype=np.complex128), gamma2)
        for _ in range(800)
    ]
    mean, uncertainty, _ = band_average(stacked(frfs), FlatZone(1, 100, ""))
    assert np.std(mean) == pytest.approx(np.sqrt(np.mean(uncertainty**2)), rel=0.1)
    assert np.std(mean) < (0.8e-3 if with_coherence else 2.5e-3)


@NEEDS_CAMPAIGNS
@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("c2pdsjnae", (1, 1), (130, 130)),  # nothing missing
        ("c79wg2fgy", (1, 1), (1000, 1000)),  # nothing missing
        ("c3x0t9wv3", (1, 1), (120, 300)),  # contact resonances near 900 Hz
        ("ca40ad867", (3, 15), (130, 130)),  # amplifier's high-pass
        ("c4chxhg3d", (1, 1), (130, 130)),  # sensor relaxation
    ],
)
def test_concealed_campaigns(name: str, low: tuple[float, float], high: tuple[float, float]) -> None:
    document = json.loads((Path(os.environ["UNDERSKIN_CAMPAIGNS"]) / "open" / f"{name}.json").read_text())
    recordings = [item for item in parse(document).recordings if isinstance(item, FrfRecording)]
    zone = flat_zone(
        stacked([lines_of(item) for item in recordings]),
        [(item.indenter_radius_mm, item.preload_n) for item in recordings],
    )
    assert low[0] <= zone.low_hz <= low[1]
    assert high[0] <= zone.high_hz <= high[1]


def test_what_a_resonance_above_the_zone_puts_into_the_average_is_told() -> None:
    frfs, conditions = recorded(np.arange(1.0, 401.0), "resonance", line=0.001)
    stacks = stacked(frfs)
    zone = flat_zone(stacks, conditions)
    level, noise, _ = band_average(stacks, zone)
    told = lower_half(stacks, zone, level, noise)
    lower, _, _ = band_average(stacks, FlatZone(zone.low_hz, np.sqrt(zone.low_hz * zone.high_hz), ""))
    change = 100 * float(np.median(lower / level - 1))
    assert change < -0.3
    assert told == f"; averaged over its lower half alone, d33 would be {-change:.1f} % lower"


def test_a_flat_band_has_halves_alike() -> None:
    for seed in range(20 if SOAK else 5):
        frfs, conditions = recorded(LINEAR_GRID, "flat", seed)
        stacks = stacked(frfs)
        zone = flat_zone(stacks, conditions)
        level, noise, _ = band_average(stacks, zone)
        assert lower_half(stacks, zone, level, noise) == ""


def _struck(seed: int) -> Frf:
    """The used lines of eight short blows of 6 to 20 N with 2 N of noise on the force, and no mains anywhere."""
    random, rate = np.random.default_rng(seed), 2000.0
    time = np.arange(16_000) / rate
    after = time[:, None] - (0.3 + 0.925 * np.arange(8) + random.uniform(-0.05, 0.05, 8))
    pulses = ((after > 0) & (after < 3e-3)) * np.sin(np.pi * after / 3e-3)
    force = np.asarray(pulses @ random.uniform(6.0, 20.0, 8), dtype=np.float64)
    charge = 7.4e-12 * (force + random.normal(0.0, 0.2, len(time)))
    (lines,) = usable_lines([estimate(force + random.normal(0.0, 2.0, len(time)), charge, rate)])
    return lines.frf.at(np.flatnonzero(lines.frf.used_or_all))


@pytest.mark.slow
def test_noise_of_blows_is_not_called_mains() -> None:
    """Lines that depart no further than others of the same FRFs are not left out as pick-up."""
    named = [bool(mains_lines(stacked([_struck(3 * seed + part) for part in range(3)]))) for seed in range(20)]
    assert sum(named) <= 3
