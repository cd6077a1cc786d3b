"""README, CONTRIBUTING and the pages by task: their commands print what is shown, their lists are complete."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.settings import Settings
from tests.support.repository import ROOT
from tests.support.server import running
from tests.support.shown import is_as_shown

PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "docs/index.md",
    "docs/quickstart.md",
    "docs/http-api.md",
    "docs/command-line.md",
    "docs/recordings.md",
    "docs/diagnosis.md",
    "docs/findings.md",
    "docs/extending.md",
    "docs/glossary.md",
    "docs/deploy.md",  # the last: it makes keys
)
SOON = ("README.md", "docs/quickstart.md", "docs/http-api.md")  # the others in `make soak`
PYTHON = ".venv/bin/python"
ADDRESS = "http://127.0.0.1:8000"
README_LIMIT = 7000  # bytes
_PRINTS = "# prints "


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def commands(page: str) -> list[tuple[list[str], str]]:
    """What a reader of the page runs, in its order, each with the output that is shown for it.

    In a console block a command begins with `$ ` and ends where its quotes and here-documents are closed, as bash sees
    it. A Python block says in a comment what it prints; one without that comment is not run.
    """
    pairs = []
    for language, block in re.findall(r"^```(console|python)\n(.*?)^```$", text(page), flags=re.M | re.S):
        if language == "python":
            pairs += [([PYTHON, "-c", block], shown) for shown in re.findall(f"{_PRINTS}(.*)", block)]
            continue
        for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            lines = part.splitlines()
            length = next(n for n in range(1, len(lines) + 1) if is_complete("\n".join(lines[:n])))
            command = ["bash", "-euo", "pipefail", "-c", "\n".join(lines[:length])]
            pairs.append((command, "\n".join(lines[length:])))
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
    """Runs a command as one who follows the pages from their first line, with a service of one's own."""
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


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        pytest.param(*pair, id=f"{page}-{number}", marks=() if page in SOON else pytest.mark.soak)
        for page in PAGES
        for number, pair in enumerate(commands(page), start=1)
    ],
)
def test_command_prints_what_the_page_shows(command: list[str], shown: str, newcomer: Run, folder: Path) -> None:
    answer = newcomer(command)
    assert answer.returncode == 0, answer.stderr
    printed = answer.stdout.replace(f"{folder}/", "/tmp/")
    assert is_as_shown(shown, printed), f"{command[-1]}\nprints\n{answer.stdout}"


def test_readme_is_short() -> None:
    assert len(text("README.md").encode()) <= README_LIMIT


def test_every_page_has_a_task_and_the_index_leads_to_it() -> None:
    index = text("docs/index.md")
    pages = sorted(file.name for file in (ROOT / "docs").glob("*.md") if file.name != "index.md")
    assert [name for name in pages if f"]({name})" not in index] == []


def test_every_make_target_is_listed() -> None:
    targets = re.findall(r"^(\w+):.*## ", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    listed = text("CONTRIBUTING.md")
    assert [target for target in targets if target != "help" and f"| `make {target}` |" not in listed] == []


def test_every_setting_is_listed_with_its_meaning() -> None:
    listed = text("docs/deploy.md")
    names = [f"`UNDERSKIN_{name.upper()}`" for name in Settings.model_fields]
    assert [name for name in names if f"| {name} |" not in listed] == []
