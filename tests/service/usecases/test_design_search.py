"""The design the other way round: what is offered resolves what is asked, and what keeps all out is the limit named."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from service.schemas.design import DesignDemand, DesignRequest
from service.usecases.design import design_answer, design_of
from service.usecases.design_search import Searched, largest_pitch, search
from service.usecases.materials import ELASTOMERS, FILMS, MATERIALS
from tests.support.cases import first
from underskin import Skin, load_table
from underskin.units import Floats

ASKED: dict[str, Any] = {
    "resolution_mm": 2.0,
    "preload_n": 1.0,
    "indenter_radius_mm": 4.0,
    "youngs_modulus_mpa": 16.0,
    "d33_pc_per_n": 14.0,
    "dip_percent": 10.0,
    "thinnest_mm": 0.2,
    "least_pitch_mm": 0.5,
    "least_frf_pc_per_n": 1.0,
}
SILICONES = Path(__file__).parents[3] / "docs/mechanisms/silicones.json"


@cache
def found(**changed: float) -> Searched:
    return search(load_table(), DesignDemand(**{**ASKED, **changed}))


def least_dip(offset: Floats, response: Floats, pitch: float, distance: float) -> float:
    """By how much a sensor between two others reads less than both, over the reading above a sensor, where the row
    lies worst: written out sensor by sensor."""
    count = int(distance / pitch) + 4
    worst = np.inf
    for placement in np.linspace(0, pitch, 41):
        sensors = pitch * np.arange(-count, count + 1) + placement
        reading = [
            sum(float(np.interp(abs(x - side), offset, response, right=0.0)) for side in (-distance / 2, distance / 2))
            for x in sensors
        ]
        dips = [min(max(reading[:k]), max(reading[k + 1 :])) - reading[k] for k in range(1, len(reading) - 1)]
        worst = min(worst, max(dips))
    return float(worst / response[0])


@pytest.mark.slow
@pytest.mark.parametrize("resolution_mm", first(2, [1.2, 6.0, 2.0]))
def test_every_design_that_is_offered_meets_the_demand_by_the_forward_calculation(resolution_mm: float) -> None:
    answer = found(resolution_mm=resolution_mm)
    assert answer.offers
    assert not answer.binding
    for offer in answer.offers:
        designed = design_of(load_table(), offer.request)
        forward = design_answer(load_table(), offer.request, designed)
        assert forward.two_point_separation_mm is not None
        assert forward.two_point_separation_mm <= resolution_mm
        assert forward.frf_pc_per_n is not None
        assert forward.frf_pc_per_n >= ASKED["least_frf_pc_per_n"]
        assert offer.request.pitch_mm >= max(2 * offer.request.sensor_radius_mm, ASKED["least_pitch_mm"])
        # And sensor by sensor, at the distance that was asked for and at some above.
        for factor in (1.0, 1.13, 1.5):
            distance = factor * resolution_mm * 1e-3
            dip = least_dip(designed.offset, designed.response, offer.request.pitch_mm * 1e-3, distance)
            assert dip >= 0.1 - 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("changed", first(2, [{}, {"preload_n": 0.05}, {"resolution_mm": 5.0}]))
def test_every_pair_that_is_counted_meets_the_demand_at_its_pitch(changed: dict[str, float]) -> None:
    """Also near the edge, where few placements of the row take for resolved what the full calculation does not."""
    answer, region = found(**changed), found(**changed).region
    pairs = list(zip(*np.nonzero(answer.feasible), strict=True))[:: 1 if SOAK else 3]
    asked = {name: value for name, value in {**ASKED, **changed}.items() if name in DesignRequest.model_fields}
    for row, column in pairs:
        request = DesignRequest(
            thickness_mm=float(region.thickness_mm[column]),
            sensor_radius_mm=float(region.sensor_radius_mm[row]),
            pitch_mm=float(region.largest_pitch_mm[row, column]),
            **asked,
        )
        apart = design_answer(load_table(), request, design_of(load_table(), request)).two_point_separation_mm
        assert apart is not None
        assert apart <= {**ASKED, **changed}["resolution_mm"]


@pytest.mark.slow
def test_more_is_met_where_less_is_asked() -> None:
    strict, plain = found(thinnest_mm=0.6, least_pitch_mm=0.9, least_frf_pc_per_n=2.0), found()
    assert strict.feasible.sum() < plain.feasible.sum()
    assert not (strict.feasible & ~plain.feasible).any()
    pitches = [found(resolution_mm=asked).offers[0].request.pitch_mm for asked in (1.5, 2.0, 3.0)]
    assert pitches == sorted(pitches)
    assert len(set(pitches)) == len(pitches)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("field", "asked", "words"),
    [
        ("thinnest_mm", 3.0, "is thicker than"),
        ("least_pitch_mm", 2.0, "has a pitch above"),
        ("least_frf_pc_per_n", 12.0, "gives more than"),
    ],
)
def test_limit_keeps_out_named_number(field: str, asked: float, words: str) -> None:
    """The limit that keeps all out is named with the number that would do."""
    answer = found(**{field: asked})
    assert not answer.offers
    assert len(answer.binding) == 1
    told = re.search(rf"{words} ([0-9.]+) ", answer.binding[0])
    assert told is not None
    assert found(**{field: 0.97 * float(told[1])}).feasible.any()
    assert not found(**{field: 1.03 * float(told[1])}).feasible.any()


def test_two_contacts_that_touch_are_the_limit_of_every_skin() -> None:
    touching = 2 * float(found().region.contact_radius_mm.min())
    assert touching < 2e3 * (3 * 1.0 * 4e-3 * 0.75 / (4 * 16e6)) ** (1 / 3)  # Hertz, ν = 1/2: a thin layer is stiffer
    answer = found(resolution_mm=0.99 * touching)
    assert answer.binding[0].startswith("The contacts themselves")
    assert f"{touching:.3g} mm" in answer.binding[0]
    assert not answer.feasible.any()


def test_a_force_beyond_the_table_is_told_with_the_highest_one() -> None:
    answer = found(preload_n=100.0, resolution_mm=10.0)
    assert answer.binding[0].startswith("The table of σ")
    highest = float(answer.binding[0].split("at most ")[1].removesuffix(" N"))
    assert np.isfinite(found(preload_n=0.999 * highest, resolution_mm=10.0).region.frf_pc_per_n).any()
    assert not np.isfinite(found(preload_n=1.01 * highest, resolution_mm=10.0).region.frf_pc_per_n).any()


def test_the_largest_pitch_of_a_bell_is_where_sensor_by_sensor_the_dip_is_just_seen() -> None:
    spread, distance = 0.4e-3, 2.4e-3
    offset = np.linspace(0, 12 * spread, 600)
    bell = np.exp(-((offset / spread) ** 2) / 2)
    pitch = largest_pitch(offset, bell, distance, 0.1e-3, 0.1)

    def seen(at: float) -> bool:
        return all(least_dip(offset, bell, at, d) >= 0.1 for d in np.linspace(distance, 2 * distance, 7))

    assert seen(0.97 * pitch)
    assert not seen(1.05 * pitch)
    assert np.isnan(largest_pitch(offset, bell, 2 * spread, 0.1e-3, 0.1))  # the sum of two bells has one top there


def test_materials_are_what_their_sources_say() -> None:
    assert len(MATERIALS) == len(ELASTOMERS) + len(FILMS)
    for material in ELASTOMERS:
        Skin.from_lab(thickness_mm=2.5, youngs_modulus_mpa=material.value, sensor_radius_mm=1.5)  # of likely magnitude
        assert material.source
    ratio = re.compile(r"Sylgard 184, (\d+) : 1")
    for material in ELASTOMERS:
        mixed = ratio.fullmatch(material.name)
        if mixed is not None:  # 20 MPa over the ratio within what that fit to the measured ones leaves
            assert material.value == pytest.approx(20 / int(mixed[1]), rel=0.1)
    fits = json.loads(SILICONES.read_text(encoding="utf-8"))
    names = {"Ecoflex 00-10": "EF10", "Ecoflex 00-30": "EF30", "Ecoflex 00-50": "EF50", "RTV615": "RTV615",
             "Dragon Skin 20": "Dragon_Skin_20"}  # fmt: skip
    for name, sample in names.items():
        moduli = [
            row["Yeoh"]["modulus_kpa"]
            for row in fits
            if row["sample"].startswith(sample) and row["largest_strain"] <= 0.4
        ]
        preset = next(material.value for material in ELASTOMERS if material.name == name)
        assert 1e3 * preset == pytest.approx(float(np.mean(moduli)), rel=0.01)
