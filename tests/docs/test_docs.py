"""The pages as a whole: links and their anchors lead somewhere, files that are named exist, the site is built."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.repository import ROOT

PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "tables" / "README.md",
    *sorted((ROOT / "examples").rglob("*.md")),
]
_FENCED = re.compile(r"^( *)```.*?^\1```", flags=re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\((?![a-z]+:)([^)#\s]*)(?:#([^)\s]+))?\)")
_FOLDERS = (
    "bench",
    "deploy",
    "docs",
    "examples",
    "proof",
    "rig",
    "scripts",
    "service",
    "tablegen",
    "tests",
    "underskin",
)
_FILE = re.compile(rf"`(?!rig/1`)((?:{'|'.join(_FOLDERS)})/[\w./-]+)`")


def prose(page: Path) -> str:
    """The page without its blocks of code."""
    return _FENCED.sub("", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """Of the headings, as GitHub and the site make them."""
    headings = re.findall(r"^#+ (.+)$", prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_files_exist(page: Path) -> None:
    for link, anchor in _LINK.findall(prose(page)):
        target = page.parent / link if link else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), f"{link}#{anchor}"
    assert [name for name in _FILE.findall(prose(page)) if not (ROOT / name).exists()] == []


def test_parts_of_the_benchmark_that_are_said_to_be_on_a_page_are() -> None:
    """A page that leads to validation.md for `python -m bench PART` finds that part there."""
    validation = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    for page in PAGES:
        for paragraph in prose(page).split("\n\n"):
            if "](validation.md)" in paragraph or "](docs/validation.md)" in paragraph:
                parts = re.findall(r"`python -m bench (\w+)`", paragraph)
                assert [part for part in parts if f"`python -m bench {part}`" not in validation] == [], page


@pytest.mark.soak
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    reference = (tmp_path / "site" / "python-api.html").read_text(encoding="utf-8")
    assert 'id="underskin.read_file"' in reference
    sources = re.findall(r"<(?:script|link|img)[^>]*\s(?:src|href)=\"(https?:[^\"]*)", reference)
    assert sources == []
