"""The typed answers of the client: the documents as they came, whole, and the classes those of the service's models."""

import dataclasses
import importlib
from pathlib import Path
from typing import Any, get_type_hints

import orjson
import pytest

from scripts.client_documents import FOLDER, formatted, sources
from scripts.openapi_examples import FILE
from underskin.client.documents.campaign_d33 import D33
from underskin.client.documents.campaigns import CampaignDetail, CampaignResult
from underskin.client.documents.design import DesignAnswer
from underskin.client.documents.diagnoses import Diagnosis, DiagnosisEntry, ModelEntry
from underskin.client.documents.document import Document
from underskin.client.documents.field import FieldAnswer
from underskin.client.documents.mechanisms import MechanismEntry
from underskin.client.documents.skins import History, SkinDetail

EXAMPLES = orjson.loads(FILE.read_bytes())
ANSWERS: dict[str, type[Document]] = {
    "post_campaigns": CampaignResult,
    "campaign": CampaignDetail,
    "campaign_d33": D33,
    "skin": SkinDetail,
    "skin_history": History,
    "diagnosis": Diagnosis,
    "cancel_diagnosis": DiagnosisEntry,
    "skin_model": ModelEntry,
    "keep_mechanism": MechanismEntry,
    "design": DesignAnswer,
    "field": FieldAnswer,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(sources()))
def test_classes_services_models(name: str) -> None:
    """The classes are those of the services models.

    Rerun scripts/client_documents.py where the service's models have changed.
    """
    assert (FOLDER / f"{name}.py").read_text() == formatted(sources()[name])


def test_no_other_classes_are_left() -> None:
    assert {file.stem for file in Path(FOLDER).glob("*.py")} == {*sources(), "__init__", "document"}


@pytest.mark.parametrize("operation", ANSWERS)
def test_an_answer_holds_all_that_came(operation: str) -> None:
    came = EXAMPLES[operation]["answer"]
    answer = ANSWERS[operation].of(came)
    assert dict(answer) == came
    assert plain(answer) == came


def plain(value: Any) -> Any:
    """What the attributes hold, as JSON has it."""
    if isinstance(value, Document):
        absent = {name for name in vars(value) if name not in value.document} - {"document"}
        assert all(getattr(value, name) is None for name in absent)
        return {name: plain(getattr(value, name)) for name in vars(value) if name not in {*absent, "document"}}
    if isinstance(value, tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    return value


def test_fields_have_types_that_editors_complete() -> None:
    diagnosis = Diagnosis.of(EXAMPLES["diagnosis"]["answer"])
    assert diagnosis.report is not None
    assert diagnosis.report.verdict == diagnosis.verdict == "explained"
    (mechanism,) = diagnosis.report.mechanisms
    mass = mechanism.parameters[0]
    assert (mechanism.name, mass.name, mass.unit) == ("contact_resonance", "tip_mass", "g")
    assert mass.low is not None
    assert mass.high is not None
    assert mass.low < 6.0 < mass.high  # what the rig had
    assert diagnosis.report.d33 is not None
    assert diagnosis.report["d33"]["value"] == diagnosis.report.d33.value


def test_every_class_resolved_documented() -> None:
    """Every class can be resolved and is documented."""
    seen = 0
    for name in sources():
        for kind in vars(importlib.import_module(f"underskin.client.documents.{name}")).values():
            if isinstance(kind, type) and issubclass(kind, Document):
                seen += 1
                assert kind.__doc__
                assert set(get_type_hints(kind)) >= {entry.name for entry in dataclasses.fields(kind)}
    assert seen > 50


def test_newer_older_server_answers_no_error() -> None:
    """What a newer or an older server answers is no error."""
    answer = MechanismEntry.of({"name": "adhesion", "own": False, "colour": "green"})
    assert (answer.name, answer["colour"], answer.package, answer.kinds) == ("adhesion", "green", None, ())


def test_documents_are_values() -> None:
    came = EXAMPLES["skin"]["answer"]
    answer = SkinDetail.of(came)
    assert answer == came
    assert answer == SkinDetail.of(came)
    with pytest.raises(dataclasses.FrozenInstanceError):
        answer.id = "other"  # type: ignore[misc]
