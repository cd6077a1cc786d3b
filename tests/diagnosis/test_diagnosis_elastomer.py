"""What curves of an elastomer tell beside FRFs or alone: modulus, thickness, rate of relaxation."""

import numpy as np
import pytest

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from tests.support.cases import first
from tests.support.kinds_campaigns import BLOCK, LINES, SKIN, SPHERE, Effects, curves, lines, modulus_of, named, report
from tests.support.lean_reports import COSTLY
from underskin.diagnosis.data.dataset import lines as frf_lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.selection.curve_knowledge import OtherKind, of_curves
from underskin.diagnosis.selection.other_kinds import Beside
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable


def test_the_modulus_that_is_stated_of_a_block_is_the_true_one_not_the_declared_one(table: SigmaTable) -> None:
    document = {"schema": "campaign/1", "name": "block", "skin": lines()["skin"], "recordings": []}
    found = report(document, curves("compression", BLOCK, 9.0), table)
    assert named(found) == ["modulus_error"]
    modulus = found["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] < 9.0 < modulus["high"]
    assert modulus["high"] / modulus["low"] < 1.15 * 1.32  # scatter, and friction that one shape hides
    assert f"{modulus['value']:.3g} MPa" in found["statement"]


def test_relaxation_that_short_curves_tell_as_a_rate_alone_is_the_skins(table: SigmaTable) -> None:
    """Curves of two seconds tell g/τ of a relaxation that takes a minute, and neither g nor τ."""
    creep: Effects = {"contact_creep": {"fraction": 0.45, "time_s": 60.0}}
    dwells = {**LINES["design"], "dwells_s": [5.0, 60.0, 400.0]}
    described = {**LINES, "design": dwells, "noise": {**LINES["noise"], "gain": 0.01}, "seed": 4, "effects": creep}
    measured = campaign_of_lines(record_lines(experiment(described)))
    brief = {**SPHERE, "speeds_mm_per_s": [0.25], "retract": True, "repeats": 1, "force_noise_n": 1e-3}
    document = report(measured, curves("indentation", brief, effects=creep), table, "adhesion", "compressible_layer")
    assert document["contradictions"] == []
    assert (document["verdict"], named(document)) == ("explained", ["contact_creep"])
    fraction, time = document["mechanisms"][0]["parameters"]
    assert fraction["low"] < 0.45 < fraction["high"]
    assert time["low"] < 60.0 < time["high"]


@pytest.mark.parametrize(
    ("fraction", "time_s", "dwells", "preloads", "hold"),
    first(1, [(0.22, 6.0, [30.0, 60.0], [0.5, 1, 2, 3, 5], 4.0), (0.3, 20.0, [5.0, 8.0], [1, 2], 10.0)]),
)
def test_relaxation_that_curves_tell_better_than_frfs_is_theirs(
    fraction: float, time_s: float, dwells: list[float], preloads: list[float], hold: float, table: SigmaTable
) -> None:
    """A hold tells g and τ, correlated with each other; FRFs of few dwell times, with much scatter, tell neither."""
    creep: Effects = {"contact_creep": {"fraction": fraction, "time_s": time_s}}
    design = {**LINES["design"], "dwells_s": dwells, "preloads_n": preloads}
    described = {**LINES, "design": design, "noise": {**LINES["noise"], "gain": 0.04}, "seed": 4, "effects": creep}
    measured = campaign_of_lines(record_lines(experiment(described)))
    held = {**SPHERE, "hold_s": hold, "repeats": 2}
    document = report(measured, curves("indentation", held, effects=creep), table, "adhesion", "compressible_layer")
    assert document["contradictions"] == []
    assert (document["verdict"], named(document)) == ("explained", ["contact_creep"])
    told, time = document["mechanisms"][0]["parameters"]
    assert told["low"] < fraction < told["high"]
    assert time["low"] < time_s < time["high"]


def test_indentations_that_feel_the_base_tell_the_thickness_that_is_declared_wrongly(table: SigmaTable) -> None:
    """E of such curves holds although the declared thickness is 15 % too large."""
    both: Effects = {"layered_contact": {}, "thickness_error": {"factor": 0.87}}
    deep = {**SPHERE, "largest_displacement_mm": 0.8, "indenters_mm": [3]}
    measured = lines(effects=both)
    pressed = curves("indentation", deep, effects={"layered_contact": {}}, thickness=0.87 * SKIN["thickness_mm"])
    document = report(measured, pressed, table, *COSTLY)
    assert document["contradictions"] == []
    assert {"layered_contact", "thickness_error"} <= set(named(document))
    told = modulus_of(document, "indentation")
    assert told["low"] < 16.0 < told["high"]
    (factor,) = [entry for entry in document["by_kind"] if entry["parameter"] == "thickness_factor"]
    assert factor["low"] < 0.87 < factor["high"]


@pytest.mark.parametrize(("law", "coefficient"), [("linear", 7.0), ("limited", 2.8)])
def test_the_modulus_of_a_block_that_stiffens_strongly_holds(law: str, coefficient: float, table: SigmaTable) -> None:
    """A modulus that grows with the strain itself, far beyond a silicone's: half as stiff again at 7 % and at 12 %."""
    stiff: Effects = {"strain_stiffening": {"law": law, "coefficient": coefficient}}
    deep = {**BLOCK, "largest_displacement_mm": 2.5}
    document = report(lines(effects=stiff), curves("compression", deep, effects=stiff), table)
    assert "strain_stiffening" in named(document)
    told = modulus_of(document, "compression")
    assert told["low"] < 16.0 < told["high"]
    assert told["high"] / told["low"] < 2.0


def test_a_wrong_modulus_and_a_wrong_thickness_are_both_told_beside_a_resonance(table: SigmaTable) -> None:
    wrong: Effects = {"thickness_error": {"factor": 1.16}, "contact_resonance": {"tip_mass_g": 6.0, "damping": 0.04}}
    described = {**LINES, "lines": {"low_hz": 10, "high_hz": 1000, "count": 30}, "noise": {"gain": 0.01, "line": 0.01}}
    described |= {"design": {**LINES["design"], "offsets_mm": [[0, 0], [1.2, 0]]}}
    described |= {"seed": 9, "effects": wrong, "skin": {**LINES["skin"], "youngs_modulus_mpa": 9.0}}
    measured = campaign_of_lines(record_lines(experiment({**described, "schema": "experiment/1"})))
    measured["skin"]["youngs_modulus_mpa"] = 16.0
    others = ("crosstalk", "ageing", "mains_pickup", "sensor_relaxation", *COSTLY)
    document = report(measured, curves("compression", BLOCK, 9.0), table, *others)
    assert {"modulus_error", "thickness_error", "contact_resonance"} <= set(named(document))
    told = {mechanism["name"]: mechanism["parameters"][0] for mechanism in document["mechanisms"]}
    assert told["modulus_error"]["low"] < 9 / 16 < told["modulus_error"]["high"]
    assert told["thickness_error"]["low"] < 1.16 < told["thickness_error"]["high"]


def _told_of_a_compressible_layer(effects: Effects, names: tuple[str, ...], table: SigmaTable) -> OtherKind:
    """Indentations of an elastomer of 16 MPa with the null hypothesis alone; what it tells of `names` is fitted."""
    document = lines()
    document["recordings"] += curves("indentation", {**SPHERE, "retract": True}, effects=effects)
    problem = of_curves(parse(document), "indentation", table, ())
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    kind = OtherKind("indentation", problem, [nothing])
    kind.told(names, kind.supported)
    return kind


@pytest.mark.parametrize("effects", [{}, {"adhesion": {"work_j_per_m2": 1.0}}])
def test_poissons_ratio_that_indentations_do_not_tell_leaves_the_modulus_as_open_as_its_bounds_do(
    effects: Effects, table: SigmaTable
) -> None:
    """They tell E/(1 − ν²), as of a sphere on a half space: E by what ν may be, from 0.3 to 0.5."""
    names = ("compressible_layer", *effects)
    kind = _told_of_a_compressible_layer(effects, names, table)
    told = kind.told(names, kind.supported)
    log_e = np.log(16e6 * (1 - np.linspace(0.3, 0.5, 2001) ** 2) / 0.75)
    assert told.mean[0] == pytest.approx(log_e.mean(), abs=0.03)
    assert np.sqrt(told.covariance[0, 0]) == pytest.approx(log_e.std(), rel=0.1)
    assert told.quantities[1] == ("compressible_layer", "poisson_ratio")
    assert told.mean[1] == pytest.approx(0.4, abs=0.01)
    assert np.sqrt(told.covariance[1, 1]) == pytest.approx(0.2 / np.sqrt(12), rel=0.05)


def test_frfs_of_a_compressible_layer_learn_the_modulus_from_indentations_and_not_poissons_ratio(
    table: SigmaTable,
) -> None:
    kind = _told_of_a_compressible_layer({}, ("compressible_layer",), table)
    problem = FittingProblem(frf_lines(parse(lines())), table, Beside([kind], ()))
    hypothesis = problem.hypothesis(("modulus_error", "compressible_layer"), placed=False)
    knowledge = hypothesis.knowledge
    assert knowledge is not None
    places = {entry.name: place for place, entry in enumerate(hypothesis.model.parameters)}
    known = places["modulus_factor"]
    assert knowledge.precision[known, known] ** -0.5 == pytest.approx(0.06, rel=0.15)
    assert not knowledge.precision[places["poisson_ratio"]].any()
