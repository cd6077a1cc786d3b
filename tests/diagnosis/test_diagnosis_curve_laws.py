"""Laws that nobody listed on indentation curves: found, with their numbers, where they are; quiet where nothing is."""

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from bench.soak import SOAK
from tests.support.cases import first
from tests.support.lean_reports import beside, lean_report, whole_report
from underskin.mechanisms import CATALOGUE
from underskin.mechanisms.declared.saving import document
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

FEW = beside("instrument_compliance", "strain_stiffening")
RADIUS_MM, MODULUS_MPA, DEPTH_MM, NOISE = 4.0, 1.5, 0.3, 1e-3  # noise of the largest force
SECONDS, PAUSE = 40.0, 0.2  # of a recording; the share of its way that lies in the air
Change = Callable[[Floats, Floats], Floats]  # of the travel beyond contact [mm] and the time [s]


def none(travel: Floats, _: Floats) -> Floats:
    return np.zeros_like(travel)


def force_on(travel: Floats) -> Floats:
    """Hertz's [N], of an incompressible body."""
    return np.asarray(16 / 9 * MODULUS_MPA * np.sqrt(RADIUS_MM) * np.maximum(travel, 0.0) ** 1.5)


LARGEST = float(force_on(np.array(DEPTH_MM)))


def campaign(changes: Mapping[str, Change], seed: int = 6, *, air: float = PAUSE) -> dict[str, Any]:
    """Three curves with air at three speeds, with a way back, from the laws themselves."""
    moved, factor, added = (changes.get(name, none) for name in ("moved", "factor", "added"))
    random = np.random.default_rng(seed)
    recordings = []
    for number, seconds in enumerate((0.25 * SECONDS, 0.5 * SECONDS, SECONDS)):
        way_in = DEPTH_MM * np.linspace(-air, 1.0, 400)
        travel: Floats = np.concatenate([way_in, way_in[-2::-1]])
        time: Floats = seconds / 800 * np.arange(float(len(travel)))
        force = force_on(travel + moved(travel, time))
        force = force * (1 + factor(travel, time)) + added(travel, time)
        force += NOISE * LARGEST * random.normal(size=len(force))
        named = {"id": f"c{number}", "kind": "indentation", "indenter_radius_mm": RADIUS_MM}
        samples = {"displacement_mm": travel.tolist(), "force_n": force.tolist(), "time_s": (time + 7.0).tolist()}
        recordings.append({**named, **samples})
    skin = {"thickness_mm": 80.0, "poisson_ratio": 0.5}
    return {"schema": "campaign/1", "name": "law", "units_checked": True, "skin": skin, "recordings": recordings}


LAWS: Mapping[str, tuple[dict[str, Change], str, str, set[str], dict[str, float]]] = {
    "a cell that is not linear": (
        {"factor": lambda travel, _: -0.04 * force_on(travel) / LARGEST},
        "gain", "force_n", {"linear"}, {"change": -0.04},
    ),
    "a zero that drifts with the root of time": (
        {"added": lambda _, time: 0.06 * LARGEST * np.sqrt(time / SECONDS)},
        "force", "time_s", {"power"}, {"change": 0.06 * LARGEST, "exponent": 0.5},
    ),
    "a frame that warms up": (
        {"moved": lambda _, time: 0.01 * (1 - np.exp(-time / 4.0))},
        "position", "time_s", {"saturating"}, {"change": 0.01, "approach": 4.0},
    ),
    "a frame that gives way after a while": (
        {"moved": lambda _, time: 0.012 * np.maximum(time - 15.0, 0.0) / 25.0},
        "position", "time_s", {"threshold"}, {"change": 0.012, "onset": 15.0},
    ),
    "a screw with a periodic error": (
        {"added": lambda travel, _: 0.01 * LARGEST * np.sin(2 * np.pi * travel / 0.04) * (travel > 0)},
        "force", "displacement_mm", {"periodic"}, {"amplitude": 0.01 * LARGEST, "period": 0.04},
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def reports(table: SigmaTable) -> Callable[[str], dict[str, Any]]:
    """The report on a campaign with a law of `LAWS`, made once for all tests here."""

    def made(name: str) -> dict[str, Any]:
        return lean_report(parse(campaign(LAWS[name][0])), table, *FEW)

    return cache(made)


@pytest.mark.parametrize("name", first(1, LAWS))
def test_law_found_numbers_predicts_held(name: str, reports: Callable[[str], dict[str, Any]]) -> None:
    """A law is found with its numbers and predicts what was held out."""
    _, acts_on, axis, forms, true = LAWS[name]
    report = reports(name)
    assert report["verdict"] == "unexplained"
    assert report["probability"] > 0.9
    law = report["unnamed"]
    assert (law["acts_on"], law["axis"]) == (acts_on, axis)
    assert law["form"] in forms
    values = {entry["name"]: entry for entry in law["parameters"]}
    for parameter, value in true.items():
        # A twentieth of the value beside the interval: what bends a form gives way to the amplitude
        slack = 0.05 * abs(value)
        assert values[parameter]["low"] - slack < value < values[parameter]["high"] + slack
    held_out = law["heldout_rmse_percent"]
    assert held_out["after"] < 0.8 * held_out["before"]
    assert held_out["after"] < 1.5 * report["fit"]["noise_floor_percent"]
    assert "samples held out are predicted" in report["statement"]
    low, high = law["range"][axis]
    assert low == 0
    assert high == pytest.approx({"force_n": LARGEST, "displacement_mm": DEPTH_MM, "time_s": SECONDS}[axis], rel=0.05)


@pytest.mark.parametrize("seed", first(1, [6, 7, 8]))
def test_where_nothing_is_missing_no_law_is_stated(seed: int, table: SigmaTable) -> None:
    report = lean_report(parse(campaign({}, seed)), table, *FEW)
    assert report["verdict"] == "no_mismatch"
    assert report["unnamed"] is None


@pytest.mark.parametrize("seed", first(1, [1, 2, 3]))
def test_slow_noise_that_the_air_shows_is_no_law(seed: int, table: SigmaTable) -> None:
    """Noise of a second's correlation, as large as the white noise, which second differences of samples do not see."""
    random = np.random.default_rng(seed)

    def wandering(travel: Floats, time: Floats) -> Floats:
        kept = np.exp(-float(time[1] - time[0]) / 1.0)
        shocks = np.sqrt(1 - kept**2) * random.normal(size=len(travel))
        return NOISE * LARGEST * np.asarray(lfilter([1.0], [1.0, -kept], shocks))

    report = lean_report(parse(campaign({"added": wandering}, seed, air=1.0)), table, *FEW)
    assert report["verdict"] == "no_mismatch"
    assert report["fit"]["after"]["youngs_modulus"]["value"] == pytest.approx(MODULUS_MPA, rel=0.02)


def test_a_named_law_that_does_the_same_stands_before_the_unnamed_one(table: SigmaTable) -> None:
    """A stage that gives moves the surface by its deflection, which no law over the time can be told from beside it."""
    stiffness = LARGEST / (0.05 * DEPTH_MM)
    travel = np.linspace(0.0, DEPTH_MM, 2000)
    commanded = travel + force_on(travel) / stiffness
    gives: dict[str, Change] = {"moved": lambda at, _: np.interp(at, commanded, travel) - np.maximum(at, 0.0)}
    report = lean_report(parse(campaign(gives)), table, *FEW)
    assert report["unnamed"] is None
    assert report["mechanisms"][0]["name"] == "instrument_compliance"


@pytest.mark.parametrize("name", first(1, LAWS))
def test_a_law_of_curves_is_kept_and_recognised_by_name(
    name: str,
    reports: Callable[[str], dict[str, Any]],
    table: SigmaTable,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    changes = LAWS[name][0]
    (tmp_path / "kept.yaml").write_text(document(reports(name), "our_law"), encoding="utf-8")
    monkeypatch.setenv("UNDERSKIN_MECHANISMS", str(tmp_path))
    CATALOGUE.reload()
    try:
        later = whole_report(parse(campaign(changes, seed=8)), table, *FEW)
        fitted = whole_report(parse(campaign({}, seed=8)), table, *FEW) if SOAK else None
    finally:
        monkeypatch.delenv("UNDERSKIN_MECHANISMS")
        CATALOGUE.reload()
    assert later["verdict"] == "explained"
    assert [entry["name"] for entry in later["mechanisms"]] == ["our_law"]
    held_out, floor = later["fit"]["after"]["heldout_rmse_percent"], later["fit"]["noise_floor_percent"]
    assert held_out < 1.3 * floor
    assert fitted is None or fitted["verdict"] == "no_mismatch"
