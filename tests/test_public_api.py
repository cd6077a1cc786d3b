"""What `underskin` exports, and that a type checker and the interpreter see the same."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import underskin

PUBLIC = {
    "Campaign",
    "Client",
    "Conditions",
    "ExtensionError",
    "FileError",
    "Indenter",
    "InvalidInput",
    "Inversion",
    "Predicted",
    "Reading",
    "Report",
    "RigLimits",
    "ServiceError",
    "Sigma",
    "SigmaTable",
    "Skin",
    "SkinDescription",
    "SolverError",
    "TableError",
    "Transmission",
    "UnderskinError",
    "Unreachable",
    "diagnose",
    "diagnose_fleet",
    "diagnose_together",
    "frf_conditions",
    "invert",
    "load_table",
    "predict",
    "read_file",
    "solved_contact",
    "transmission",
}


def test_exports() -> None:
    assert set(underskin.__all__) == PUBLIC
    assert underskin.__all__ == sorted(underskin.__all__)


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_export_comes_from_where_a_type_checker_believes(name: str) -> None:
    tree = ast.parse(Path(underskin.__file__).read_text(encoding="utf-8"))
    homes = {
        alias.name: node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert getattr(underskin, name).__module__ == homes[name]


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_export_is_documented(name: str) -> None:
    assert inspect.getdoc(getattr(underskin, name))


def test_unknown_name_is_an_attribute_error() -> None:
    unknown = "nonsense"
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        getattr(underskin, unknown)


def test_every_error_is_an_underskin_error() -> None:
    errors = [getattr(underskin, name) for name in PUBLIC if inspect.isclass(getattr(underskin, name))]
    raised = [error for error in errors if issubclass(error, Exception)]
    assert len(raised) == 8
    assert all(issubclass(error, underskin.UnderskinError) for error in raised)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "unneeded"),
    [
        ("underskin", {"numpy", "scipy", "h5py", "httpx"}),
        ("underskin.recordings.readers.sandbox", {"scipy", "h5py", "multiprocessing", "underskin.recordings.reading"}),
        ("service.jobs.worker", {"scipy", "sqlalchemy"}),
        ("underskin.diagnosis.pipeline", {"scipy.stats"}),
    ],
)
def test_import_loads_what_it_needs(module: str, unneeded: set[str]) -> None:
    """Processes that start often, for a file, a diagnosis or a command, load nothing that they do not use."""
    seen = f"import sys, {module}; print(sorted({unneeded} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", seen], capture_output=True, text=True, check=True).stdout == "[]\n"
