"""Random experiments: like a lab's, the same for the same seed, and what they hide is as asked."""

import json
from collections import Counter

import numpy as np
import pytest

from bench.soak import SOAK
from rig.description import parse
from rig.draw import CATALOGUED, UNKNOWN, drawn, record
from rig.draw_curves import drawn_curves
from rig.draw_raw import CATALOGUED as RAW
from rig.draw_raw import effect_names, raw_description
from rig.effects import EFFECTS, INDENTATION, UNCATALOGUED
from rig.elastomer import campaign_of_curves
from rig.recorded import campaign
from rig.truth import truth_of_curves, truth_of_lines
from underskin.recordings import campaign as campaigns


def test_the_same_seed_and_number_give_the_same_campaign() -> None:
    assert drawn(1, 2) == drawn(1, 2)
    assert drawn(1, 2) != drawn(1, 3)
    assert campaign(record(drawn(1, 2))) == campaign(record(drawn(1, 2)))


@pytest.mark.parametrize(("what", "count"), [("none", 0), ("single", 1), ("pair", 2), ("unknown", 1)])
def test_what_is_hidden_is_as_asked(what: str, count: int) -> None:
    for number in range(6):
        names = set(drawn(3, number, what)["effects"])
        assert len(names) == count
        assert names <= set(UNKNOWN if what == "unknown" else CATALOGUED)


@pytest.mark.slow
def test_all_effects_of_the_kind_are_drawn() -> None:
    seen = Counter(name for number in range(150) for name in drawn(5, number, "single")["effects"])
    assert set(seen) == set(CATALOGUED)
    assert set(CATALOGUED) == {name for name, effect in EFFECTS.items() if "frf" in effect.kinds} - {
        "amplifier_low_pass"
    }
    assert len(UNKNOWN) >= 5
    assert not set(UNKNOWN) & set(EFFECTS)


@pytest.mark.slow
def test_draws_are_campaigns_within_the_tables_and_their_truth_says_what_shows() -> None:
    shows = []
    for number in range(8):
        recorded = record(drawn(7, number))
        kept = campaigns.parse(campaign(recorded))
        truth = truth_of_lines(recorded)
        assert 1 <= len(kept.recordings) <= 110
        skin, plan = recorded.response.experiment.skin, recorded.response.plan
        radius = np.cbrt(0.5625 * plan.preload_n * plan.indenter_mm / skin.youngs_modulus_mpa)
        assert radius.max() / skin.thickness_mm < 2
        if not truth["effects"]:
            assert truth["identifiable"]
            assert abs(truth["chi2_gain_of_truth"]) < 1e-6 + 20 * bool(recorded.response.missed_mm.any())
        shows.append(truth["identifiable"])
        if "unknown" in truth["effects"]:
            assert set(truth["parameters"]) <= set(UNCATALOGUED)
    assert sum(shows) > 4


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [("indentation", 4), ("compression", 8)])
def test_curves_are_drawn_too(kind: str, count: int) -> None:
    for number in range(count):
        experiment, curves = drawn_curves(2, number, kind)
        assert number or drawn_curves(2, number, kind)[0] == experiment
        kept = campaigns.parse(campaign_of_curves(experiment, curves))
        assert len(kept.recordings) == len(curves)
        assert set(truth_of_curves(experiment, curves)) >= {"effects", "parameters", "identifiable"}


@pytest.mark.parametrize(("what", "count"), [("none", 0), ("single", 1), ("pair", 2), ("unknown", 1)])
def test_raw_curves_hide_what_is_asked_on_both_scales(what: str, count: int) -> None:
    radii = []
    for number in range(8):
        random = np.random.default_rng([9, number])
        experiment = parse(raw_description(random, "x", effect_names(random, what)))
        assert len(experiment.effects) == count
        assert set(experiment.effects) <= set(UNCATALOGUED if what == "unknown" else EFFECTS)
        assert experiment.curves is not None
        assert experiment.curves.units_checked == (max(experiment.curves.indenters_mm) < 0.5)
        radii.append(max(experiment.curves.indenters_mm))
    assert min(radii) < 0.1 < 1 < max(radii)


def test_every_effect_of_raw_curves_is_drawn() -> None:
    random = np.random.default_rng(4)
    seen = {
        what: {name for _ in range(120) for name in effect_names(random, what)}
        for what in ("single", "pair", "unknown")
    }
    assert seen["single"] == set(RAW)
    assert seen["pair"] == {*RAW, "compressible_layer"}
    assert seen["unknown"] == {name for name, effect in UNCATALOGUED.items() if "indentation" in effect.kinds}
    assert len(seen["unknown"]) >= 6


@pytest.mark.slow
def test_quiet_raw_curves_show_nothing() -> None:
    for number in range(2 if SOAK else 1):
        truth = truth_of_curves(*drawn_curves(2, number, "indentation", "none"))
        assert truth["identifiable"]
        assert abs(truth["chi2_gain_of_truth"]) < 20


@pytest.mark.soak
def test_what_shows_is_told_although_a_fit_goes_astray() -> None:
    """On its way the base model's fit of this pair tries contacts wider than the rig has solved."""
    truth = truth_of_curves(*drawn_curves(31001, 5, INDENTATION, "pair"))
    assert truth["identifiable"]
    assert np.isfinite(truth["chi2_gain_of_truth"])


@pytest.mark.soak
def test_an_effect_is_visible_without_which_the_others_have_no_fit() -> None:
    """Without the stage that gives, a body that stiffens to infinity has no force at the recorded depth."""
    truth = truth_of_curves(*drawn_curves(36036, 45, INDENTATION, "pair"))
    assert set(truth["effects"]) == {"instrument_compliance", "strain_stiffening"}
    assert truth["every_effect_identifiable"]
    assert truth["chi2_gain_of_each"]["instrument_compliance"] is None
    json.dumps(truth["chi2_gain_of_each"], allow_nan=False)
