"""A declared modulus that is wrong by a factor of 2 to 4, and contacts that it puts beyond the tables."""

from dataclasses import replace
from typing import Any

import pytest

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, lean_report
from underskin.recordings.campaign import Campaign, frf_recordings
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

FEW = beside("modulus_error", "thickness_error", "misalignment", "layered_contact", "strain_stiffening")
TRUE_MPA = 1.2
WIDE = Made(
    modulus_mpa=TRUE_MPA,
    thickness_mm=1.5,
    preloads_n=(0.25, 0.5, 1.0, 1.9),
    spheres_mm=(4.0, 8.0),
    offsets_mm=(0.0, 1.0),  # which tell a wrong place from a wrong modulus
)


@pytest.fixture(scope="module")
def made(table: SigmaTable) -> Campaign:
    return campaign(WIDE, table)


def declared(made: Campaign, modulus_mpa: float) -> Campaign:
    return replace(made, skin=replace(made.skin, youngs_modulus_mpa=modulus_mpa))


@pytest.fixture(scope="module")
def too_small(made: Campaign, table: SigmaTable) -> dict[str, Any]:
    """The report where 3.3 times too little is declared."""
    return lean_report(declared(made, TRUE_MPA / 3.3), table, *FEW)


def stated(report: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = (entry for one in report["mechanisms"] for entry in one["parameters"] if entry["name"] == name)
    return dict(found)


def codes(report: dict[str, Any]) -> list[str]:
    return [entry["code"] for entry in report["findings"]]


@pytest.mark.parametrize("factor", first(1, [3.3, 0.4]))
def test_a_factor_beyond_two_is_named_and_found(
    factor: float, too_small: dict[str, Any], made: Campaign, table: SigmaTable
) -> None:
    report = too_small if factor == 3.3 else lean_report(declared(made, TRUE_MPA / factor), table, *FEW)
    assert "modulus_error" in {entry["name"] for entry in report["mechanisms"]}
    found = stated(report, "modulus_factor")
    assert found["low"] <= factor <= found["high"]
    assert found["value"] == pytest.approx(factor, rel=0.1)


def test_contacts_kept_are_told(made: Campaign, too_small: dict[str, Any]) -> None:
    """L = F/(R²E) of 1.9 N on 4 mm is 0.1 at 1.2 MPa, the tables' end; at a quarter of that 0.4."""
    loads = [one.preload_n / (one.indenter_radius_mm**2 * TRUE_MPA / 3.3) for one in frf_recordings(made)]
    assert sum(load > 0.1 for load in loads) == 8
    report = too_small
    (kept,) = (entry for entry in report["findings"] if entry["code"] == "contacts_kept")
    assert "out_of_domain" not in codes(report)
    assert "8 of 32 contacts lie beyond the tables" in kept["statement"]
    assert kept["statement"][1:] in report["statement"]


def test_campaign_no_contact_lies(table: SigmaTable) -> None:
    """A campaign of which no contact lies within by the declared modulus is kept where a larger one leads."""
    hard = campaign(replace(WIDE, preloads_n=(1.0, 1.25, 1.5, 1.8), spheres_mm=(4.0,), repeats=2), table)
    report = lean_report(declared(hard, TRUE_MPA / 3.3), table, *FEW)
    assert report["verdict"] == "ambiguous"
    rivals = [entry["mechanisms"] for entry in report["alternatives"] if entry["probability"] > 0.1]
    assert ["modulus_error"] in [[entry["name"] for entry in report["mechanisms"]], *rivals]
    assert "contacts_kept" in codes(report)


def test_where_the_modulus_is_right_contacts_beyond_the_tables_are_left_out(table: SigmaTable) -> None:
    """L up to 0.17, as declared: no answer that stands brings these within."""
    made = campaign(replace(WIDE, preloads_n=(0.25, 0.5, 1.0, 3.2)), table)
    report = lean_report(made, table, *FEW)
    assert report["verdict"] == "no_mismatch"
    left_out = [entry["statement"] for entry in report["findings"] if entry["code"] == "out_of_domain"]
    assert len(left_out) == 4
    assert all("a modulus that is declared too small is not ruled out" in statement for statement in left_out)
    assert "a modulus that is declared too small is not ruled out" in report["statement"]
    assert "contacts_kept" not in codes(report)


def test_a_layered_contact_keeps_what_hertz_puts_beyond_the_tables(table: SigmaTable) -> None:
    """Hertz' a/h of 4.4 N under 16 mm is 3.2 here; the layer's own contact is narrower."""
    layered = Made(
        mechanisms=("layered_contact",),
        modulus_mpa=1.2,
        thickness_mm=1.0,
        sensor_radius_mm=0.7,
        preloads_n=(0.5, 1.5, 3.0, 4.4),
        spheres_mm=(8.0, 16.0),
        offsets_mm=(0.0, 0.6),
    )
    report = lean_report(campaign(layered, table), table, *FEW)
    assert {entry["name"] for entry in report["mechanisms"]} == {"layered_contact"}
    (kept,) = (entry["statement"] for entry in report["findings"] if entry["code"] == "contacts_kept")
    assert "4 of 32 contacts" in kept
    assert "with the values found for layered contact" in kept
