"""A fresh virtual environment with the wheel and what it requires, without the network.

The required distributions are links to those of the environment that runs the tests, so that a package which the wheel
does not require cannot be imported.
"""

import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.repository import ROOT


@dataclass(frozen=True)
class Environment:
    """A virtual environment."""

    folder: Path

    @property
    def command(self) -> Path:
        """The command `underskin` that is installed in it."""
        return self.folder / "bin" / "underskin"

    @property
    def site_packages(self) -> Path:
        """Where its packages are."""
        (folder,) = self.folder.glob("lib/python*/site-packages")
        return folder

    def install(self, *arguments: str) -> None:
        """Let pip install something that is on this machine; what it requires must be there already."""
        self.pip("install", "--quiet", "--no-index", "--no-build-isolation", *arguments)

    def pip(self, *arguments: str) -> str:
        """What pip prints about this environment."""
        command = [sys.executable, "-m", "pip", "--python", str(self.folder), *arguments]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def python(self, program: str) -> subprocess.CompletedProcess[str]:
        """Run a program with its Python."""
        command = [str(self.folder / "bin" / "python"), "-I", "-c", program]
        return subprocess.run(command, capture_output=True, text=True)


def new_environment(folder: Path, requirements: Iterable[str]) -> Environment:
    """An environment with what `requirements` need, directly and indirectly."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    environment = Environment(folder)
    for name in required(requirements):
        link(name, environment.site_packages)
    return environment


def required(requirements: Iterable[str]) -> set[str]:
    """Names of all distributions that requirements need on this machine, directly and indirectly."""
    waiting = [Requirement(text) for text in requirements]
    seen: set[tuple[str, str]] = set()  # a distribution and one of its extras, or none
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        for extra in {"", *requirement.extras}:
            if (name, extra) not in seen:
                seen.add((name, extra))
                needs = [Requirement(text) for text in distribution(name).requires or []]
                waiting += [need for need in needs if need.marker is None or need.marker.evaluate({"extra": extra})]
    return {name for name, _ in seen}


def link(name: str, site_packages: Path) -> None:
    """Let an environment have a distribution of this one."""
    installed = distribution(name)
    tops = {file.parts[0] for file in installed.files or [] if file.parts[0] not in ("..", "__pycache__")}
    assert tops, name
    for top in tops:
        if not (site_packages / top).exists():
            (site_packages / top).symlink_to(Path(str(installed.locate_file(top))))


def build_wheel(folder: Path) -> Path:
    """The wheel of this checkout."""
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(build, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel
