"""The size and shape of the library in figures: python -m scripts.house prints them as a table in Markdown.

The catalogue (laws, readers, slips, units) is many small files by design, and is counted by itself.
"""

import ast
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIBRARY = ROOT / "underskin"
WRITTEN = LIBRARY / "client" / "documents.py"  # by make, not kept in git
CATALOGUE = ("mechanisms/laws/", "recordings/readers/", "diagnosis/slips/", "units.py")
SLIPS = ("diagnosis/slips/",)
ENGINE = ("diagnosis/", "inference/")
_KINDS = ("frf", "indentation", "compression")
_NO_RECORDINGS = ("dtype", "defect")  # whose `kind` is another
_RECORDINGS = re.compile(r"\w*Recording$")
_TRACE = """
import importlib, sys
from pathlib import Path
import underskin
root = Path(underskin.__file__).parent
for path in root.rglob("*.py"):  # all first, so that what runs at an import is not taken for the path
    if path.stem not in ("__main__", "__init__"):  # packages are imported by their modules
        importlib.import_module(".".join(("underskin", *path.relative_to(root).with_suffix("").parts)))
from underskin.cli.app import main
passed = set()
def note(frame, event, _):
    if event == "call":
        passed.add(frame.f_code.co_filename)
sys.argv[1:] = ["diagnose", *sys.argv[2:], "--workers", "1"]
sys.setprofile(note)
try:
    main()
except SystemExit as ended:
    assert not ended.code, ended.code
finally:
    sys.setprofile(None)
    print(*sorted(passed), sep="\\n")
"""  # compiled functions are no Python frames: their files are passed by whatever calls them


def main() -> None:
    """Print the table."""
    texts = {_name(path): path.read_text(encoding="utf-8") for path in LIBRARY.rglob("*.py") if path != WRITTEN}
    modules = {name: ast.parse(text) for name, text in texts.items()}
    lines = {name: len(text.splitlines()) for name, text in texts.items()}
    counted = [name for name in modules if not name.startswith(CATALOGUE)]
    engine = [name for name in modules if name.startswith(ENGINE) and not name.startswith(SLIPS)]
    circles = import_circles(modules)
    split = split_classes(modules)
    rows = [
        ("`underskin`: files, lines", f"{len(modules)}, {sum(lines.values()):,}"),
        ("without the catalogue", f"{len(counted)}, {sum(lines[name] for name in counted):,}"),
        ("diagnosis and inference without slips", f"{len(engine)}, {sum(lines[name] for name in engine):,}"),
        ("numeric module constants, of these", f"{sum(map(constants, (modules[name] for name in engine)))}"),
        ("numeric module constants in the diagnosis, slips included",
         f"{sum(constants(tree) for name, tree in modules.items() if name.startswith(ENGINE))}"),
        ("branches on the kind of recording", f"{sum(map(kind_branches, modules.values()))}"),
        ("files on the path of an FRF line, CSV to verdict", f"{len(passed_files())}"),
        ("circles of imports", " · ".join(" ↔ ".join(circle) for circle in circles) or "0"),
        ("classes over several files", f"{len(split)}: {', '.join(split)}" if split else "0"),
    ]  # fmt: skip
    print("| | |\n|---|---|")
    for name, figure in rows:
        print(f"| {name} | {figure} |")


def _name(path: Path) -> str:
    return path.relative_to(LIBRARY).as_posix()


def constants(tree: ast.Module) -> int:
    """Names in capitals at module level whose value holds a number."""
    count = 0
    for node in tree.body:
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        value = getattr(node, "value", None)
        if value is None or not any(_is_number(target) for target in ast.walk(value)):
            continue
        names = chain.from_iterable(target.elts if isinstance(target, ast.Tuple) else [target] for target in targets)
        count += sum(isinstance(target, ast.Name) and target.id == target.id.upper() for target in names)
    return count


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def kind_branches(tree: ast.Module) -> int:
    """Comparisons with the name of a kind of recording, tests of a recording's class, and conditions on `kind` or
    `curves`."""
    nodes = list(ast.walk(tree))
    direct = [node for node in nodes if _compares_kinds(node)]
    conditions: list[ast.expr] = []
    for node in nodes:
        conditions += node.ifs if isinstance(node, ast.comprehension) else []
        conditions += [node.test] if isinstance(node, ast.If | ast.IfExp | ast.While) else []
    indirect = [
        test
        for test in conditions
        if any(_is_kind(part) for part in ast.walk(test)) and not any(_compares_kinds(part) for part in ast.walk(test))
    ]
    return len(direct) + len(indirect)


def _is_kind(node: ast.AST) -> bool:
    if not isinstance(node, ast.Attribute):
        return isinstance(node, ast.Name) and node.id == "kind"
    owner = node.value.attr if isinstance(node.value, ast.Attribute) else ast.unparse(node.value)
    return node.attr == "curves" or (node.attr == "kind" and owner not in _NO_RECORDINGS)


def _compares_kinds(node: ast.AST) -> bool:
    if isinstance(node, ast.Compare):
        parts = chain.from_iterable(ast.walk(part) for part in (node.left, *node.comparators))
        return any(isinstance(part, ast.Constant) and part.value in _KINDS for part in parts)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
        return any(isinstance(part, ast.Name) and _RECORDINGS.match(part.id) for part in ast.walk(node.args[1]))
    return False


def passed_files() -> list[str]:
    """Files of the library in which a function runs while the command line diagnoses a CSV file of FRFs."""
    sample = ROOT / "examples" / "campaigns" / "2017-05.csv"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", _TRACE, "diagnose", str(sample), "--output-dir", folder]
        run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return [line for line in run.stdout.splitlines() if line.startswith(str(LIBRARY))]


def import_circles(modules: Mapping[str, ast.Module]) -> list[list[str]]:
    """Groups of modules that import one another, wherever in the file the import is, for type checking too."""
    file_of_module = {_dotted(name): name for name in modules}
    graph = {
        name: {
            file_of_module[imported] for imported in _imported(tree, file_of_module) if file_of_module[imported] != name
        }
        for name, tree in modules.items()
    }
    groups = [sorted(group) for group in _strongly_connected(graph) if len(group) > 1]
    return sorted(groups)


def _dotted(name: str) -> str:
    return ".".join(("underskin", *Path(name).with_suffix("").parts)).removesuffix(".__init__")


def _imported(tree: ast.Module, modules: Mapping[str, str]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                if name in modules or node.module in modules:
                    yield name if name in modules else node.module


def _strongly_connected(graph: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """Tarjan's algorithm."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    groups: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = lowest[node] = len(order)
        stack.append(node)
        for neighbour in graph[node]:
            if neighbour not in order:
                visit(neighbour)
                lowest[node] = min(lowest[node], lowest[neighbour])
            elif neighbour in stack:
                lowest[node] = min(lowest[node], order[neighbour])
        if lowest[node] == order[node]:
            index = stack.index(node)
            groups.append(stack[index:])
            del stack[index:]

    sys.setrecursionlimit(10_000)
    for node in graph:
        if node not in order:
            visit(node)
    return groups


def split_classes(modules: Mapping[str, ast.Module]) -> list[str]:
    """Classes that one class alone extends, in another file of the same folder: one class in two pieces."""
    home: dict[str, str] = {}
    children: dict[str, list[str]] = {}
    for name, tree in modules.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                home[node.name] = name
                for base in node.bases:
                    children.setdefault(ast.unparse(base).rpartition(".")[2].partition("[")[0], []).append(node.name)
    return sorted(
        f"{parent} ({home[parent]}) + {child[0]}"
        for parent, child in children.items()
        if parent in home
        and len(child) == 1
        and home[parent] != home[child[0]]
        and Path(home[parent]).parent == Path(home[child[0]]).parent
    )


if __name__ == "__main__":
    main()
