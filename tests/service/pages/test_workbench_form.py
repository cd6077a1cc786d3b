"""Derived channels, zero and trim as a form has them, and what of a rig description is an instrument's."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import create_autospec

import numpy as np
import pytest

from service.ingest.instruments import recognised, template_of, with_skin
from service.pages.upload import page, templates
from service.pages.upload.file_summary import FileSummary, may_state
from service.pages.upload.mapping import document_of
from service.pages.upload.pending_uploads import PendingUpload
from service.pages.upload.workbench import rows
from service.store import Database, Missing
from tests.support.raw_curves import rig_of_raw_curve
from underskin.recordings import rig_description
from underskin.recordings.channels import Block, Channel, Contents


def form_of(document: dict[str, Any], **changes: str) -> dict[str, str]:
    """What a browser sends of the part of the form that makes curves."""
    form = {"kind": document["kind"], "units_checked": "yes", "poisson_ratio": "0.5", "indenter_radius_mm": "0.0075"}
    for number, (name, formula, field) in enumerate(rows(document)):
        told = {"name": name, "formula": formula, "is": field}
        form |= {f"derived-{part}-{number}": text for part, text in told.items()}
    form |= {f"tare-{name}": f"{how.get('tare_percent', '')}" for name, how in document["channels"].items()}
    form |= {name: f"{value}" for name, value in document.get("trim", {}).items()}
    return form | changes


def test_form_nobody_changed_says() -> None:
    """A form that nobody changed says the same."""
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


def test_derived_channel_takes_place_table_names() -> None:
    """A derived channel takes the place of the one that the table names."""
    raw = {"channel-0": "Piezo", "is-0": "displacement_mm", "channel-1": "Bend", "is-1": "deflection", "travel": "yes"}
    made = {"derived-formula-0": "-Piezo - Bend", "derived-is-0": "displacement_mm", "spring_constant_n_per_m": "3"}
    document, wrong = document_of({"kind": "indentation"} | raw | made, {})
    assert wrong == []
    assert document["derived"] == {"derived displacement": "-Piezo - Bend"}
    assert document["channels"] == {
        "displacement_mm": {"channel": "derived displacement"},
        "force_n": {"channel": "Bend", "spring_constant_n_per_m": 3.0},
    }


def test_an_emptied_row_is_taken_out() -> None:
    document = rig_of_raw_curve()
    emptied = {"derived-name-0": "", "derived-formula-0": "", "tare-force_n": ""}
    found, _ = document_of(form_of(document, **emptied), document)
    assert list(found["derived"]) == ["depth", "load"]
    assert found["channels"]["force_n"] == {"channel": "load"}


@pytest.mark.parametrize("number", ["007", "9" * 4301, "\u0663", "-1"], ids=["zeros", "long", "digits", "sign"])
def test_name_page_not_write_no_row(number: str) -> None:
    """A name that the page does not write is no row."""
    document = rig_of_raw_curve()
    forged = {f"derived-formula-{number}": "5 * 'Piezo'", f"derived-is-{number}": "force_n"}
    found, wrong = document_of(form_of(document, **forged), document)
    assert (found, wrong) == document_of(form_of(document), document)
    assert wrong == []


def test_two_derived_channels_name_field_refused() -> None:
    """Two derived channels of one name or for one field are refused and kept."""
    document = rig_of_raw_curve()
    found, wrong = document_of(form_of(document, **{"derived-name-1": "load"}), document)
    assert [error.field for error in wrong] == ["derived.load"]
    assert [*found["derived"].values()] == [*document["derived"].values()]  # what was typed is there to be put right
    _, wrong = document_of(form_of(document, **{"derived-is-2": "displacement_mm"}), document)
    assert [error.field for error in wrong] == ["derived.load"]
    assert wrong[0].allowed == "depth is displacement already: one of the two is for other formulas"
    unnamed = {f"derived-name-{number}": "" for number in (1, 2)} | {"derived-is-2": "displacement_mm"}
    assert len(document_of(form_of(document, **unnamed), document)[1]) == 1


def test_template_turns_no_depth_composed() -> None:
    """A template turns no depth that is composed."""
    rig = rig_description.from_dict(rig_of_raw_curve())
    store = create_autospec(Database)
    store.read.return_value = SimpleNamespace(document=template_of(rig), kept_at="2026-11-01", kept_from=None)
    file = FileSummary("a.txt", "CSV", 0, (), (), (), (), (), None, instrument="of a microscope")
    pending = PendingUpload("id", "session", Path(), (), 0, 0.0, seen=[file], turned=True)
    templates.use(store, pending, {})
    assert pending.is_depth_composed
    assert not pending.turned
    exported = PendingUpload("id", "session", Path(), (), 0, 0.0)
    with pytest.raises(Missing, match="There is no template"):
        page.use_template_of(store, exported)


def test_template_holds_instrument_s_alone() -> None:
    """A template holds what is the instrument s alone."""
    skin = {"poisson_ratio": 0.5, "thickness_mm": 2}
    recording = {"indenter_radius_mm": 0.0075, "sensor": "s01", "recorded_at": {"property": "Date"}}
    rig = rig_description.from_dict(rig_of_raw_curve(skin=skin, recording=recording))
    template = json.loads(template_of(rig))
    assert template["skin"] == {}
    assert template["recording"] == {"indenter_radius_mm": 0.0075, "recorded_at": {"property": "Date"}}
    again = rig_description.from_dict(with_skin(template_of(rig), {"thickness_mm": 3}))
    assert again.skin == {"thickness_mm": 3}
    assert again.derived.keys() == rig.derived.keys()


def test_instrument_recognised_format_headings() -> None:
    """An instrument is recognised by format and headings."""

    def contents(*headings: tuple[str, str]) -> Contents:
        return Contents((Block("", tuple(Channel(name, unit, np.zeros(2)) for name, unit in headings)),))

    one = recognised("CSV", contents(("Piezo", "nm"), ("Deflection", "nm")))
    assert one == recognised("CSV", contents(("Deflection", "nm"), ("Piezo", "nm")))
    others = [
        recognised("TDMS", contents(("Piezo", "nm"), ("Deflection", "nm"))),
        recognised("CSV", contents(("Piezo", "um"), ("Deflection", "nm"))),
        recognised("CSV", contents(("Piezo", "nm"))),
    ]
    assert one not in others
    assert recognised("CSV", Contents(())) is None


def test_zero_curves_not_carried_over_frfs() -> None:
    """A zero of curves is not carried over to frfs."""
    base = rig_of_raw_curve()
    form = form_of(base)
    assert document_of(form, base)[0]["channels"]["force_n"]["tare_percent"] == 10
    assert "tare_percent" not in document_of(form | {"kind": "frf"}, base)[0]["channels"]["force_n"]
    assert document_of(form | {"kind": "frf", "tare-force_n": "5"}, base)[0]["channels"]["force_n"]["tare_percent"] == 5


def test_typed_value_counts_property() -> None:
    """A typed value counts for more than a property that is still chosen."""
    form = {"kind": "indentation", "indenter_radius_mm": "2", "indenter_radius_mm-from": "Tip radius [mm]"}
    assert document_of(form, {})[0]["recording"]["indenter_radius_mm"] == 2
    assert document_of(form | {"indenter_radius_mm": " "}, {})[0]["recording"]["indenter_radius_mm"] == {
        "property": "Tip radius [mm]"
    }


def test_property_no_file_not_offered() -> None:
    """A property that no file has is not offered."""
    lacking = FileSummary("a.txt", "text", 0, [], [], [], [], [], None)
    assert not may_state([lacking], "Tip radius [mm]")
    assert may_state([lacking, replace(lacking, properties={"Tip radius [mm]": 2.0})], "Tip radius [mm]")
    assert may_state([replace(lacking, recordings=1)], "Tip radius [mm]")
