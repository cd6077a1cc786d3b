"""Bad input is named, and unit slips are guessed."""

import math
from typing import Any

import numpy as np
import pytest

from underskin import Indenter, InvalidInput, Skin
from underskin.units import LAB, checked, readable_unit, to_lab, to_si, unusual

GOOD: dict[str, Any] = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5}


def test_lab_units_become_si_and_back() -> None:
    skin = Skin.from_lab(**GOOD)
    assert [float(x) for x in (skin.thickness, skin.youngs_modulus, skin.sensor_radius)] == [2.5e-3, 16e6, 1.5e-3]
    assert skin.rt_over_h == pytest.approx(0.6)
    for name in LAB:
        assert to_lab(name, to_si(name, 3.0)) == pytest.approx(3.0)


@pytest.mark.parametrize("field", sorted(GOOD))
@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 0.0])
def test_impossible_values_are_refused_by_name(field: str, value: float) -> None:
    with pytest.raises(InvalidInput) as refusal:
        Skin.from_lab(**{**GOOD, field: [2.5, value]})
    assert refusal.value.field == field
    assert refusal.value.index == 1
    assert "greater than 0" in refusal.value.allowed


@pytest.mark.parametrize(
    ("field", "value", "guess"),
    [
        ("thickness_mm", 2500.0, "2.5 mm: was it given in µm"),
        ("thickness_mm", 0.0025, "2.5 mm: was it given in m"),
        ("youngs_modulus_mpa", 16e6, "16 MPa: was it given in Pa"),
        ("youngs_modulus_mpa", 1e7, "10 MPa: was it given in Pa"),
        ("youngs_modulus_mpa", 2e4, "20 MPa: was it given in kPa\\?"),
        ("youngs_modulus_mpa", 1e5, "was it given in kPa or Pa"),
        ("thickness_mm", 5e6, "5 mm: was it given in nm"),
        ("youngs_modulus_mpa", 16e-6, "0.016 MPa: was it given in GPa"),
        ("sensor_radius_mm", 1500.0, "1.5 mm: was it given in µm"),
    ],
)
def test_unlikely_magnitudes_are_refused_with_a_guess(field: str, value: float, guess: str) -> None:
    with pytest.raises(InvalidInput, match=guess) as refusal:
        Skin.from_lab(**{**GOOD, field: value})
    assert refusal.value.index is None
    assert Skin.from_lab(**{**GOOD, field: value}, units_checked=True).thickness > 0


def test_the_override_does_not_open_the_door_to_impossible_values() -> None:
    with pytest.raises(InvalidInput):
        Indenter.from_lab(indenter_radius_mm=-4.0, units_checked=True)


def test_d33_has_a_sign_but_is_never_zero() -> None:
    assert checked("d33_pc_per_n", -20.0) == -20e-12
    with pytest.raises(InvalidInput, match="not zero"):
        checked("d33_pc_per_n", 0.0)
    with pytest.raises(InvalidInput, match="14 pC/N: was it given in C/N"):
        checked("d33_pc_per_n", 14e-12)


def test_poisson_ratio_is_bounded() -> None:
    for value in (-0.1, 0.51, math.nan):
        with pytest.raises(InvalidInput, match="poisson_ratio"):
            Skin.from_lab(**GOOD, poisson_ratio=value)
    assert Skin.from_lab(**GOOD, poisson_ratio=np.array([0.3, 0.5])).poisson_ratio.shape == (2,)


def test_measured_magnitudes_are_findings_not_errors() -> None:
    assert unusual("frf_pc_per_n", [7.4, -7.4]) == []
    found = unusual("frf_pc_per_n", [7.4, 7.4e-12, 7e-12])
    assert [(finding.field, finding.index) for finding in found] == [("frf_pc_per_n", 1)]
    assert "7.4 pC/N: was it given in C/N? (1 more rows like it)" in found[0].statement
    assert "dead sensor" in unusual("frf_pc_per_n", 0.0)[0].statement


@pytest.mark.parametrize(
    ("name", "largest", "unit", "count"),
    [
        ("displacement_mm", 12.0, "mm", 1.0),
        ("displacement_mm", 7e-4, "µm", 1e3),
        ("force_n", 0.3, "N", 1.0),
        ("force_n", 2e-5, "µN", 1e6),
        ("force_n", 5e-8, "nN", 1e9),
        ("force_n", 1e-20, "pN", 1e12),
        ("force_n", 0.0, "N", 1.0),
    ],
)
def test_small_numbers_are_read_in_a_finer_unit(name: str, largest: float, unit: str, count: float) -> None:
    chosen, factor = readable_unit(name, largest)
    assert chosen == unit
    assert factor == pytest.approx(count)
