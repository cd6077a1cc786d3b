"""Write the typed answers of the client, `underskin/client/documents`, from the models of the service's answers.

`python -m scripts.client_documents`; the library must not import the service, so that it has classes of its own.
"""

import subprocess
import sys
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from service.ingest.skin_imports import Imported
from service.schemas.campaign_d33 import D33
from service.schemas.campaign_document import campaign_schemas
from service.schemas.campaigns import CampaignDetail, CampaignEntry, CampaignResult
from service.schemas.changes import Change
from service.schemas.design import DesignAnswer
from service.schemas.diagnoses import Asked, Diagnosis, DiagnosisEntry, ModelEntry, ModelVersion
from service.schemas.field import FieldAnswer
from service.schemas.mechanisms import MechanismEntry
from service.schemas.skins import History, SkinDetail, SkinEntry
from underskin.client.documents.document import Document

FOLDER = Path(__file__).parents[1] / "underskin" / "client" / "documents"
_REF = "#/components/schemas/{model}"
_PACKAGE = "underskin.client.documents"
_ANSWERS: tuple[type[BaseModel], ...] = (
    *(CampaignResult, CampaignEntry, CampaignDetail, D33, SkinEntry, SkinDetail, History, Change, Imported),
    *(Asked, DiagnosisEntry, Diagnosis, ModelEntry, ModelVersion, MechanismEntry, DesignAnswer, FieldAnswer),
)
# Of each module of classes: what its answers are about. Its models are those of the module of this name in the service.
_MODULES = {
    "campaigns": "Campaigns: what became of them, and what they hold.",
    "campaign_d33": "d33 of a campaign's sensors, and the modulus of its elastomer.",
    "skins": "Skins, what was joined to them, and d33 over time.",
    "changes": "What was changed of campaigns and skins.",
    "skin_imports": "What an import of a skin brought.",
    "diagnoses": "Diagnoses and adopted models.",
    "report": "The report of a diagnosis (`report/1`).",
    "report_fit": "What a report says in numbers of its fit.",
    "report_several": "What a report says of several kinds of recordings, campaigns or skins.",
    "mechanisms": "The catalogue of mechanisms.",
    "design": "A skin before it is built.",
    "field": "The stress in the layer under a sphere.",
}
_PLAIN = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}


@dataclass
class _Module:
    """The source of one module, as far as it is written."""

    name: str
    classes: list[str] = field(default_factory=list)
    uses: set[str] = field(default_factory=set)  # classes of other modules


def sources() -> dict[str, str]:
    """The source of each module by its name, not yet formatted."""
    schemas, homes = _described()
    modules = {name: _Module(name) for name in _MODULES}
    for name in _in_order(schemas, homes):
        modules[homes[name]].classes.append(_class(name, schemas, homes, modules[homes[name]]))
    return {name: _source(module, homes) for name, module in modules.items()}


def formatted(source: str) -> str:
    """The source as ruff formats it, its unused imports removed."""
    ruff = [sys.executable, "-m", "ruff"]
    name = ["--stdin-filename", str(FOLDER / "written.py")]
    fix = [*ruff, "check", "--fix", "--quiet", "--exit-zero", *name]
    for command in (fix, [*ruff, "format", *name]):
        source = subprocess.run(command, input=source, capture_output=True, text=True, check=True).stdout
    return source


def _described() -> tuple[dict[str, Any], dict[str, str]]:
    """The schemas of the answers and their parts, and the module that each is in."""
    parts = campaign_schemas()
    schemas: dict[str, Any] = {name: parts[name] for name in ("Sensor", "Skin")}
    _, answers = models_json_schema([(answer, "serialization") for answer in _ANSWERS], ref_template=_REF)
    schemas |= answers["$defs"]
    homes = dict.fromkeys(("Sensor", "Skin"), "campaigns")
    for model in _models(BaseModel):
        if model.__name__ in schemas and model.__module__.startswith("service."):
            homes[model.__name__] = model.__module__.rsplit(".", 1)[1]
    return {name: schema for name, schema in schemas.items() if "enum" not in schema}, homes


def _models(kind: type[BaseModel]) -> list[type[BaseModel]]:
    return [model for subclass in kind.__subclasses__() for model in (subclass, *_models(subclass))]


def _in_order(schemas: Mapping[str, Any], homes: Mapping[str, str]) -> list[str]:
    """Each class behind those of its own module that it refers to."""
    order: list[str] = []

    def add(name: str) -> None:
        if name in order or name not in schemas:
            return
        for reference in _references(schemas[name]):
            if homes.get(reference) == homes[name]:
                add(reference)
        order.append(name)

    for name in schemas:
        add(name)
    return order


def _references(schema: Any) -> list[str]:
    if isinstance(schema, dict):
        references = [schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else []
        return references + [name for value in schema.values() for name in _references(value)]
    return [name for value in schema for name in _references(value)] if isinstance(schema, list) else []


def _class(name: str, schemas: Mapping[str, Any], homes: Mapping[str, str], module: _Module) -> str:
    schema = schemas[name]
    module.uses |= {
        reference for reference in _references(schema) if reference in schemas and homes[reference] != module.name
    }
    lines = [
        "@dataclass(frozen=True, eq=False, kw_only=True)",
        f"class {name}(Document):",
        f'    """{schema["description"]}"""',
    ]
    for member, property_schema in schema["properties"].items():
        if hasattr(Document, member):
            raise ValueError(f"{name}.{member}: is the name of something that every document has")
        hint = _hint(property_schema, schemas)
        if member not in schema.get("required", ()) and "None" not in hint.split(" | "):
            hint += " | None"
        description = property_schema.get("description") or schemas[_references(property_schema)[0]]["description"]
        lines += ["", f"    {member}: {hint}", *textwrap.wrap(f'"""{description}"""', 116, initial_indent=" " * 4,
                                                             subsequent_indent=" " * 4)]  # fmt: skip
    return "\n".join(lines)


def _hint(schema: Mapping[str, Any], schemas: Mapping[str, Any]) -> str:
    """The type of what a schema describes."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return name if name in schemas else "str"  # a code, of which newer servers may have more
    if "allOf" in schema:
        return _hint(schema["allOf"][0], schemas)
    if "anyOf" in schema:
        return " | ".join(dict.fromkeys(_hint(alternative, schemas) for alternative in schema["anyOf"]))
    if "const" in schema or "enum" in schema:
        return f"Literal[{', '.join(map(repr, schema.get('enum', [schema.get('const')])))}]"
    match schema.get("type"):
        case "array":
            return f"tuple[{_hint(schema['items'], schemas)}, ...]"
        case "object":
            entries = schema.get("additionalProperties")
            return f"Mapping[str, {_hint(entries, schemas) if isinstance(entries, dict) else 'Any'}]"
        case None:
            return "Any"
        case plain:
            return _PLAIN[plain]


def _source(module: _Module, homes: Mapping[str, str]) -> str:
    imports = [
        f"from {_PACKAGE}.{homes[name]} import {name}"
        for name in sorted(module.uses, key=lambda name: (homes[name], name))
    ]
    head = [
        f'"""{_MODULES[module.name]} Written by scripts/client_documents.py."""',
        "",
        "from collections.abc import Mapping",
        "from dataclasses import dataclass",
        "from typing import Any, Literal",
        "",
        f"from {_PACKAGE}.document import Document",
        *imports,
    ]
    return "\n".join(head) + "\n\n\n" + "\n\n\n".join(module.classes) + "\n"


if __name__ == "__main__":
    for module_name, source in sources().items():
        (FOLDER / f"{module_name}.py").write_text(formatted(source), encoding="utf-8")
