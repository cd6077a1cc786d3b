"""FRFs, a compressed block and indentations of one campaign: one data set, of one material, unless they contradict."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from tests.support.cases import first
from tests.support.kinds_campaigns import BLOCK, LINES, SPHERE, Effects, curves, lines, modulus_of, named, report
from tests.support.lean_reports import COSTLY
from underskin.diagnosis.selection.curve_knowledge import OtherKind, of_curves
from underskin.diagnosis.selection.search import search
from underskin.mechanisms.parameter import HeavyTailed
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable


@pytest.fixture(scope="module")
def of_frfs_alone(table: SigmaTable) -> dict[str, Any]:
    """The report on FRFs alone of a skin of 9 MPa where 16 is declared."""
    return report(lines(9.0), [], table)


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
    together = report(lines(9.0), curves(kind, design, 9.0), table)
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


def test_curves_that_agree_rule_out_what_frfs_alone_leave_open(table: SigmaTable) -> None:
    measured = lines(effects={"thickness_error": {"factor": 1.2}})
    open_before = {tuple(entry["mechanisms"]) for entry in report(measured, [], table)["alternatives"]}
    open_after = {
        tuple(entry["mechanisms"])
        for entry in report(measured, curves("compression", BLOCK), table)["alternatives"]
        if entry["probability"] > 0.01
    }
    assert ("modulus_error",) in open_before
    assert ("modulus_error",) not in open_after
    assert ("thickness_error",) in open_after


def test_what_acts_on_the_block_alone_is_named_beside_the_frfs(table: SigmaTable) -> None:
    blocks = {**BLOCK, "heights_mm": [4, 12], "diameters_mm": [20, 20]}
    document = report(lines(), curves("compression", blocks, effects={"platen_friction": {"friction": 0.6}}), table)
    assert (document["verdict"], named(document)) == ("explained", ["platen_friction"])
    (friction,) = document["mechanisms"][0]["parameters"]
    assert friction["low"] < 0.6 < friction["high"]
    assert document["mechanisms"][0]["explains_percent"] > 50
    assert modulus_of(document, "compression")["value"] == pytest.approx(16.0, rel=0.03)


@pytest.mark.parametrize("friction", first(1, [0.3, 0.0, 0.8]))
def test_a_modulus_holds_whatever_friction_samples_of_one_shape_hide(friction: float, table: SigmaTable) -> None:
    blocks = curves("compression", BLOCK, effects={"platen_friction": {"friction": friction}} if friction else {})
    document = report(lines(), blocks, table)
    assert (document["verdict"], document["contradictions"]) == ("no_mismatch", [])
    told = modulus_of(document, "compression")
    assert told["low"] < 16.0 < told["high"]
    bonded = 1 + 2 * (BLOCK["diameters_mm"][0] / (4 * BLOCK["heights_mm"][0])) ** 2
    assert told["low"] > 0.93 * 16.0 * (1 + friction * (bonded - 1)) / bonded
    assert told["high"] < 1.07 * 16.0 * (1 + friction * (bonded - 1))


def test_a_wrong_modulus_is_found_beside_what_the_curves_show_as_well(table: SigmaTable) -> None:
    """Neither the law of a thin layer nor another modulus alone explains both kinds: the curves ask for both."""
    layer: Effects = {"layered_contact": {}}
    deep = {**SPHERE, "largest_displacement_mm": 0.8}
    document = report(lines(9.0, layer), curves("indentation", deep, 9.0, layer), table, *COSTLY)
    assert set(named(document)) == {"layered_contact", "modulus_error"}
    assert document["contradictions"] == []
    told = modulus_of(document, "indentation")
    assert told["low"] < 9.0 < told["high"]


def test_an_indentation_tells_the_adhesion_that_frfs_do_not_see(table: SigmaTable) -> None:
    sticky = {"adhesion": {"work_j_per_m2": 2.0}}
    measured = lines(effects=sticky)
    assert report(measured, [], table)["verdict"] == "no_mismatch"
    pressed = curves("indentation", SPHERE, effects=sticky)
    document = report(measured, pressed, table, "contact_creep", "compressible_layer")
    assert (document["verdict"], named(document)) == ("explained", ["adhesion"])
    (work,) = document["mechanisms"][0]["parameters"]
    assert work["low"] < 2.0 < work["high"]


def test_stiffening_of_a_block_is_the_skins_although_its_frfs_do_not_show_it(table: SigmaTable) -> None:
    deep = {**BLOCK, "largest_displacement_mm": 5.0}
    stiff = {"strain_stiffening": {"coefficient": 3.0}}
    document = report(lines(effects=stiff), curves("compression", deep, effects=stiff), table)
    assert (document["verdict"], named(document)) == ("explained", ["strain_stiffening"])
    told = modulus_of(document, "compression")
    assert told["low"] < 16.0 < told["high"]


def test_a_block_of_another_elastomer_contradicts(table: SigmaTable) -> None:
    """FRFs that say E plainly, many and exact, and a block three times as stiff, beside a declaration that is right."""
    exact = {"gain": 0.002, "line": 0.002, "coherence": True}
    described = {**LINES, "noise": exact, "seed": 3, "design": {**LINES["design"], "offsets_mm": [[0, 0], [1.2, 0]]}}
    measured = campaign_of_lines(record_lines(experiment(described)))
    document = report(measured, curves("compression", BLOCK, 48.0), table)
    (contradiction,) = document["contradictions"]
    assert contradiction["kinds"] == ["frf", "compression"]
    assert "contradict each other" in document["statement"]
    assert document["verdict"] == "no_mismatch"
    assert modulus_of(document, "compression")["value"] == pytest.approx(48.0, rel=0.05)


def test_kinds_that_contradict_each_tell_the_modulus_by_what_explains_them_alone(table: SigmaTable) -> None:
    """Deep indentations of another skin: their E counts the base that they feel, which these FRFs do not show."""
    exact = {"gain": 0.002, "line": 0.002, "coherence": True}
    described = {**LINES, "noise": exact, "seed": 3, "design": {**LINES["design"], "offsets_mm": [[0, 0], [1.2, 0]]}}
    measured = campaign_of_lines(record_lines(experiment(described)))
    deep = {**SPHERE, "largest_displacement_mm": 0.8}
    document = report(measured, curves("indentation", deep, 48.0, effects={"layered_contact": {}}), table, *COSTLY)
    assert len(document["contradictions"]) == 1
    assert document["verdict"] == "no_mismatch"
    told = modulus_of(document, "indentation")
    assert told["low"] < 48.0 < told["high"]


def test_indentations_and_a_block_are_one_data_set_too(table: SigmaTable) -> None:
    document = {"schema": "campaign/1", "name": "curves", "skin": {**lines()["skin"], "youngs_modulus_mpa": None}}
    both = [*curves("indentation", SPHERE, 9.0), *curves("compression", BLOCK, 9.0)]
    found = report({**document, "recordings": []}, both, table, *COSTLY)
    assert found["verdict"] == "no_mismatch"
    assert {entry["kind"] for entry in found["by_kind"]} == {"indentation", "compression"}
    for kind in ("indentation", "compression"):
        told = modulus_of(found, kind)
        assert told["low"] < 9.0 < told["high"]


def test_the_likelihood_of_the_curves_has_their_evidence_under_their_prior(table: SigmaTable) -> None:
    """∫ L(E) p(E) dE over the modulus' prior is the evidence of the curves with the modulus free."""
    from underskin.diagnosis.data.dataset import lines as frf_lines
    from underskin.diagnosis.inference.explanation import FittingProblem
    from underskin.diagnosis.selection.other_kinds import Beside

    document = lines()
    document["recordings"] += curves("compression", BLOCK)
    campaign = parse(document)
    apart = of_curves(campaign, "compression", table, ())
    other = OtherKind("compression", apart, search(apart).explanations)
    problem = FittingProblem(frf_lines(campaign), table, Beside([other], ()))
    hypothesis = problem.hypothesis(("modulus_error",), placed=False)
    assert hypothesis.knowledge is not None
    factor = [entry.name for entry in hypothesis.model.parameters].index("modulus_factor")
    log_e = np.linspace(-1.0, 1.0, 4001)  # of the factor on the declared modulus
    fits = np.zeros((len(log_e), len(hypothesis.model.parameters)))
    fits[:, factor] = log_e
    log_likelihood = np.array([hypothesis.knowledge.log_density(fit) for fit in fits])
    told = other.told((), other.supported)
    middle = told.mean[0] - np.log(16e6)
    prior = np.exp(-0.5 * ((log_e - middle) / 1.5) ** 2) / (1.5 * np.sqrt(2 * np.pi))
    integral = np.log(np.trapezoid(np.exp(log_likelihood - log_likelihood.max()) * prior, log_e)) + log_likelihood.max()
    assert integral == pytest.approx(told.log_weight, abs=0.02)


@pytest.mark.parametrize("scales", first(1, [2.0, 0.0, 3.3]))
def test_the_likelihood_of_the_curves_counts_heavy_tailed_priors_once(scales: float, table: SigmaTable) -> None:
    """∫∫ L(E, w) p(E) p(w) dE dw is the evidence of the curves, however far w is from what its prior expects."""
    from underskin.diagnosis.data.dataset import lines as frf_lines
    from underskin.diagnosis.inference.explanation import FittingProblem
    from underskin.diagnosis.selection.other_kinds import Beside

    document = lines()
    document["recordings"] += curves("indentation", SPHERE, effects={"adhesion": {"work_j_per_m2": 1.0}})
    campaign = parse(document)
    apart = of_curves(campaign, "indentation", table, ())
    other = OtherKind("indentation", apart, search(apart).explanations)
    (prior,) = (entry for entry in CATALOGUE["adhesion"].parameters(campaign) if entry.name == "work_of_adhesion")
    assert isinstance(prior.prior, HeavyTailed)
    told = other.told(("adhesion",), other.supported)
    mean = np.array([told.mean[0], prior.prior.mean + scales * prior.prior.sd, *told.mean[2:]])
    other.found[frozenset({"adhesion"})] = replace(told, mean=mean)
    problem = FittingProblem(frf_lines(campaign), table, Beside([other], ()))
    hypothesis = problem.hypothesis(("modulus_error", "adhesion"), placed=False)
    assert hypothesis.knowledge is not None
    names = [entry.name for entry in hypothesis.model.parameters]
    deviations = np.sqrt(np.diag(told.covariance)[:2] + np.array([told.tolerance**2, 0.0]))
    log_e, log_w = (mean[axis] + deviations[axis] * np.linspace(-8, 8, 81) for axis in (0, 1))
    log_density = np.empty((81, 81))
    for row, at in enumerate(log_e):
        for column, work in enumerate(log_w):
            fit = np.zeros(len(names))
            fit[[names.index("modulus_factor"), names.index("work_of_adhesion")]] = at - np.log(16e6), work
            of_modulus = -0.5 * ((at - mean[0]) / 1.5) ** 2 - np.log(1.5 * np.sqrt(2 * np.pi))
            log_density[row, column] = hypothesis.knowledge.log_density(fit) + of_modulus + prior.log_prior(work)
    volume = (log_e[1] - log_e[0]) * (log_w[1] - log_w[0])
    assert np.logaddexp.reduce(log_density, axis=None) + np.log(volume) == pytest.approx(told.log_weight, abs=0.1)
