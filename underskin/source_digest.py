"""A digest of what Python sources compute, independent of module names and documentation.

Results that take hours are reused as long as the code that made them computes the same. The digest covers the syntax
trees without docstrings, comments and layout; each module counts by its content, not by its name or folder. An
imported name stands for its origin: the content of a digested module, the full name in another package, the last
name in another module of this project. Any other change, also of the name of a function or a variable, changes the
digest.
"""

import ast
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_IMPORTS = (ast.Import, ast.ImportFrom)
_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def source_digest(sources: Mapping[str, str]) -> str:
    """SHA-256, in hexadecimal, of the texts of modules by their dotted names."""
    modules = {name: _Module.of(ast.parse(source)) for name, source in sources.items()}
    first = {name: module.digest(dict.fromkeys(modules, "module")) for name, module in modules.items()}
    digests = sorted(module.digest(first) for module in modules.values())
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


@dataclass(frozen=True)
class _Module:
    """A module's imports, and the texts of its other nodes, of a name the name itself and `True`."""

    imports: list[ast.Import | ast.ImportFrom]
    parts: list[tuple[str, bool]]

    @classmethod
    def of(cls, tree: ast.Module) -> "_Module":
        """Of its syntax tree, without docstrings."""
        imports: list[ast.Import | ast.ImportFrom] = []
        parts: list[tuple[str, bool]] = []
        for node in ast.walk(_without_docstrings(tree)):
            if isinstance(node, _IMPORTS):
                imports.append(node)
            elif isinstance(node, ast.Name):
                parts.append((node.id, True))
            elif not isinstance(node, ast.alias):
                parts.append((ast.dump(_bare(node), annotate_fields=False), False))
        return cls(imports, parts)

    def digest(self, identities: Mapping[str, str]) -> str:
        """The digest of the module, with identities for the modules that it may import."""
        meanings = _meanings(self.imports, identities)
        parts = [meanings.get(part, part) if is_name else part for part, is_name in self.parts]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree


def _bare(node: ast.AST) -> ast.AST:
    """A node with the types of its children in their positions; the children are digested separately."""
    fields: dict[str, Any] = {}
    for name, value in ast.iter_fields(node):
        if isinstance(value, ast.AST):
            fields[name] = type(value).__name__
        elif isinstance(value, list):
            elements = [element for element in value if not isinstance(element, _IMPORTS)]
            fields[name] = [type(element).__name__ if isinstance(element, ast.AST) else element for element in elements]
        else:
            fields[name] = value
    return type(node)(**fields)


def _meanings(imports: Sequence[ast.Import | ast.ImportFrom], identities: Mapping[str, str]) -> dict[str, str]:
    """The origin of each imported name."""
    local_packages = {name.partition(".")[0] for name in identities}
    meanings = {}
    for node in imports:
        if isinstance(node, ast.Import):
            for alias in node.names:
                bound = alias.asname or alias.name.partition(".")[0]
                meanings[bound] = f"<{identities.get(alias.name, alias.name if alias.asname else bound)}>"
        else:
            module = node.module or ""
            for alias in node.names:
                full_name = f"{module}.{alias.name}"
                if full_name in identities:
                    meaning = identities[full_name]
                elif module in identities:
                    meaning = f"{identities[module]}.{alias.name}"
                else:
                    meaning = alias.name if module.partition(".")[0] in local_packages else full_name
                meanings[alias.asname or alias.name] = f"<{meaning}>"
    return meanings
