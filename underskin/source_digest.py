"""A digest of what Python sources compute, whatever they are called and however they are described.

Work that takes hours is kept as long as the code that made it computes the same. So the digest is of the syntax tree
without docstrings, comments and layout; a module counts by its content and not by its name or its place; names under
which a module knows other modules are numbered, and import statements left out: what is imported is in the digest by
its own source. Any other change, also of a name, makes another digest.
"""

import ast
import hashlib
from collections.abc import Iterable

_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def source_digest(sources: Iterable[str]) -> str:
    """SHA-256, in hexadecimal, of the texts of any number of modules, in any order."""
    digests = sorted(hashlib.sha256(_content(source).encode()).hexdigest() for source in sources)
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _content(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return ast.dump(_WithoutPlaces().visit(tree), annotate_fields=False)


class _WithoutPlaces(ast.NodeTransformer):
    """Without import statements, and with numbers for the names of modules that attributes are taken from."""

    def __init__(self) -> None:
        self._imported: dict[str, str] = {}

    def visit_Import(self, node: ast.Import) -> ast.stmt:
        """`import a.b` binds a; `import a as b` binds b."""
        self._note(alias.asname or alias.name.partition(".")[0] for alias in node.names)
        return ast.Pass()

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.stmt:
        """What it binds may be modules."""
        self._note(alias.asname or alias.name for alias in node.names)
        return ast.Pass()

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """`module.name`, the module numbered in the order of the first use."""
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id in self._imported:
            node.value.id = self._numbered(node.value.id)
        return node

    def _note(self, names: Iterable[str]) -> None:
        for name in names:
            self._imported.setdefault(name, "")

    def _numbered(self, name: str) -> str:
        if not self._imported[name]:
            self._imported[name] = f"<module {sum(map(bool, self._imported.values()))}>"
        return self._imported[name]
