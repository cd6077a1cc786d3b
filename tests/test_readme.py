"""The README keeps its word: its commands print what it shows, its links lead somewhere, its lists are complete."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.settings import Settings
from tests.conftest import running
from tests.shown import is_as_shown

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PYTHON = ".venv/bin/python"
ADDRESS = "http://127.0.0.1:8000"


def blocks(language: str) -> list[str]:
    """Contents of the code blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


def sessions() -> list[tuple[str, str]]:
    """Commands of the console blocks, each with the output that is shown for it.

    A command ends where its quotes and here-documents are closed, as bash sees it.
    """
    pairs = []
    for block in blocks("console"):
        for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            lines = part.splitlines()
            length = next(n for n in range(1, len(lines) + 1) if is_complete("\n".join(lines[:n])))
            pairs.append(("\n".join(lines[:length]), "\n".join(lines[length:])))
    return pairs


def is_complete(command: str) -> bool:
    """Whether bash would wait for no further line; an unclosed here-document is only a warning."""
    return subprocess.run(["bash", "-n", "-c", command], capture_output=True).stderr == b""


Run = Callable[[list[str]], "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Stands for /tmp."""
    return tmp_path_factory.mktemp("readme")


@pytest.fixture(scope="module")
def newcomer(folder: Path) -> Iterator[Run]:
    """Runs a command as one who follows the page from its first line, with a service of one's own."""
    with running(folder) as server:
        environment = os.environ | {
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "UNDERSKIN_DATA": str(folder / "data"),
            "UNDERSKIN_URL": server.url,
        }

        def run(command: list[str]) -> "subprocess.CompletedProcess[str]":
            live = [part.replace(ADDRESS, server.url).replace("/tmp/", f"{folder}/") for part in command]
            live = [part.replace(PYTHON, sys.executable) for part in live]  # the last: it may lie in /tmp itself
            return subprocess.run(live, cwd=ROOT, env=environment, capture_output=True, text=True)

        yield run


@pytest.mark.parametrize(("command", "shown"), sessions())
def test_command_prints_what_the_readme_shows(command: str, shown: str, newcomer: Run, folder: Path) -> None:
    answer = newcomer(["bash", "-euo", "pipefail", "-c", command])
    assert answer.returncode == 0, answer.stderr
    printed = answer.stdout.replace(f"{folder}/", "/tmp/")
    assert is_as_shown(shown, printed), f"{command}\nprints\n{answer.stdout}"


@pytest.mark.parametrize("block", blocks("python"))
def test_python_block_runs_and_prints_what_its_comment_says(block: str, newcomer: Run) -> None:
    """After the commands, which send what the second block asks for."""
    (shown,) = re.findall(r"# prints (.*)", block)
    answer = newcomer([PYTHON, "-c", block])
    assert answer.returncode == 0, answer.stderr
    assert is_as_shown(shown, answer.stdout), answer.stdout


def test_links_lead_to_files() -> None:
    links = set(re.findall(r"\]\(([^)#:]+)\)", README))
    assert len(links) > 5
    assert [link for link in sorted(links) if not (ROOT / link).exists()] == []


def test_every_make_target_and_setting_is_listed() -> None:
    targets = re.findall(r"^(\w+):.*## ", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    wanted = [f"`make {target}`" for target in targets if target != "help"]
    wanted += [f"`UNDERSKIN_{name.upper()}`" for name in Settings.model_fields]
    assert [name for name in wanted if f"| {name} |" not in README] == []
