"""Which modules of the library a diagnosis imports, directly or through others."""

import ast
from collections.abc import Collection, Mapping

_ROOTS = ("underskin.diagnosis.diagnose", "underskin.recordings.campaign", "underskin.surrogate.sigma_table")
_BY_NAME = "underskin.mechanisms."  # laws are found by the folder that they are in
# Of the package's own list of names, or where a file is read
_UNUSED = ("underskin.cli.", "underskin.client.", "underskin.figures.", "underskin.recordings.readers.")


def of_a_diagnosis(texts: Mapping[str, str]) -> dict[str, str]:
    """The subset of modules that a diagnosis needs, from texts by dotted name; packages as `package.__init__`."""
    file_of_module = {name.removesuffix(".__init__"): name for name in texts}
    to_read = [name for name in file_of_module if name in _ROOTS or name.startswith(_BY_NAME)]
    modules: set[str] = set()
    while to_read:
        name = to_read.pop()
        if name not in modules:
            modules.add(name)
            to_read += [
                module
                for module in _imports(texts[file_of_module[name]], file_of_module)
                if module in file_of_module and _may_matter(module)
            ]
    return {file_of_module[name]: texts[file_of_module[name]] for name in modules}


def _may_matter(name: str) -> bool:
    return name != "underskin" and not name.startswith(_UNUSED)


def _imports(text: str, module_names: Collection[str]) -> set[str]:
    """Full names of the modules that a module imports anywhere in its text: of those in `module_names` the module
    itself, not its package, which imports everything."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {imported.name for imported in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            qualified = [f"{node.module}.{imported.name}" for imported in node.names]
            names |= {dotted if dotted in module_names else node.module for dotted in qualified}
    return names
