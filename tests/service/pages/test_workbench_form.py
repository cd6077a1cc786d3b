"""Derived channels, zero and trim as a form has them, and what of a rig description is an instrument's."""

import json
from typing import Any

import pytest

from service.ingest.instruments import template_of, with_skin
from service.pages.upload.mapping import derived_rows, document_of
from tests.support.raw_curves import rig_of_raw_curve
from underskin.recordings import rig_description


def form_of(document: dict[str, Any], **changes: str) -> dict[str, str]:
    """What a browser sends of the part of the form that makes curves."""
    form = {"kind": document["kind"], "units_checked": "yes", "poisson_ratio": "0.5", "indenter_radius_mm": "0.0075"}
    for number, (name, formula, field) in enumerate(derived_rows(document)):
        told = {"name": name, "formula": formula, "is": field}
        form |= {f"derived-{part}-{number}": text for part, text in told.items()}
    form |= {f"tare-{name}": f"{how.get('tare_percent', '')}" for name, how in document["channels"].items()}
    form |= {name: f"{value}" for name, value in document.get("trim", {}).items()}
    return form | changes


def test_a_form_that_nobody_changed_says_the_same() -> None:
    document = rig_of_raw_curve(trim={"first_sample": 3, "last_sample": 90})
    found, wrong = document_of(form_of(document), document)
    assert wrong == []
    assert found == document
    assert (
        found
        == document_of(
            {"kind": "indentation", "units_checked": "yes", "poisson_ratio": "0.5"} | {"indenter_radius_mm": "0.0075"},
            document,
        )[0]
    )  # nor does a form without that part
    rig_description.from_dict(found)


@pytest.mark.parametrize("number", ["007", "9" * 4301, "\u0663", "-1"], ids=["zeros", "long", "digits", "sign"])
def test_a_name_that_the_page_does_not_write_is_no_row(number: str) -> None:
    document = rig_of_raw_curve()
    forged = {f"derived-formula-{number}": "5 * 'Piezo'", f"derived-is-{number}": "force_n"}
    found, wrong = document_of(form_of(document, **forged), document)
    assert (found, wrong) == document_of(form_of(document), document)
    assert wrong == []


def test_a_template_holds_what_is_the_instruments_alone() -> None:
    skin = {"poisson_ratio": 0.5, "thickness_mm": 2}
    recording = {"indenter_radius_mm": 0.0075, "sensor": "s01", "recorded_at": {"property": "Date"}}
    rig = rig_description.from_dict(rig_of_raw_curve(skin=skin, recording=recording))
    template = json.loads(template_of(rig))
    assert template["skin"] == {}
    assert template["recording"] == {"indenter_radius_mm": 0.0075, "recorded_at": {"property": "Date"}}
    again = rig_description.from_dict(with_skin(template_of(rig), {"thickness_mm": 3}))
    assert again.skin == {"thickness_mm": 3}
    assert again.derived.keys() == rig.derived.keys()


def test_a_typed_value_counts_for_more_than_a_property_that_is_still_chosen() -> None:
    form = {"kind": "indentation", "indenter_radius_mm": "2", "indenter_radius_mm-from": "Tip radius [mm]"}
    assert document_of(form, {})[0]["recording"]["indenter_radius_mm"] == 2
    assert document_of(form | {"indenter_radius_mm": " "}, {})[0]["recording"]["indenter_radius_mm"] == {
        "property": "Tip radius [mm]"
    }
