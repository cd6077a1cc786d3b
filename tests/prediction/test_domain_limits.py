"""Which limit a row exceeds, with the force that it may have: at that force it is inside, a little above it is not."""

import re

import numpy as np
import pytest

from underskin import load_table
from underskin.prediction import answers

SKIN = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "poisson_ratio": 0.5}
TABLE = load_table()


def limits(**fields: float | list[float]) -> list[str | None]:
    given = {**SKIN, "indenter_radius_mm": 4.0, "preload_n": 1.0, "d33_pc_per_n": 14.0, **fields}
    answer = answers.frf(TABLE, {name: np.asarray(values, float) for name, values in given.items()}, True)
    return [None] if answer.limits is None else list(answer.limits)


def test_the_load_that_is_too_high_is_named_row_by_row() -> None:
    assert limits(preload_n=[1.0, 300.0, 25.6]) == [None, "L = 1.17 exceeds 0.1: at most 25.6 N", None]
    assert limits(preload_n=[1.0, 25.6]) == [None]


@pytest.mark.parametrize(
    ("fields", "exceeds"),
    [
        ({"preload_n": 300.0}, ["L"]),
        ({"preload_n": 260.0, "thickness_mm": 0.4, "indenter_radius_mm": 40.0, "sensor_radius_mm": 0.3}, ["a/h"]),
        ({"preload_n": 3e4, "thickness_mm": 0.4, "indenter_radius_mm": 40.0, "sensor_radius_mm": 0.3}, ["L", "a/h"]),
    ],
)
def test_the_stated_force_is_the_highest(fields: dict[str, float], exceeds: list[str]) -> None:
    (words,) = limits(**fields)
    assert words is not None
    assert re.findall(r"(\S+) = \S+ exceeds", words) == exceeds
    most = float(words.partition("at most ")[2].removesuffix(" N"))
    assert limits(**{**fields, "preload_n": most}) == [None]
    assert limits(**{**fields, "preload_n": 1.01 * most}) != [None]


def test_what_no_force_helps_is_named_alone() -> None:
    assert limits(sensor_radius_mm=10.0) == ["rT/h = 4 exceeds 3"]
    (both,) = limits(preload_n=260.0, thickness_mm=0.4, indenter_radius_mm=40.0, sensor_radius_mm=2.0)
    assert both is not None
    assert re.fullmatch(r"a/h = \S+ exceeds 3, rT/h = 5 exceeds 3", both)
    assert limits(poisson_ratio=0.3) == ["Poisson's ratio = 0.3: the table is of incompressible elastomer, 0.5"]


def test_a_result_beyond_the_floats_is_named_as_that() -> None:
    given = {**SKIN, "indenter_radius_mm": 4.0, "preload_n": 1.0, "frf_pc_per_n": 1.7e308}
    with np.errstate(over="ignore"):
        answer = answers.d33(TABLE, {name: np.asarray(value) for name, value in given.items()}, True)
    assert answer.limits == ["the result is too large a number"]


def test_a_number_is_written_with_the_digits_that_tell_it_from_its_limit() -> None:
    points = {name: np.asarray(value) for name, value in (("rt_over_h", 0.6), ("load_parameter", 0.0))}
    told = {
        value: answers.sigma(TABLE, {**points, "a_over_h": np.asarray(value)}, "layer").limits
        for value in (3.0, 3.0001)
    }
    assert told == {3.0: None, 3.0001: ["a/h = 3.0001 exceeds 3"]}
    far = answers.sigma(TABLE, {**points, "a_over_h": np.asarray(12.0)}, "half_space").limits
    assert far == ["a/h = 12 exceeds 10"]
