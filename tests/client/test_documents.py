"""The typed answers of the client: the documents as they came, whole, and the classes those of the service's models."""

import dataclasses
import importlib
import inspect
import pkgutil
from typing import Any, get_type_hints

import orjson
import pytest
from pydantic import BaseModel

import service.schemas
from scripts.client_documents import ANSWERS as ANSWERS_OF_METHODS
from scripts.client_documents import FILE, source
from service.schemas.campaign_document import campaign_schemas
from tests.support.repository import ROOT
from underskin.client import documents
from underskin.client.document import Document, Sensor, Skin
from underskin.client.documents import (
    D33,
    CampaignDetail,
    CampaignResult,
    DesignAnswer,
    Diagnosis,
    DiagnosisEntry,
    FieldAnswer,
    History,
    MechanismEntry,
    ModelEntry,
    SkinDetail,
)

EXAMPLES = orjson.loads((ROOT / "service" / "routes" / "examples.json").read_bytes())
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


MODELS = {
    name: model
    for module in pkgutil.iter_modules(service.schemas.__path__, "service.schemas.")
    for name, model in vars(importlib.import_module(module.name)).items()
    if isinstance(model, type) and issubclass(model, BaseModel) and hasattr(documents, name)
}


def fields_of(kind: type[Document]) -> list[str]:
    """The names of a document's fields."""
    return [entry.name for entry in dataclasses.fields(kind) if entry.name != "document"]


def test_classes_are_written_from_the_models_as_they_are() -> None:
    """`make test` writes them."""
    assert FILE.read_text(encoding="utf-8") == source()


@pytest.mark.parametrize("name", sorted(MODELS))
def test_class_has_its_models_fields(name: str) -> None:
    """Every class is documented, and its fields are those of the service's model, with types that can be resolved."""
    kind, model = getattr(documents, name), MODELS[name]
    assert inspect.getdoc(kind) == inspect.getdoc(model)
    assert fields_of(kind) == [entry.alias or name for name, entry in model.model_fields.items()]
    assert set(get_type_hints(kind)) >= set(fields_of(kind))


def test_every_answer_has_a_model() -> None:
    assert set(MODELS) >= set(ANSWERS_OF_METHODS)
    assert len(MODELS) > 50


@pytest.mark.parametrize("kind", [Skin, Sensor])
def test_declared_skin_has_the_fields_of_campaigns(kind: type[Document]) -> None:
    assert fields_of(kind) == [*campaign_schemas()[kind.__name__]["properties"]]


@pytest.mark.parametrize("operation", ANSWERS)
def test_an_answer_holds_all_that_came(operation: str) -> None:
    came = EXAMPLES[operation]["answer"]
    answer = ANSWERS[operation].from_json(came)
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
    diagnosis = Diagnosis.from_json(EXAMPLES["diagnosis"]["answer"])
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


def test_what_a_newer_or_an_older_server_answers_is_no_error() -> None:
    answer = MechanismEntry.from_json({"name": "adhesion", "own": False, "colour": "green"})
    assert (answer.name, answer["colour"], answer.package, answer.kinds) == ("adhesion", "green", None, ())
