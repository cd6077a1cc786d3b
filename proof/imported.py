"""Which modules of the library a diagnosis imports, directly or through others."""

import ast
from collections.abc import Collection, Mapping

_BEGUN = ("underskin.diagnosis.diagnose", "underskin.recordings.campaign", "underskin.surrogate.sigma_table")
_BY_NAME = "underskin.mechanisms."  # laws are found by the folder that they are in
# Of the package's own list of names, or where a file is read
_UNUSED = ("underskin.cli.", "underskin.client.", "underskin.figures.", "underskin.recordings.readers.")


def of_a_diagnosis(texts: Mapping[str, str]) -> dict[str, str]:
    """Those of the texts of modules by their dotted names, packages as `package.__init__`."""
    known = {name.removesuffix(".__init__"): name for name in texts}
    left = [name for name in known if name in _BEGUN or name.startswith(_BY_NAME)]
    found: set[str] = set()
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += [one for one in _imports(texts[known[name]], known) if one in known and _may_matter(one)]
    return {known[name]: texts[known[name]] for name in found}


def _may_matter(name: str) -> bool:
    return name != "underskin" and not name.startswith(_UNUSED)


def _imports(text: str, known: Collection[str]) -> set[str]:
    """Full names of what a module imports, anywhere in it: of a module that is `known`, not the package that it is
    in, whose own list of names would lead everywhere."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            each = [f"{node.module}.{one.name}" for one in node.names]
            names |= {one if one in known else node.module for one in each}
    return names
