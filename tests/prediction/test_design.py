"""A design: its response is the exact layer's, its lengths mean what they say, and the service answers the same."""

from typing import Any

import httpx
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import underskin
from underskin import Indenter, Skin, load_table
from underskin.prediction.skin_design import Design, design, resolution

PROTOTYPE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "pitch_mm": 4.0,
}


def of(scale: float = 1.0, pitch_mm: float = 4.0, **changed: float) -> Design:
    """The prototype, all lengths times `scale`, at the same strain."""
    given = PROTOTYPE | changed
    skin = Skin.from_lab(
        thickness_mm=scale * given["thickness_mm"],
        youngs_modulus_mpa=given["youngs_modulus_mpa"],
        sensor_radius_mm=scale * given["sensor_radius_mm"],
    )
    indenter = Indenter.from_lab(indenter_radius_mm=scale * given["indenter_radius_mm"])
    return design(load_table(), skin, indenter, scale**2 * given["preload_n"], 1e-3 * scale * pitch_mm, 0.1)


def test_above_the_sensor_the_response_is_sigma() -> None:
    found = of()
    assert found.response[0] == pytest.approx(float(found.contact.sigma), rel=1e-5)
    for sweep in found.sweeps:
        own = float(getattr(found.contact, sweep.axis))
        assert np.interp(own, sweep.values, sweep.sigma) == pytest.approx(float(found.contact.sigma), rel=5e-3)


def test_a_point_load_beside_the_sensor_is_the_exact_layers() -> None:
    found = of()
    exact = {0.0: 0.988193, 0.5: 0.669810, 1.0: 0.193228, 2.0: 0.002007}  # γ_n of the bonded layer at ρ = 0.6
    offsets = found.offset / 2.5e-3
    np.testing.assert_allclose(np.interp(list(exact), offsets, found.point_response), list(exact.values()), atol=2e-4)


def test_lengths_scale_with_the_skin() -> None:
    small, large = of().resolution, of(scale=2.0).resolution
    assert (large.between, large.amid) == pytest.approx((small.between, small.amid), rel=1e-6)
    assert large.width == pytest.approx(2 * small.width, rel=1e-6)
    assert large.separation == pytest.approx(2 * small.separation, rel=1e-6)


SPREAD = 1e-3
OFFSET = np.linspace(0, 12 * SPREAD, 600)
BELL = np.exp(-((OFFSET / SPREAD) ** 2) / 2)


def test_two_bells_under_a_fine_array_are_told_apart_where_their_sum_dips() -> None:
    def dip(distance: float) -> float:
        def total(x: float) -> float:
            return float(
                np.exp(-(((x - distance / 2) / SPREAD) ** 2) / 2) + np.exp(-(((x + distance / 2) / SPREAD) ** 2) / 2)
            )

        peak = -minimize_scalar(lambda x: -total(x), bounds=(0, distance), method="bounded").fun
        return float(peak - total(0.0))

    exact = brentq(lambda distance: dip(distance) - 0.1, 2 * SPREAD, 4 * SPREAD)
    found = resolution(OFFSET, BELL, 1e-5, 0.0, 0.1)
    assert found.width == pytest.approx(2 * np.sqrt(2 * np.log(2)) * SPREAD, rel=1e-3)
    assert found.separation == pytest.approx(exact, rel=0.03)
    assert found.best_separation == pytest.approx(exact, rel=0.03)


def test_an_array_too_coarse_to_see_every_load_tells_no_two_apart_everywhere() -> None:
    found = resolution(OFFSET, BELL, 8 * SPREAD, 0.0, 0.1)
    assert np.isnan(found.separation)
    # Two loads to each side of a sensor, as near to it as their own sensors, a pitch away, read the dip's share.
    nearest = 2 * (8 - np.sqrt(2 * np.log(10))) * SPREAD
    assert found.best_separation == pytest.approx(nearest, abs=0.3 * SPREAD)
    assert found.between == pytest.approx(np.exp(-8), rel=1e-2)


@pytest.mark.parametrize("pitch", [1.5, 3.0])
def test_a_finer_array_tells_nearer_loads_apart(pitch: float) -> None:
    coarse, fine = (resolution(OFFSET, BELL, spacing * SPREAD, 0.0, 0.1) for spacing in (pitch, pitch / 2))
    assert fine.separation < coarse.separation
    assert coarse.best_separation <= coarse.separation


def answered(http: httpx.Client, **changed: Any) -> dict[str, Any]:
    answer: dict[str, Any] = http.post("/v1/design", json=PROTOTYPE | changed).json()
    return answer


def test_the_service_answers_in_lab_units(http: httpx.Client, server_url: str) -> None:
    found, answer = of(), answered(http, d33_pc_per_n=14.0, contact="paper")
    assert answer["resolution_mm"] == pytest.approx(1e3 * found.resolution.width)
    assert answer["two_point_separation_mm"] == pytest.approx(1e3 * found.resolution.separation)
    assert answer["response_between_percent"] == pytest.approx(100 * found.resolution.between)
    assert answer["frf_pc_per_n"] == pytest.approx(7.3957, abs=1e-3)
    assert [sweep["axis"] for sweep in answer["sweeps"]] == ["a_over_h", "rt_over_h", "load_parameter"]
    with underskin.Client(server_url) as client:
        assert client.design(**PROTOTYPE, contact="paper")["sigma"] == answer["sigma"]


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"thickness_mm": 0.0025}, "thickness_mm"),
        ({"pitch_mm": 2.9}, "pitch_mm"),
        ({"dip_percent": 0}, "dip_percent"),
        ({"preload_n": -1}, "preload_n"),
        ({"pitch": 4}, "pitch"),
        ({"pitch_mm": None}, "pitch_mm"),
    ],
)
def test_what_cannot_be_is_refused_by_name(http: httpx.Client, changed: dict[str, Any], field: str) -> None:
    answer = http.post("/v1/design", json=PROTOTYPE | changed)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == field
