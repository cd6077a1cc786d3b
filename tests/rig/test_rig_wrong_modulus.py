"""Campaigns whose declared modulus is wrong: the recordings are those of the true one."""

import numpy as np
import pytest

from bench.soak import SOAK
from rig.description import parse
from rig.recorded import record_lines
from rig.wrong_modulus import drawn_wrong_modulus, wrong_modulus


@pytest.mark.slow
def test_the_declared_modulus_is_wrong_by_a_factor_of_two_to_four() -> None:
    factors, kinds = [], set()
    for number in range(12):
        joint = wrong_modulus(3, number)
        (document,) = joint.documents
        factors.append(document.true_modulus_mpa / document.experiment.skin.youngs_modulus_mpa)
        kinds.add(joint.what)
        if document.curves is not None:
            assert document.curves.experiment.skin.youngs_modulus_mpa == pytest.approx(document.true_modulus_mpa)
    size = np.abs(np.log(factors))
    assert (size >= np.log(2) - 1e-9).all()
    assert (size <= np.log(4) + 1e-9).all()
    assert 0 < np.sum(np.log(factors) > 0) < len(factors)
    assert kinds == {"frf", "compression", "indentation"}


def test_the_lines_are_those_of_a_skin_of_the_true_modulus() -> None:
    joint = wrong_modulus(3, 1)
    document = joint.documents[0]
    described = dict(document.experiment.document)
    effects = {name: values for name, values in described["effects"].items() if name != "modulus_error"}
    skin = {**described["skin"], "youngs_modulus_mpa": document.true_modulus_mpa}
    right = record_lines(parse({**described, "skin": skin, "effects": effects}))
    np.testing.assert_allclose(document.lines.exact, right.exact, rtol=1e-9)


def test_the_truth_has_the_contacts_as_declared() -> None:
    """a³ = (3/4)(1 − ν²) F R/E at ν = 1/2, and L = F/(R²E)."""
    document, truth = drawn_wrong_modulus(3, 1)
    skin, first = document["skin"], document["recordings"][0]
    load = first["preload_n"] / (first["indenter_radius_mm"] ** 2 * skin["youngs_modulus_mpa"])
    cubed = 0.75**2 * first["preload_n"] * first["indenter_radius_mm"] / skin["youngs_modulus_mpa"]
    assert truth["as_declared"]["load_parameter"][0] == pytest.approx(load)
    assert (truth["as_declared"]["a_over_h"][0] * skin["thickness_mm"]) ** 3 == pytest.approx(cubed)
    assert truth["factor"] == pytest.approx(
        truth["documents"][0]["youngs_modulus_mpa"] / skin["youngs_modulus_mpa"], rel=1e-6
    )


@pytest.mark.slow
def test_some_contacts_are_computed_beyond_what_was_made() -> None:
    """By the declared E wider or harder pressed than the rig can calculate, and than the tables hold."""
    beyond = 0
    numbers = range(20) if SOAK else (0, 4, 5, 7)  # quickly drawn
    for number in numbers:
        _, truth = drawn_wrong_modulus(3, number)
        largest = max(truth["as_declared"]["load_parameter"])
        beyond += largest > 0.1
        assert largest / truth["factor"] <= 0.1 + 1e-9, number
    assert beyond > len(numbers) / 8
