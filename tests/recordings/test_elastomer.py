"""The elastomer's modulus: the paper's reading from its curve, Hertz with a free contact point, and real recordings."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from tests.support.blocks import sample
from tests.support.cases import first
from underskin.errors import InvalidInput
from underskin.inversion.elastomer import of_campaign
from underskin.recordings.block_modulus import CompressionModulus, compression_modulus
from underskin.recordings.modulus import indentation_modulus
from underskin.units import Floats

HEIGHT, DIAMETER = 10e-3, 10e-3
RADIUS = 4e-3
NEEDS_RECORDINGS = pytest.mark.skipif(
    "UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS does not name the folder of real recordings"
)


def paper_curve(strain: Floats, toe: float = 0.0) -> Floats:
    """16 MPa up to 2 MPa and stiffer from there, behind a toe in which the platens come to bear."""
    seated = np.where(strain < 2 * toe, strain**2 / (4 * toe) if toe else 0.0, strain - toe)
    beyond = np.maximum(seated - 2 / 16, 0)
    return 16e6 * seated + 14e6 * beyond + 80e6 * beyond**2


@pytest.mark.parametrize("toe", [0.0, 0.01])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_papers_reading(toe: float, sign: int) -> None:
    strain = np.linspace(0, 0.3, 600)
    stress = paper_curve(strain, toe) + np.random.default_rng(0).normal(0, 5e3, 600)
    area = np.pi / 4 * DIAMETER**2
    found = compression_modulus(sign * strain * HEIGHT, sign * stress * area, HEIGHT, DIAMETER)
    assert found.modulus == pytest.approx(16e6, rel=0.01)
    assert found.leaves_at_stress == pytest.approx(2e6, rel=0.1)
    assert found.leaves_at_strain == pytest.approx(2 / 16, rel=0.1)


@pytest.mark.slow
def test_a_straight_curve_stays_straight_and_its_uncertainty_is_the_scatter_seen() -> None:
    random = np.random.default_rng(1)
    displacement = np.linspace(0, 1e-3, 300)
    force = 16e6 * displacement / HEIGHT * np.pi / 4 * DIAMETER**2
    found = [compression_modulus(displacement, force + random.normal(0, 0.5, 300), HEIGHT, DIAMETER) for _ in range(60)]
    assert all(one.leaves_at_strain is None for one in found)
    errors = np.array([one.modulus for one in found]) - 16e6
    stated = np.sqrt(np.mean([one.uncertainty**2 for one in found]))
    assert abs(errors.mean()) < 3 * stated / np.sqrt(60)
    assert 0.4 < errors.std() / stated < 1.1  # noise alone, and noise seen once more as a change of slope


@pytest.mark.slow
def test_unloading_is_not_read() -> None:
    strain = np.concatenate([np.linspace(0, 0.3, 300), np.linspace(0.3, 0, 300)])
    stress = paper_curve(strain) * np.where(np.arange(600) < 300, 1, 0.6)
    found = compression_modulus(strain * HEIGHT, stress, HEIGHT, DIAMETER)
    once = compression_modulus(strain[:300] * HEIGHT, stress[:300], HEIGHT, DIAMETER)
    assert found.modulus == pytest.approx(once.modulus, rel=1e-3)


def hertz(depth: Floats, modulus: float = 16e6, contact: float = 0.1e-3, offset: float = -0.05) -> Floats:
    return offset + 4 / 3 * modulus / 0.75 * np.sqrt(RADIUS) * np.maximum(depth - contact, 0) ** 1.5


@pytest.mark.slow
def test_indentation_finds_contact_and_modulus_and_its_interval_covers() -> None:
    random = np.random.default_rng(2)
    depth = np.linspace(0, 0.4e-3, 200)
    hits = 0
    for _ in range(200):
        found = indentation_modulus(depth, hertz(depth) + random.normal(0, 0.05, 200), RADIUS, 0.5)
        hits += abs(found.modulus - 16e6) < 1.96 * found.uncertainty
    assert 0.9 <= hits / 200 <= 0.985
    exact = indentation_modulus(depth, hertz(depth), RADIUS, 0.5)
    assert exact.modulus == pytest.approx(16e6, rel=1e-4)
    assert exact.contact_point == pytest.approx(0.1e-3, abs=1e-7)


def test_a_recording_that_starts_in_contact_has_its_contact_point_before_it() -> None:
    depth = np.linspace(0.15e-3, 0.5e-3, 200)
    found = indentation_modulus(depth, hertz(depth, offset=0.0), RADIUS, 0.5)
    assert found.contact_point == pytest.approx(0.1e-3, abs=1e-6)
    assert found.modulus == pytest.approx(16e6, rel=1e-3)


def test_a_modulus_that_one_sample_in_contact_leaves_open_is_refused() -> None:
    depth = np.linspace(0, 0.4e-3, 20)
    force = np.where(np.arange(20) == 19, 1.0, 0.0)
    with pytest.raises(InvalidInput, match="displacement_mm"):
        indentation_modulus(depth, force, RADIUS, 0.5)


@pytest.mark.slow
@NEEDS_RECORDINGS
@pytest.mark.parametrize(("product", "modulus_kpa"), [("EF10_0T", 62.5), ("EF30_0T", 101.0), ("EF50_0T", 160.0)])
def test_silicones_under_compression(product: str, modulus_kpa: float) -> None:
    """Their slope between 2 and 10 % strain, as the folder's description gives it (62.5, 114, 181 kPa); of the two
    that follow the neo-Hookean law there, over its mean slope, 1.13."""
    files = sorted((Path(os.environ["UNDERSKIN_RECORDINGS"]) / "silicone-compression" / product).glob("*.csv"))
    found = []
    for file in first(4, files):
        table = np.loadtxt(file, delimiter=",", skiprows=8)
        found.append(compression_modulus(table[:, 1] * 1e-3, table[:, 2], 30e-3, 50e-3))
    assert len(files) == 10
    assert np.median([one.modulus for one in found]) == pytest.approx(1e3 * modulus_kpa, rel=0.1)
    assert all(one.leaves_at_strain is not None and one.last_strain < 0.3 for one in found)


@NEEDS_RECORDINGS
@pytest.mark.parametrize(("well", "modulus_mpa"), [("E5", 9.16), ("E6", 8.32), ("E7", 8.28)])
def test_a_steel_sphere_in_a_well(well: str, modulus_mpa: float) -> None:
    """Hertz' modulus as the folder's description gives it; force is negative in compression there."""
    folder = Path(os.environ["UNDERSKIN_RECORDINGS"]) / "sphere-in-well" / "run_732_20251030"
    with next(folder.glob(f"well_{well}_*.csv")).open(newline="") as file:
        rows = [row for row in csv.reader(file) if len(row) == 4]
    values = np.array([[float(cell) for cell in row] for row in rows[1:]])
    found = indentation_modulus(-values[:, 1] * 1e-3, -values[:, 3], 2.5e-3, 0.5)
    assert found.modulus == pytest.approx(1e6 * modulus_mpa, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("pulled", "largest"), [(True, (0.3, 1.5)), (False, (0.08, 0.35))])
def test_interval_of_neo_hookean_samples(pulled: bool, largest: tuple[float, float]) -> None:
    """The 95 % interval of E holds that of strips and blocks with an unknown zero, slack and 0.1 to 2 % noise."""
    random = np.random.default_rng(2)
    inside = []
    for number in range(40):
        strain = np.linspace(0, random.uniform(*largest), random.integers(30, 300))
        slack = random.uniform(0, 0.1) * strain[-1] * (number % 2)
        stretch = 1 + (1 if pulled else -1) * np.maximum(strain - slack, 0)
        stress = 1e6 / 3 * (stretch - stretch**-2)
        top = float(np.abs(stress).max())
        zero, noise = top * random.uniform(-0.03, 0.03) * (number % 4 > 1), top * np.exp(random.uniform(-6.9, -3.9))
        force = np.pi / 4 * DIAMETER**2 * (stress + zero + noise * random.standard_normal(len(stress)))
        displacement = (-1 if pulled else 1) * strain * HEIGHT
        found = compression_modulus(displacement, -force, HEIGHT, DIAMETER)
        inside.append(abs(found.modulus - 1e6) < 1.96 * found.uncertainty)
        assert found.uncertainty < 0.06e6
    assert sum(inside) >= 35  # fewer with probability 0.014


@pytest.mark.parametrize(
    ("stretches", "constants", "changes"),
    [
        ((1.0, 0.6), np.array([1 / 6, 0.0, 0.15, 0.0]), True),  # Yeoh, twice as stiff in the end
        ((1.0, 0.65), np.array([1 / 9, 1 / 18, 0.0, 0.0]), True),  # Mooney and Rivlin
        ((1.0, 2.5), np.array([1 / 6, 0.0, -0.01, 0.001]), True),  # softens first, and stiffens then
        ((1.0, 0.7), np.array([1 / 6, 0.0, 0.0, 0.0]), False),
    ],
)
def test_a_modulus_that_changes_with_strain(stretches: tuple[float, float], constants: Floats, changes: bool) -> None:
    """E is that at no strain where a block or strip is no neo-Hookean solid, within its ±, with 0.4 % noise."""
    stretch = np.linspace(*stretches, 150)
    invariant = stretch**2 + 2 / stretch - 3
    series = constants @ np.array([np.ones(150), 1 / stretch, invariant, invariant**2])
    found = of_sample(1 - stretch, -2 * (stretch - stretch**-2) * series, seed=4)
    assert found.is_series == changes
    assert found.modulus == pytest.approx(1e6, rel=0.06)
    assert abs(found.modulus - 1e6) < 2 * found.uncertainty


@pytest.mark.slow
@pytest.mark.parametrize("toe", [0.02, 0.05, 0.1])
@pytest.mark.parametrize("is_straight", [False, True])
def test_an_uneven_end_is_no_change_of_the_modulus(toe: float, is_straight: bool) -> None:
    """E is that of the block where its end comes to bear over 2 to 10 % of strain, as a modulus that grows would."""
    strain = np.linspace(0, 0.35, 300)
    seated = np.maximum(strain - np.linspace(0, toe, 200)[:, None], 0.0)
    stress = (seated if is_straight else ((1 - seated) ** -2 - (1 - seated)) / 3).mean(axis=0)
    found = of_sample(strain, stress, seed=round(100 * toe))
    assert not found.is_series
    assert found.modulus == pytest.approx(1e6, rel=0.06)


@pytest.mark.slow
@pytest.mark.parametrize(
    "stress", [np.linspace(0, 0.35, 300) ** 3, -np.expm1(np.linspace(0, 2, 300)) / 6], ids=["cube", "tension"]
)
def test_no_modulus_at_no_strain(stress: Floats) -> None:
    """A curve of which the series cannot tell E from 0 keeps the modulus of its first part."""
    found = of_sample(np.sign(stress[-1]) * np.linspace(0, 0.35 if stress[-1] > 0 else 2.0, 300), stress, seed=1)
    assert not found.is_series
    assert found.modulus > 0


def of_sample(strain: Floats, stress_mpa: Floats, seed: int) -> CompressionModulus:
    """The modulus of a block or strip of 10 mm, compression positive, with noise of 0.4 % of the force."""
    force = np.pi / 4 * 10.0**2 * stress_mpa
    force = force + 4e-3 * np.abs(force).max() * np.random.default_rng(seed).standard_normal(len(force))
    (found,) = of_campaign(sample(10.0 * strain, force))
    assert isinstance(found.result, CompressionModulus)
    return found.result


def test_a_block_that_is_only_pressed_is_in_no_tension() -> None:
    """Its machine gives by 1 mm at 200 N, and it stiffens: a line fits best, and meets the force 0 before the foot."""
    strain = np.linspace(0.0, 0.35, 120)
    stretch = 1 - strain
    invariant = stretch**2 + 2 / stretch - 3
    stress = (stretch**-2 - stretch) / 3 * (1 + 0.6 * invariant + 0.06 * invariant**2)
    force = 1e6 * np.pi / 4 * 0.02**2 * stress
    found = compression_modulus(0.01 * strain + force / 2e5, force, 0.01, 0.02)
    assert found.is_straight
    assert found.load == "compression"
    assert "pulled" not in found.statement
