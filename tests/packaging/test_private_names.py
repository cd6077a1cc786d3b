"""Tests, benchmarks and documents use public names: none is taken from outside its module or class."""

import ast
from collections.abc import Iterator

import pytest

from tests.support.repository import ROOT

FOLDERS = ("tests", "bench", "docs", "examples")


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def private_names(tree: ast.Module) -> Iterator[str]:
    """Where a module imports, reads or replaces a private name that is not its own."""
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module=module, names=names):
                path = [*(module or "").split("."), *(alias.name for alias in names)]
                yield from (f"line {node.lineno}: import of {name}" for name in path if is_private(name))
            case ast.Import(names=names):
                path = [part for alias in names for part in alias.name.split(".")]
                yield from (f"line {node.lineno}: import of {name}" for name in path if is_private(name))
            case ast.Attribute(value=owner, attr=name) if is_private(name):
                if not (isinstance(owner, ast.Name) and owner.id in ("self", "cls")):
                    yield f"line {node.lineno}: {ast.unparse(node)}"
            case ast.Call(func=function, args=[target, ast.Constant(value=str(name)), *_]) if is_private(name):
                if ast.unparse(function) in ("getattr", "setattr", "monkeypatch.setattr", "monkeypatch.delattr"):
                    yield f"line {node.lineno}: {name} of {ast.unparse(target)}"
            case ast.Call(func=ast.Attribute(attr="setattr"), args=[ast.Constant(value=str(path)), *_]):
                yield from (f"line {node.lineno}: {path}" for name in path.split(".") if is_private(name))


@pytest.mark.slow
@pytest.mark.parametrize("folder", FOLDERS)
def test_no_private_name_is_used(folder: str) -> None:
    uses = {
        str(source.relative_to(ROOT)): list(private_names(ast.parse(source.read_text(encoding="utf-8"))))
        for source in (ROOT / folder).rglob("*.py")
    }
    assert {source: names for source, names in uses.items() if names} == {}
