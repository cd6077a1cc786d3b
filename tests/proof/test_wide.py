"""Campaigns with wide tails, and the diagnosis under other priors: what is drawn, judged and put back."""

from contextlib import suppress

import pytest

from proof.cases import DrawnCase
from proof.coverage import held
from proof.other_priors import Priors, other_priors
from rig import strengths, wide_tails
from rig.draw import drawn
from rig.wide_tails import WIDE
from underskin.diagnosis.noise import GAIN_PRIOR
from underskin.diagnosis.selection.priors import PRIORS
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import parse


@pytest.mark.slow
def test_wide_tails_go_beyond_the_usual_ones_and_have_arrays_of_two() -> None:
    usual, wide = ([drawn(11, number, "none", tails) for number in range(80)] for tails in ("usual", WIDE))
    assert max(one["noise"]["gain"] for one in usual) <= 0.05 < max(one["noise"]["gain"] for one in wide) <= 0.08
    assert max(one["noise"]["position_mm"] for one in wide) > 0.4
    arrays = [one["skin"]["array"] for one in wide]
    assert 0.3 < sum(one["columns"] * one["rows"] == 2 for one in arrays) / len(arrays) < 0.6
    for name, ranges in strengths.of_frf(usual[0]).items():
        for parameter, (low, high) in ranges.items():
            lowest, highest = wide_tails.of_frf(usual[0])[name][parameter]
            assert lowest <= low < high <= highest


@pytest.mark.parametrize(("low", "high", "expected"), [(9.0, 11.0, True), (10.5, 11.0, False)])
def test_an_interval_holds_the_true_d33_or_does_not(low: float, high: float, expected: bool) -> None:
    case = DrawnCase(11, 3, "none", WIDE)
    true = case.description["skin"]["d33_pc_per_n"]
    stated = {"low": low * true / 10, "high": high * true / 10, "value": true, "quotable": True}
    entry = held(case, {"verdict": "no_mismatch", "mechanisms": [], "d33": stated})
    assert entry["held"] is expected
    assert entry["off"] == pytest.approx(0.0)
    assert held(case, {"verdict": "unexplained", "mechanisms": [], "d33": None})["held"] is None


def test_other_priors_last_as_long_as_their_context() -> None:
    campaign = parse(DrawnCase(11, 3, "none", WIDE).document())
    mechanism = CATALOGUE["thickness_error"]
    before = GAIN_PRIOR.row, dict(PRIORS), mechanism.parameters(campaign, "frf")
    with suppress(KeyError), other_priors(Priors(scatter=2.0, strengths=0.5, nothing=0.45)):
        assert GAIN_PRIOR.high - GAIN_PRIOR.middle == pytest.approx(2 * (before[0][1] - GAIN_PRIOR.middle))
        assert PRIORS["nothing_missing"] == 0.45
        assert sum(PRIORS.values()) == pytest.approx(sum(before[1].values()))
        (narrow,) = mechanism.parameters(campaign, "frf")
        assert narrow.quantile(0.75) == pytest.approx(before[2][0].quantile(0.75) / 2, rel=0.05)
        raise KeyError
    assert before == (GAIN_PRIOR.row, dict(PRIORS), mechanism.parameters(campaign, "frf"))
