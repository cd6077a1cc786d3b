"""Exchanged columns and slips of units of whole campaigns: named, and no number is given."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from underskin import diagnose
from underskin.errors import InvalidInput
from underskin.inversion import elastomer
from underskin.inversion.invert import NoD33, invert
from underskin.recordings import plausibility
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, parse
from underskin.recordings.curve_preparation import are_exchanged
from underskin.surrogate.sigma_table import SigmaTable, load_table


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


def travel(way: str, rng: np.random.Generator) -> Any:
    """The way of a stage [mm] into a sample whose surface lies at 0."""
    if way == "from contact":
        there = np.linspace(0.0, 0.4, 200)
    elif way == "held":
        there = np.concatenate([np.linspace(-0.3, 0.4, 300), np.full(150, 0.4)])
    else:
        there = np.linspace(-0.3, 0.4, 300)
    back = there[::-1] if way == "back" else there[:0]
    whole = np.concatenate([there, back])
    return whole + 2e-4 * rng.normal(size=len(whole))


def curve(way: str, noise: float, *, exchanged: bool, unit: float = 1.0, seed: int = 0) -> Campaign:
    """A sphere of 5 mm on 1.2 MPa; `unit`: what the force in N is multiplied by."""
    rng = np.random.default_rng(seed)
    depth = travel(way, rng)
    force = 4 / 3 * 1.2 / 0.75 * np.sqrt(5) * np.maximum(depth, 0) ** 1.5
    force = unit * (force + noise * force.max() * rng.normal(size=len(depth)))
    columns = (force, depth) if exchanged else (depth, force)
    recording = {"id": "c", "kind": "indentation", "indenter_radius_mm": 5.0}
    recording |= dict(zip(("displacement_mm", "force_n"), (column.tolist() for column in columns), strict=True))
    return parse({"schema": "campaign/1", "name": "c", "skin": {"poisson_ratio": 0.5}, "recordings": [recording]})


@pytest.mark.parametrize("way", ["back", "held", "from contact", "in"])
@pytest.mark.parametrize("noise", [0.003, 0.03])
def test_exchanged_columns_of_a_curve_give_no_modulus(way: str, noise: float) -> None:
    (found,) = elastomer.of_campaign(curve(way, noise, exchanged=True))
    assert isinstance(found.result, InvalidInput)
    assert "look exchanged" in str(found.result)
    (right,) = elastomer.of_campaign(curve(way, noise, exchanged=False))
    assert not isinstance(right.result, InvalidInput)
    assert right.result.modulus == pytest.approx(1.2e6, rel=0.1)


@pytest.mark.parametrize("way", ["back", "held", "in"])
def test_exchanged_columns_are_named_where_the_stage_is_noisier_than_the_cell(way: str) -> None:
    """0.03 % of the travel and 0.01 % of the force; the travel in the air shows which is the stage."""
    (found,) = elastomer.of_campaign(curve(way, 1e-4, exchanged=True))
    assert isinstance(found.result, InvalidInput)
    assert "look exchanged" in str(found.result)
    assert not are_exchanged(curve(way, 1e-4, exchanged=False).curves[0])


def test_a_diagnosis_names_exchanged_columns() -> None:
    report = diagnose(curve("back", 0.01, exchanged=True))
    assert report["verdict"] == "insufficient_data"
    assert "look exchanged" in report["statement"]


def test_what_moves_like_that_by_physics_is_not_exchanged() -> None:
    """A hold that relaxes before a way back; a force that is controlled, on a stage that sticks first as well; a drift
    before the press."""
    rng = np.random.default_rng(3)
    relaxing = np.concatenate([1 - 0.4 * (1 - np.exp(-np.arange(200) / 60)), np.linspace(0.6, 0.0, 100)])
    held = np.concatenate([np.full(200, 0.4), np.linspace(0.4, 0.1, 100)])
    controlled = np.linspace(0, 1, 300)
    for displacement, force in (
        (held, relaxing),
        (controlled ** (2 / 3) + 1e-3 * rng.normal(size=300), controlled),
        (
            np.maximum(controlled - 0.2, 0) ** (2 / 3) + 1e-4 * rng.normal(size=300),
            controlled + 1e-3 * rng.normal(size=300),
        ),
        (controlled + 2e-2 * rng.normal(size=300), controlled),
    ):
        campaign = curve("in", 0.0, exchanged=False)
        recording = campaign.recordings[0]
        assert isinstance(recording, IndentationRecording)
        recording = replace(recording, displacement_mm=displacement, force_n=force)
        (found,) = elastomer.of_campaign(replace(campaign, recordings=(recording,)))
        assert "exchanged" not in str(found.result)


@pytest.mark.parametrize(("unit", "slip"), [(1e3, "N for mN"), (1e6, "N for µN"), (1e-3, "N for kN")])
def test_a_slip_of_a_curves_force_is_told_at_reading(unit: float, slip: str) -> None:
    campaign = curve("back", 0.01, exchanged=False, unit=unit)
    (finding,) = plausibility.at_reading(campaign)
    assert finding.code == "units_off_by_1000"
    assert f"{slip}" in finding.statement
    report = diagnose(campaign)
    assert report["statement"].startswith("Nothing can be concluded before a correction")
    assert slip in report["statement"]
    assert plausibility.at_reading(replace(campaign, units_checked=True)) == []


def frfs(preloads: tuple[float, ...], radii: tuple[float, ...], modulus: float, *, exchanged: bool) -> Campaign:
    entries: list[dict[str, Any]] = []
    for preload in preloads:
        for radius in radii:
            force, sphere = (radius, preload) if exchanged else (preload, radius)
            frf = {
                "frequency_hz": [10, 20, 40],
                "frf_re_pc_per_n": [7.4, 7.41, 7.4 - 1e-3 * len(entries)],
                "frf_im_pc_per_n": [0.0, 0.01, 0.0],
            }
            common = {"id": f"{preload} {radius}", "sensor": "s01", "dynamic_force_n": 0.05}
            entries.append({**common, **frf, "preload_n": force, "indenter_radius_mm": sphere})
    skin: dict[str, Any] = {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": modulus,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": 1.5,
    }
    skin |= {"sensors": [{"id": "s01", "x_mm": 0, "y_mm": 0}]}
    return parse({"schema": "campaign/1", "name": "c", "skin": skin, "recordings": entries})


@pytest.mark.parametrize(
    ("preloads", "radii", "modulus"),
    [((1.0, 2.0), (4.0, 10.0), 16.0), ((0.25, 0.5, 1.0), (4.0, 8.0), 2.0), ((0.5,), (5.0,), 1.0)],
)
def test_exchanged_preloads_and_spheres_give_no_d33(
    table: SigmaTable, preloads: tuple[float, ...], radii: tuple[float, ...], modulus: float
) -> None:
    with pytest.raises(NoD33, match="or preload_n and indenter_radius_mm are exchanged"):
        invert(frfs(preloads, radii, modulus, exchanged=True), table)
    assert invert(frfs(preloads, radii, modulus, exchanged=False), table).campaign_d33 is not None


def test_preloads_and_spheres_that_are_meant_are_used(table: SigmaTable) -> None:
    """Of four loads that are meant one lies within the tables: its d33 is given, and the others are named."""
    meant = replace(frfs((1.0, 2.0), (4.0, 10.0), 16.0, exchanged=True), units_checked=True)
    found = invert(meant, table)
    assert found.campaign_d33 is not None
    assert len(found.left_out) == 3


def test_a_small_sphere_pressed_hard_is_not_exchanged(table: SigmaTable) -> None:
    """R = 1 mm under 1 to 3 N: as one preload does not exceed the radius, what lies beyond the tables is left out."""
    found = invert(frfs((1.0, 2.0, 3.0), (1.0,), 16.0, exchanged=False), table)
    assert found.recordings.inside.tolist() == [True, False, False]
    assert len(found.left_out) == 2


def test_a_diagnosis_names_exchanged_preloads_and_spheres() -> None:
    report = diagnose(frfs((1.0, 2.0), (4.0, 10.0), 16.0, exchanged=True))
    assert report["verdict"] == "insufficient_data"
    assert "or preload_n and indenter_radius_mm are exchanged" in report["statement"]


@pytest.mark.parametrize("strain", [0.02, 0.3])
def test_a_displacement_that_begins_late_is_not_exchanged(strain: float) -> None:
    """An extensometer with play reads zero at first; a force at zero before contact is told none the less."""
    rng = np.random.default_rng(5)
    steady = np.linspace(-0.2, 1.0, 500)
    strains = strain * np.maximum(steady, 0.0)
    load = ((1 - strains) ** -2 - (1 - strains)) / 3
    load += 1e-3 * load.max() * rng.normal(size=500)
    late = np.interp(np.maximum(steady, 0.0) * load.max(), np.sort(load), np.sort(strains))
    for displacement, force, expected in (
        (late + 1e-3 * strain * rng.normal(size=500), steady, False),
        (strain * steady, load, False),
        (load, strain * steady, strain > 0.05),
    ):
        assert are_exchanged(CompressionRecording("block", 10.0, 10.0, displacement, force_n=force)) == expected


def test_a_block_pressed_by_more_than_its_height_gives_no_modulus() -> None:
    """Force and displacement of a block of 10 mm are exchanged: the "displacement" is 18 mm."""
    travel = np.linspace(0, 1, 60)
    columns = {"displacement_mm": (18 * travel).tolist(), "force_n": travel.tolist()}
    block = {"id": "b", "kind": "compression", "sample_height_mm": 10, "sample_diameter_mm": 12, **columns}
    document = {"schema": "campaign/1", "name": "b", "skin": {"poisson_ratio": 0.5}, "recordings": [block]}
    (found,) = elastomer.of_campaign(parse(document))
    assert isinstance(found.result, InvalidInput)
    assert "exchanged with force_n" in str(found.result)
