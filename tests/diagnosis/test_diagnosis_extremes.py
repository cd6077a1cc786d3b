"""A campaign that can be read can be diagnosed, whatever its numbers: a report, or an error that names a field."""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bench.soak import SOAK
from tests.support.lean_reports import beside, lean_report
from tests.support.slip_campaigns import looked_at
from underskin import InvalidInput
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import SigmaTable

FEW = beside("thickness_error", "layered_contact", "ageing", "strain_stiffening", "amplifier_high_pass")
EDGE = settings(
    max_examples=150 if SOAK else 50,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
WILD = (1e-300, 1e-9, 1e-3, 1e3, 1e6, 1e300)


def near(*usual: float) -> st.SearchStrategy[float]:
    """A usual number, three times of four, or one at the edge of what is read."""
    return st.one_of(*[st.sampled_from(usual)] * 3, st.sampled_from(WILD))


@st.composite
def frf(draw: st.DrawFn, number: int) -> dict[str, Any]:
    lines = draw(st.sampled_from((1, 2, 8)))
    level = draw(near(5.0, 5.0, -5.0))
    part = st.sampled_from((level, level, 0.0, -level))
    entry: dict[str, Any] = {
        "id": f"r{number}", "sensor": draw(st.sampled_from("ab")),
        "indenter_radius_mm": draw(near(4.0, 8.0)), "preload_n": draw(near(0.5, 1.0, 2.0)),
        "dynamic_force_n": draw(near(0.05)),
        "frequency_hz": [draw(st.sampled_from((1e-6, 1.0, 1e8))) + line for line in range(1)] if lines == 1
        else [1.0 + line for line in range(lines)],
        "frf_re_pc_per_n": draw(st.lists(part, min_size=lines, max_size=lines)),
        "frf_im_pc_per_n": draw(st.lists(part, min_size=lines, max_size=lines)),
        "recorded_at": draw(st.sampled_from(("0001-01-01", "9999-12-31T23:59:59Z", "2020-01-01T10:00:00+02:00"))),
        "dwell_s": draw(near(0.0, 10.0)), "load_cycles": draw(st.sampled_from((0, 100, 2**53))),
        "position_mm": [draw(near(0.0, -8.0)), 0.0],
    }  # fmt: skip
    if draw(st.booleans()):
        entry["coherence"] = draw(st.lists(st.sampled_from((0.0, 0.9, 1.0)), min_size=lines, max_size=lines))
    return entry


@st.composite
def series(draw: st.DrawFn, number: int) -> dict[str, Any]:
    size = draw(st.sampled_from((1, 8, 64)))
    column = st.lists(st.one_of(st.just(draw(near(1.0))), st.floats(-2.0, 2.0)), min_size=size, max_size=size)
    return {
        "id": f"r{number}", "sensor": "a", "indenter_radius_mm": 4.0, "preload_n": draw(near(1.0)),
        "dynamic_force_n": 1.0, "sample_rate_hz": draw(near(512.0)), "force_n": draw(column), "charge_pc": draw(column),
    }  # fmt: skip


@st.composite
def curve(draw: st.DrawFn, number: int, kind: str) -> dict[str, Any]:
    size = draw(st.sampled_from((1, 5, 30)))
    deepest, largest, power = draw(near(1.0)), draw(near(1.0, -1.0, 0.0)), draw(st.sampled_from((0.0, 1.0, 1.5)))
    way = [step / max(size - 1, 1) for step in range(size)]
    there = {
        "displacement_mm": [deepest * place for place in way],
        "force_n": [largest * place**power + draw(st.sampled_from((0.0, 0.01))) for place in way],
    }
    back = {name: column + column[::-1] for name, column in there.items()} if draw(st.booleans()) else there
    shape = (
        {"indenter_radius_mm": draw(near(4.0))}
        if kind == "indentation"
        else {"sample_height_mm": draw(near(10.0)), "sample_diameter_mm": draw(near(20.0))}
    )
    return {"id": f"r{number}", "kind": kind, **shape, **back}


@st.composite
def campaigns(draw: st.DrawFn) -> dict[str, Any]:
    kind = draw(st.sampled_from(("frf", "series", "indentation", "compression")))
    entry = {"frf": frf, "series": series}.get(kind)
    recordings = [
        draw(curve(number, kind) if entry is None else entry(number)) for number in range(draw(st.integers(1, 3)))
    ]
    return {
        "schema": "campaign/1", "name": "edge", "units_checked": draw(st.booleans()),
        "skin": {
            "thickness_mm": draw(near(2.0)), "youngs_modulus_mpa": draw(near(3.0)), "sensor_radius_mm": draw(near(1.0)),
            "poisson_ratio": draw(st.sampled_from((0.0, 0.5))), "d33_pc_per_n": draw(near(15.0, -15.0)),
            "sensors": [{"id": "a", "x_mm": 0.0, "y_mm": 0.0}, {"id": "b", "x_mm": draw(near(8.0, 0.0)), "y_mm": 0.0}],
        },
        "recordings": recordings,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of arithmetic: a warning says nothing to a user, a report does
@EDGE
@given(document=campaigns())
def test_every_campaign_that_is_read_is_answered(document: dict[str, Any], table: SigmaTable) -> None:
    try:
        campaign, _ = from_dict(document)
        report = lean_report(campaign, table, *FEW)
    except InvalidInput:  # it names a field by itself
        return
    assert report["verdict"] in {"no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"}


def test_an_impossible_skin_is_named(table: SigmaTable) -> None:
    """One beyond all bounds as it is read, and a sensor far wider than the skin is thick by its diagnosis."""
    field, value = "sensor_radius_mm", 1e5
    entry = {
        "id": "r", "sensor": "a", "indenter_radius_mm": 4.0, "preload_n": 1.0, "dynamic_force_n": 0.1,
        "frequency_hz": [1.0], "frf_re_pc_per_n": [5.0], "frf_im_pc_per_n": [0.0],
    }  # fmt: skip
    skin = {
        "poisson_ratio": 0.5, "thickness_mm": 2.0, "youngs_modulus_mpa": 3.0, "sensor_radius_mm": 1.0,
        "sensors": [{"id": "a", "x_mm": 0.0, "y_mm": 0.0}], field: value,
    }  # fmt: skip
    document = {"schema": "campaign/1", "name": "n", "units_checked": True, "skin": skin, "recordings": [entry]}
    with pytest.raises(InvalidInput, match=r"skin\.thickness_mm = 1e\+300: must be 1e-09 to 1e\+06 in magnitude"):
        from_dict({**document, "skin": {**skin, "thickness_mm": 1e300}})
    report = looked_at(from_dict(document)[0], table)
    assert report["verdict"] == "insufficient_data"
    assert [(found["code"], found["field"]) for found in report["findings"]] == [("impossible_number", f"skin.{field}")]
    assert f"skin.{field}" in report["statement"]


@pytest.mark.slow
def test_the_faint_forces_of_a_soft_cantilever_are_meant(table: SigmaTable) -> None:
    random = np.random.default_rng(3)
    depth_mm = np.linspace(-5e-4, 5e-4, 600)
    force = 16 / 9 * 2e3 * np.sqrt(1e-5) * (1e-3 * np.maximum(depth_mm, 0.0)) ** 1.5  # N, of a gel of 2 kPa
    assert force.max() < 1e-8
    entry = {
        "id": "r", "kind": "indentation", "indenter_radius_mm": 0.01, "displacement_mm": depth_mm.tolist(),
        "force_n": (force + 1e-11 * random.normal(size=600)).tolist(),
    }  # fmt: skip
    document = {
        "schema": "campaign/1", "name": "n", "units_checked": True, "skin": {"poisson_ratio": 0.5, "thickness_mm": 1.0},
        "recordings": [entry],
    }  # fmt: skip
    report = looked_at(from_dict(document)[0], table, "layered_contact", "strain_stiffening")
    assert report["verdict"] == "no_mismatch"
    assert report["fit"]["before"]["youngs_modulus"]["low"] < 2e-3 < report["fit"]["before"]["youngs_modulus"]["high"]
    assert report["fit"]["before"]["least_squares_modulus_mpa"] == pytest.approx(2e-3, rel=0.02)
