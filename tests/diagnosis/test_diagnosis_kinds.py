"""FRFs, a compressed block and indentations of one campaign: one data set, of one material, unless they contradict."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import pytest

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from tests.support.cases import first
from tests.support.kinds_campaigns import (
    BLOCK,
    LINES,
    SKIN,
    SPHERE,
    Effects,
    curves,
    lines,
    modulus_of,
    named,
    report,
)  # fmt: skip
from tests.support.lean_reports import beside
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

# What FRFs of a wrong modulus look like too, and what acts on a block alone
DECLARED = beside("modulus_error", "thickness_error", "strain_stiffening", "platen_friction")
OPEN = tuple(name for name in DECLARED if name not in ("moving_contact_edge", "preload_dependent_d33"))
LAYER = beside("modulus_error", "thickness_error", "layered_contact", "strain_stiffening", "instrument_compliance")
STICKY = beside("adhesion", "instrument_compliance", "modulus_error")
SLOW = beside("contact_creep", "strain_stiffening", "modulus_error", "ageing", "thickness_error", "sensor_relaxation")


@pytest.fixture(scope="module")
def of_frfs_alone(table: SigmaTable) -> dict[str, Any]:
    """The report on FRFs alone of a skin of 9 MPa where 16 is declared."""
    return report(lines(9.0), [], table, *OPEN)


@pytest.fixture(scope="module")
def exact() -> dict[str, Any]:
    """FRFs that say E plainly, many and exact, of a skin that is declared rightly."""
    noise = {"gain": 0.002, "line": 0.002, "coherence": True}
    described = {**LINES, "noise": noise, "seed": 3, "design": {**LINES["design"], "offsets_mm": [[0, 0], [1.2, 0]]}}
    return campaign_of_lines(record_lines(experiment(described)))


@pytest.mark.parametrize(
    ("kind", "design", "width"), first(1, [("compression", BLOCK, 1.45), ("indentation", SPHERE, 1.2)])
)
def test_curves_tell_a_wrong_modulus_that_frfs_alone_cannot(
    kind: str, design: Mapping[str, Any], width: float, of_frfs_alone: dict[str, Any], table: SigmaTable
) -> None:
    """How wide a block has E depends on friction, which one shape does not tell."""
    alone = of_frfs_alone
    assert alone["verdict"] == "ambiguous"
    assert "by_kind" not in alone
    planned = alone["next_experiment"]["statement"]
    assert "A compressed block or an indentation of the same elastomer" in planned
    assert "would tell E, and so whether it is modulus error, with a probability of " in planned
    together = report(lines(9.0), curves(kind, design, 9.0), table, *OPEN)
    assert (together["verdict"], named(together)) == ("explained", ["modulus_error"])
    (factor,) = together["mechanisms"][0]["parameters"]
    assert factor["low"] < 9 / 16 < factor["high"]
    told = modulus_of(together, kind)
    assert told["low"] < 9.0 < told["high"]
    assert told["high"] / told["low"] < width
    assert "E from the " in together["statement"]
    assert "declared 16" in together["statement"]
    assert together["contradictions"] == []
    assert "A compressed block" not in ((together["next_experiment"] or {}).get("statement") or "")


def test_what_acts_on_the_block_alone_is_named_beside_the_frfs(table: SigmaTable) -> None:
    blocks = {**BLOCK, "heights_mm": [4, 12], "diameters_mm": [20, 20]}
    rubbed = curves("compression", blocks, effects={"platen_friction": {"friction": 0.6}})
    document = report(lines(), rubbed, table, *DECLARED)
    assert (document["verdict"], named(document)) == ("explained", ["platen_friction"])
    (friction,) = document["mechanisms"][0]["parameters"]
    assert friction["low"] < 0.6 < friction["high"]
    assert document["mechanisms"][0]["explains_percent"] > 50
    assert modulus_of(document, "compression")["value"] == pytest.approx(16.0, rel=0.03)


@pytest.mark.soak
@pytest.mark.parametrize("friction", [0.3, 0.0, 0.8])
def test_a_modulus_holds_whatever_friction_samples_of_one_shape_hide(friction: float, table: SigmaTable) -> None:
    blocks = curves("compression", BLOCK, effects={"platen_friction": {"friction": friction}} if friction else {})
    document = report(lines(), blocks, table, *DECLARED)
    assert (document["verdict"], document["contradictions"]) == ("no_mismatch", [])
    told = modulus_of(document, "compression")
    assert told["low"] < 16.0 < told["high"]
    bonded = 1 + 2 * (BLOCK["diameters_mm"][0] / (4 * BLOCK["heights_mm"][0])) ** 2
    assert told["low"] > 0.93 * 16.0 * (1 + friction * (bonded - 1)) / bonded
    assert told["high"] < 1.07 * 16.0 * (1 + friction * (bonded - 1))


@pytest.mark.soak
def test_a_wrong_modulus_is_found_beside_what_the_curves_show_as_well(table: SigmaTable) -> None:
    """Neither the law of a thin layer nor another modulus alone explains both kinds: the curves ask for both."""
    layer: Effects = {"layered_contact": {}}
    deep = {**SPHERE, "largest_displacement_mm": 0.8}
    document = report(lines(9.0, layer), curves("indentation", deep, 9.0, layer), table, *LAYER)
    assert set(named(document)) == {"layered_contact", "modulus_error"}
    assert document["contradictions"] == []
    told = modulus_of(document, "indentation")
    assert told["low"] < 9.0 < told["high"]


def test_an_indentation_tells_the_adhesion_that_frfs_do_not_see(table: SigmaTable) -> None:
    sticky = {"adhesion": {"work_j_per_m2": 2.0}}
    measured = lines(effects=sticky)
    assert report(measured, [], table, *STICKY)["verdict"] == "no_mismatch"
    document = report(measured, curves("indentation", SPHERE, effects=sticky), table, *STICKY)
    assert (document["verdict"], named(document)) == ("explained", ["adhesion"])
    (work,) = document["mechanisms"][0]["parameters"]
    assert work["low"] < 2.0 < work["high"]


@pytest.mark.parametrize(
    ("law", "coefficient", "depth_mm"), first(1, [("", 3.0, 5.0), ("linear", 7.0, 2.5), ("limited", 2.8, 2.5)])
)
def test_stiffening_block_skins_although_frfs(law: str, coefficient: float, depth_mm: float, table: SigmaTable) -> None:
    """Stiffening of a block is the skins although its frfs do not show it.

    Also where the modulus grows with the strain itself, far beyond a silicone's.
    """
    stiff: Effects = {"strain_stiffening": {"coefficient": coefficient, **({"law": law} if law else {})}}
    deep = {**BLOCK, "largest_displacement_mm": depth_mm}
    document = report(lines(effects=stiff), curves("compression", deep, effects=stiff), table, *DECLARED)
    assert "strain_stiffening" in named(document)
    assert law or (document["verdict"], named(document)) == ("explained", ["strain_stiffening"])
    told = modulus_of(document, "compression")
    assert told["low"] < 16.0 < told["high"]
    assert told["high"] / told["low"] < 2.0


def test_a_block_of_another_elastomer_contradicts(exact: dict[str, Any], table: SigmaTable) -> None:
    document = report(exact, curves("compression", BLOCK, 48.0), table, *DECLARED)
    (contradiction,) = document["contradictions"]
    assert contradiction["kinds"] == ["frf", "compression"]
    assert "contradict each other" in document["statement"]
    assert document["verdict"] == "no_mismatch"
    assert modulus_of(document, "compression")["value"] == pytest.approx(48.0, rel=0.05)


def test_indentations_and_a_block_are_one_data_set_too(table: SigmaTable) -> None:
    """And of a block alone the modulus that is stated is the true one, not the declared one."""
    both = [*curves("indentation", SPHERE, 9.0), *curves("compression", BLOCK, 9.0)]
    document: dict[str, Any] = {"schema": "campaign/1", "name": "curves", "skin": lines()["skin"], "recordings": []}
    undeclared = deepcopy(document)
    undeclared["skin"]["youngs_modulus_mpa"] = None
    found = report(undeclared, both, table, *DECLARED)
    assert found["verdict"] == "no_mismatch"
    assert {entry["kind"] for entry in found["by_kind"]} == {"indentation", "compression"}
    for kind in ("indentation", "compression"):
        told = modulus_of(found, kind)
        assert told["low"] < 9.0 < told["high"]
    alone = report(document, curves("compression", BLOCK, 9.0), table, *DECLARED)
    assert named(alone) == ["modulus_error"]
    modulus = alone["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] < 9.0 < modulus["high"]
    assert modulus["high"] / modulus["low"] < 1.15 * 1.32  # scatter, and friction that one shape hides
    assert f"{modulus['value']:.3g} MPa" in alone["statement"]


def test_the_stage_of_spheres_is_not_the_frame_of_blocks(table: SigmaTable) -> None:
    """A soft stage under the spheres says nothing of what presses the block: both tell one E all the same."""
    soft: Effects = {"instrument_compliance": {"stiffness_n_per_mm": 60.0}}
    both = [*curves("indentation", SPHERE, 9.0, effects=soft), *curves("compression", BLOCK, 9.0)]
    document: dict[str, Any] = {"schema": "campaign/1", "name": "curves", "skin": lines()["skin"], "recordings": []}
    document["skin"]["youngs_modulus_mpa"] = None
    found = report(document, both, table, *beside("instrument_compliance", "strain_stiffening"))
    assert (found["contradictions"], named(found)) == ([], ["instrument_compliance"])
    for kind in ("indentation", "compression"):
        told = modulus_of(found, kind)
        assert told["low"] < 9.0 < told["high"]


RELAXING: list[tuple[float, float, list[float], dict[str, Any], float]] = [
    (0.45, 60.0, [5.0, 60.0, 400.0], {"speeds_mm_per_s": [0.25], "retract": True, "force_noise_n": 1e-3}, 0.01),
    (0.22, 6.0, [30.0, 60.0], {"hold_s": 4.0, "repeats": 2}, 0.04),
]


@pytest.mark.parametrize(("fraction", "time_s", "dwells", "pressing", "gain"), first(1, RELAXING))
def test_relaxation_is_told_by_the_kind_that_shows_it(
    fraction: float, time_s: float, dwells: list[float], pressing: dict[str, Any], gain: float, table: SigmaTable
) -> None:
    """Curves of two seconds tell g/τ of a relaxation of a minute alone, FRFs of three dwells both; a hold tells g and
    τ, FRFs of few dwells, with much scatter, neither."""
    creep: Effects = {"contact_creep": {"fraction": fraction, "time_s": time_s}}
    design = {**LINES["design"], "dwells_s": dwells}
    described = {**LINES, "design": design, "noise": {**LINES["noise"], "gain": gain}, "seed": 4, "effects": creep}
    measured = campaign_of_lines(record_lines(experiment(described)))
    document = report(measured, curves("indentation", {**SPHERE, **pressing}, effects=creep), table, *SLOW)
    assert document["contradictions"] == []
    assert (document["verdict"], named(document)) == ("explained", ["contact_creep"])
    told, time = document["mechanisms"][0]["parameters"]
    assert told["low"] < fraction < told["high"]
    assert time["low"] < time_s < time["high"]


@pytest.mark.soak
def test_indentations_that_feel_the_base_tell_the_thickness_that_is_declared_wrongly(table: SigmaTable) -> None:
    """E of such curves holds although the declared thickness is 15 % too large."""
    both: Effects = {"layered_contact": {}, "thickness_error": {"factor": 0.87}}
    deep = {**SPHERE, "largest_displacement_mm": 0.8, "indenters_mm": [3]}
    pressed = curves("indentation", deep, effects={"layered_contact": {}}, thickness=0.87 * SKIN["thickness_mm"])
    document = report(lines(effects=both), pressed, table, *LAYER)
    assert document["contradictions"] == []
    assert {"layered_contact", "thickness_error"} <= set(named(document))
    told = modulus_of(document, "indentation")
    assert told["low"] < 16.0 < told["high"]
    (factor,) = [entry for entry in document["by_kind"] if entry["parameter"] == "thickness_factor"]
    assert factor["low"] < 0.87 < factor["high"]
