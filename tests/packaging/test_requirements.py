"""The library and each extra require what is imported, no more, and the lock holds all of it."""

import ast
import re
import sys
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.metadata import packages_distributions
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.packaging.fresh_environment import required
from tests.support.repository import ROOT

DOCUMENT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT: dict[str, Any] = DOCUMENT["project"]
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]
OURS = {"underskin", "service", "tablegen", "rig", "proof"}


@cache
def distributions() -> Mapping[str, list[str]]:
    """By the modules that they hold."""
    return packages_distributions()


# Drivers that SQLAlchemy and Uvicorn load by name.
BY_NAME = {"psycopg", "uvloop", "httptools"}


def imported(package: str) -> set[str]:
    """Distributions that the modules of a package import, wherever in the module they do."""
    modules: set[str] = set()
    for source in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                modules.add(node.module.partition(".")[0])
    others = modules - OURS - sys.stdlib_module_names
    return {canonicalize_name(name) for module in others for name in distributions()[module]}


def named(requirements: list[str]) -> set[str]:
    """The distributions that requirements name."""
    return {canonicalize_name(Requirement(text).name) for text in requirements}


@pytest.mark.slow
def test_the_library_requires_what_it_imports_and_no_more() -> None:
    assert imported("underskin") - named(EXTRAS["cluster"]) == named(PROJECT["dependencies"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "extras"), [("service", ["server"]), ("tablegen", ["fem", "cluster"]), ("rig", []), ("proof", ["docs"])]
)
def test_a_package_of_the_checkout_imports_what_its_extra_requires(package: str, extras: list[str]) -> None:
    needs = PROJECT["dependencies"] + [text for extra in extras for text in EXTRAS[extra]]
    assert imported(package) - required(needs) == set()


@pytest.mark.slow
def test_the_extra_of_the_server_requires_what_is_used_and_no_more() -> None:
    assert named(EXTRAS["server"]) - imported("service") - BY_NAME == set()


def test_the_lock_holds_what_make_serve_installs() -> None:
    groups: list[str] = DOCUMENT["dependency-groups"]["build"]
    needs = required([*PROJECT["dependencies"], *EXTRAS["server"], *EXTRAS["fem"], *groups])
    assert locked("requirements.lock") == needs
    assert required(text for extra in EXTRAS.values() for text in extra) | needs == locked("requirements-dev.lock")


def locked(lock: str) -> set[str]:
    """Distributions that a lock names for this machine."""
    lines = re.findall(r"^([a-z].*?==.*?) *\\$", (ROOT / lock).read_text(encoding="utf-8"), flags=re.MULTILINE)
    entries = [Requirement(line) for line in lines]
    return {canonicalize_name(entry.name) for entry in entries if entry.marker is None or entry.marker.evaluate()}


def test_make_and_the_image_install_the_extras() -> None:
    assert "--no-index --no-build-isolation -e '.[server,fem]'" in (ROOT / "Makefile").read_text(encoding="utf-8")
    image = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert "--no-index --no-build-isolation -e '/app[server,fem]'" in image
