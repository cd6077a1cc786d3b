"""The wheel in a fresh environment: it computes with what the library requires, and says what it does not hold."""

import json
import os
import re
import shutil
import subprocess
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from packaging.utils import canonicalize_name

from tests.packaging.fresh_environment import Environment, build_wheel, new_environment, required
from tests.support.cases import first
from tests.support.lean_reports import BESIDE_SKINS
from tests.support.repository import ROOT

pytestmark = pytest.mark.slow  # they build the wheel and its environment

PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CAMPAIGN = ROOT / "examples" / "campaigns" / "2017-06.csv"
COMPILED_THERE = "contact_kernel"  # within a second

# Every module of the library, but for the cluster's `distributed`, which is imported when it is asked for.
IMPORT_ALL = """
import importlib, importlib.metadata, json, pkgutil, sys, underskin
for module in pkgutil.walk_packages(underskin.__path__, "underskin."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
installed = [found.name for found in importlib.metadata.distributions()]
print(json.dumps(["underskin.diagnosis.pipeline" in sys.modules, installed]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout."""
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def fresh(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with the wheel and the library's own dependencies."""
    environment = new_environment(tmp_path_factory.mktemp("fresh") / "venv", PROJECT["dependencies"])
    environment.install(str(wheel))
    bring_compiled(environment)
    return environment


def bring_compiled(environment: Environment) -> None:
    """Copy the machine code of this checkout to the same functions there, but for one module's, which it compiles."""
    for file in (ROOT / "underskin").rglob("__pycache__/*.nb[ic]"):
        if file.name.partition(".")[0] != COMPILED_THERE:
            target = environment.site_packages / file.relative_to(ROOT)
            target.parent.mkdir(exist_ok=True)
            shutil.copy(file, target)


def run(environment: Environment, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`underskin` in an empty folder, without this environment's variables for Python."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    command = [str(environment.command), *arguments]
    return subprocess.run(command, cwd=folder, env=variables | {"COLUMNS": "120"}, capture_output=True, text=True)


def printed(environment: Environment, folder: Path, *arguments: str) -> str:
    """What a command prints that succeeds."""
    done = run(environment, folder, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_holds_the_library_and_the_tables_alone(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        names = file.namelist()
    assert {name.split("/")[0] for name in names} == {"underskin", f"underskin-{PROJECT['version']}.dist-info"}
    assert {f"underskin/tables/{table.name}" for table in (ROOT / "tables").glob("*.h5")} < set(names)


def test_environment_wheel_requires(fresh: Environment) -> None:
    """The environment has what the wheel requires and no more, and every module is imported there."""
    assert fresh.pip("check") == "No broken requirements found.\n"
    done = fresh.python(IMPORT_ALL)
    assert done.returncode == 0, done.stderr
    diagnoses, installed = json.loads(done.stdout)
    assert diagnoses
    assert {canonicalize_name(name) for name in installed} == required(PROJECT["dependencies"]) | {"underskin"}
    assert list(fresh.site_packages.glob(f"underskin/**/{COMPILED_THERE}.*.nbc"))


def test_a_diagnosis(fresh: Environment, tmp_path: Path) -> None:
    fewer = [part for name in BESIDE_SKINS for part in ("--without", name)]
    printed(fresh, tmp_path, "diagnose", str(CAMPAIGN), *fewer, "--output-dir", "reports", "--html")
    report = json.loads((tmp_path / "reports" / "2017-06.json").read_text(encoding="utf-8"))
    assert report["verdict"] == "explained"
    assert [mechanism["name"] for mechanism in report["mechanisms"]] == ["sensor_spread"]
    assert (tmp_path / "reports" / "2017-06.html").stat().st_size > 100_000


def test_the_help_says_where_the_other_commands_run(fresh: Environment, tmp_path: Path) -> None:
    image = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    shown = printed(fresh, tmp_path, "--help").splitlines()
    for name, target in PROJECT["entry-points"]["underskin.commands"].items():
        inside = f"COPY {target.partition('.')[0]} " in image
        where = f"(runs from a checkout{' or the image' if inside else ''})"
        assert any(name in line.split() and where in line for line in shown), name


@pytest.mark.parametrize(
    ("command", "where", "extra"),
    first(
        1,
        [
            ("serve", "a checkout or the image", "server"),
            ("prove", "a checkout", "docs"),
            ("rig", "a checkout or the image", ""),
        ],
    ),
)
def test_a_command_that_the_wheel_does_not_hold_says_what_to_install(
    fresh: Environment, tmp_path: Path, command: str, where: str, extra: str
) -> None:
    refusal = run(fresh, tmp_path, command)
    assert (refusal.returncode, refusal.stdout) == (2, "")
    install = f"; in a checkout, pip install -e '.[{extra}]' installs what it needs" if extra else ""
    assert re.fullmatch(
        rf"underskin: this command runs from {where} \(No module named '\w+'\){re.escape(install)}\n", refusal.stderr
    )


@pytest.mark.soak
def test_a_checkout_without_the_extra_says_what_to_install(tmp_path: Path) -> None:
    environment = new_environment(tmp_path / "venv", [*PROJECT["dependencies"], "hatchling", "editables"])
    environment.install("--editable", str(ROOT))
    refusal = run(environment, tmp_path, "serve")
    assert refusal.returncode == 2
    assert "No module named" in refusal.stderr
    assert "in a checkout, pip install -e '.[server]' installs what it needs" in refusal.stderr
