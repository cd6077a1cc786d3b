"""Write the typed answers of the client, `underskin/client/documents.py`, from the service's models of them.

The library must not import the service, so that it has classes of its own. Hatchling runs this as a hook before it
installs or packs the library, and make where a model has changed; `python -m scripts.client_documents` runs it by
hand. The models are read as source, so that nothing of what they import has to be installed.
"""

import ast
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parents[1]
FILE = ROOT / "underskin" / "client" / "documents.py"
# The answers of the client's methods; the models that these refer to are written with them.
ANSWERS = (
    *("CampaignResult", "CampaignEntry", "CampaignDetail", "D33", "SkinEntry", "SkinDetail", "History", "Change"),
    *("Imported", "Asked", "DiagnosisEntry", "Diagnosis", "ModelEntry", "ModelVersion", "MechanismEntry"),
    *("DesignAnswer", "FieldAnswer", "TableEntry"),
)
_HEAD = '''"""What the service answers, as typed documents; scripts/client_documents.py writes this module."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from underskin.client.document import Document, Skin
from underskin.surrogate.sigma_table import ContactName
'''
_DATACLASS = ast.parse("dataclass(frozen=True, eq=False, kw_only=True)", mode="eval").body
_NAMES = {"BaseModel": "Document", "dict": "Mapping", "ErrorCode": "str", "FindingCode": "str"}


class _Hint(ast.NodeTransformer):
    """Turns types of a model into those of the client; `aliases`: what names stand for in the model's module."""

    def __init__(self, aliases: dict[str, ast.expr]) -> None:
        self._aliases = aliases

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """A name; codes are texts, since a newer server may have more of them."""
        return self._aliases.get(node.id, ast.Name(_NAMES.get(node.id, node.id)))

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """A list becomes a tuple, and an annotated mapping the model that describes it."""
        match node:
            case ast.Subscript(ast.Name("list"), entry):
                return ast.Subscript(ast.Name("tuple"), ast.Tuple([self.visit(entry), ast.Constant(...)]))
            case ast.Subscript(ast.Name("Annotated"), ast.Tuple([_, ast.Call(ast.Name("DescribedBy"), [model])])):
                return model
            case ast.Subscript(ast.Name("Annotated"), ast.Tuple([_, ast.Call(ast.Name("WithJsonSchema"), [schema])])):
                return ast.Name(ast.literal_eval(schema)["allOf"][0]["$ref"].rsplit("/", 1)[1])
        return self.generic_visit(node)


def source() -> str:
    """The source of the module."""
    files = sorted((ROOT / "service" / "schemas").glob("*.py"))
    modules = [ast.parse(file.read_text(encoding="utf-8")).body for file in files]
    imported = {name: value for module in modules for name, value in _aliases(module).items()}
    models = {
        statement.name: (statement, _Hint(imported | _aliases(module)))
        for module in modules
        for statement in module
        if isinstance(statement, ast.ClassDef)
    }
    classes: dict[str, ast.ClassDef] = {}  # each behind those that it refers to

    def write(name: str) -> None:
        if name in models and name not in classes:
            written = _class(*models[name])
            for node in ast.walk(written):
                if isinstance(node, ast.Name):
                    write(node.id)
            classes[name] = written

    for name in ANSWERS:
        write(name)
    return "\n\n\n".join([_HEAD, *map(ast.unparse, classes.values())]) + "\n"


def _aliases(module: list[ast.stmt]) -> dict[str, ast.expr]:
    """The names of a module that stand for a choice of words, each with the choice."""
    aliases: dict[str, ast.expr] = {}
    for statement in module:
        match statement:
            case ast.Assign([ast.Name(name)], ast.Subscript(ast.Name("Literal")) as choice):
                aliases[name] = choice
    return aliases


def _class(model: ast.ClassDef, hint: _Hint) -> ast.ClassDef:
    """The class of the client for a model, each field with its description."""
    body: list[ast.stmt] = [ast.Expr(ast.Constant(ast.get_docstring(model)))]
    for statement in model.body:
        if isinstance(statement, ast.AnnAssign):
            body += _field(statement, hint)
    bases = [hint.visit(base) for base in model.bases]
    return ast.ClassDef(model.name, bases, [], body, [_DATACLASS])


def _field(statement: ast.AnnAssign, hint: _Hint) -> list[ast.stmt]:
    """A field and its description; None where an older server does not answer it."""
    assert isinstance(statement.value, ast.Call)
    options = {keyword.arg: keyword.value for keyword in statement.value.keywords}
    kind = hint.visit(statement.annotation)
    if "default" in options and not ast.unparse(kind).endswith("| None"):
        kind = ast.BinOp(kind, ast.BitOr(), ast.Constant(None))
    name = ast.Name(ast.literal_eval(options["alias"])) if "alias" in options else statement.target
    return [ast.AnnAssign(name, kind, None, simple=1), ast.Expr(options["description"])]


def write() -> None:
    """Write the module, where it differs from what is there."""
    written = source()
    if not FILE.exists() or FILE.read_text(encoding="utf-8") != written:
        FILE.write_text(written, encoding="utf-8")


class ClientDocuments(BuildHookInterface[Any]):
    """Writes the module before the library is installed or packed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Called by Hatchling."""
        write()


if __name__ == "__main__":
    write()
