"""Reports of several campaigns, and of fleets, say why their d33 is not to be quoted, and of what one may be."""

from dataclasses import replace
from typing import Any

import pytest

from tests.support.lean_reports import lean_fleet, lean_together
from tests.support.skins import made
from underskin.diagnosis.reporting.html_report import page
from underskin.diagnosis.reporting.stated_d33 import StatedD33
from underskin.diagnosis.several import quoted
from underskin.diagnosis.validation.hidden_shift import HiddenShift
from underskin.surrogate.sigma_table import SigmaTable

INTERVAL = {"unit": "pC/N", "value": 14.0, "low": 13.5, "high": 14.5}
QUOTABLE = StatedD33({**INTERVAL, "quotable": True})
OPEN = StatedD33({**INTERVAL, "quotable": False}, why_not=["several answers remain", "noise alone is 25 % of it"])
HIDDEN = StatedD33({**INTERVAL, "quotable": False}, hidden=[HiddenShift("thickness_error", -0.1, declared=True)])


@pytest.fixture(scope="module")
def together(table: SigmaTable) -> dict[str, Any]:
    return lean_together([made("may"), made("september", "2017-09-12T09:00:00Z", seed=8)], table, "both")


def test_that_of_several_campaigns_is_of_the_last_alone(together: dict[str, Any]) -> None:
    assert not together["d33"]["quotable"]
    *_, last = together["statement"].split(". ")
    assert last.startswith("d33 here is by the recordings of september alone, and not to be quoted for all campaigns")
    assert f"{together['d33']['low']:.3g} to {together['d33']['high']:.3g}" in last
    shown = page(together)
    assert "of the last campaign alone" in shown
    assert "several answers remain, or PVDF" not in shown


def test_a_report_of_several_campaigns_without_a_d33_has_a_page(together: dict[str, Any]) -> None:
    without = {**together, "d33": {"quotable": False, "per_sensor": together["d33"]["per_sensor"]}}
    assert "No d33 of several campaigns is quoted" in page(without)


def test_why_the_last_campaigns_own_is_not_to_be_quoted_is_said() -> None:
    assert quoted.of_campaigns("june", QUOTABLE).endswith("for all campaigns: 14 pC/N (95 %: 13.5 to 14.5)")
    assert quoted.of_campaigns("june", OPEN).endswith(
        ", nor for june itself: "
        "it lies from 13.5 to 14.5 pC/N over the answers that remain, and noise alone is 25 % of it"
    )
    assert quoted.of_campaigns("june", HIDDEN).endswith(
        "it lies from 13.5 to 14.5 pC/N, but what would not show here would change it, thickness error by 9.5 %"
    )
    assert "no answer explains the recordings" in quoted.of_campaigns("june", StatedD33(None))


def test_a_wrong_declared_number_that_would_not_show_is_told_with_its_campaign() -> None:
    (entry,) = quoted.not_identifiable({"may": QUOTABLE, "june": HIDDEN})
    assert (entry["mechanism"], entry["confounded_with"]) == ("thickness_error", "d33")
    assert entry["reason"].startswith("june alone: ")
    assert entry["reason"].endswith("d33 would then be 9.5 % too small")


def test_of_a_fleet_it_is_told_of_which_skins_it_may_be_quoted_and_why_of_others_not() -> None:
    each = {"a": QUOTABLE, "b": OPEN, "c": HIDDEN, "d": HIDDEN, "e": StatedD33(None)}
    said = quoted.of_skins(14.2, "pC/N", each, {})
    assert "14.2 pC/N is the mean of the skins and no skin's own" in said
    assert "it may be quoted of a, not of b (several answers remain and noise alone is 25 % of it), " in said
    assert "not of c and d (thickness error would change it without showing)" in said
    assert said.endswith("not of e (no answer explains its recordings)")
    many = quoted.of_skins(14.2, "pC/N", {f"s{number}": QUOTABLE for number in range(9)}, {})
    assert many.endswith("it may be quoted of s0, s1, s2 and 6 more")
    assert quoted.of_skins(14.2, "pC/N", {"b": OPEN}, {}).endswith(
        "it may be quoted of none, not of b (several answers remain and noise alone is 25 % of it)"
    )


def test_a_skin_in_which_the_fleet_finds_more_than_its_own_diagnosis_is_not_quoted() -> None:
    said = quoted.of_skins(14.2, "pC/N", {"a": QUOTABLE, "b": QUOTABLE}, {"b": ["thickness_error"]})
    assert said.endswith("it may be quoted of a, not of b (its own diagnosis lacks thickness error)")


@pytest.mark.slow
@pytest.mark.usefixtures("skins_diagnosed_once")
def test_of_a_skin_of_two_recordings_alone_no_d33_is_quoted(table: SigmaTable) -> None:
    skins = {f"skin-{number}": [made(f"c{number}", seed=20 + number)] for number in range(3)}
    whole = made("few", seed=60)
    fleet = lean_fleet(skins | {"few": [replace(whole, recordings=whole.recordings[:2])]}, table, "batch")
    assert "not of few (its recordings say too little)" in fleet["statement"]


@pytest.mark.slow
@pytest.mark.usefixtures("skins_diagnosed_once")
def test_the_statement_of_a_fleet_ends_with_it_and_names_quantities_in_words(table: SigmaTable) -> None:
    skins = {f"skin-{number}": [made(f"c{number}", seed=20 + number)] for number in range(3)}
    fleet = lean_fleet(skins | {"soft": [made("soft", seed=40, modulus=6.0)]}, table, "batch")
    assert "One departs, soft, in Young's modulus: " in fleet["statement"]
    assert "youngs modulus" not in fleet["statement"]
    assert fleet["statement"].split(". ")[-1].startswith("d33 is not to be quoted, because ")
    shown = page(fleet)
    assert "<td>Young&#39;s modulus</td>" in shown
    assert "youngs modulus" not in shown
    assert "no skin&#39;s own" in shown
