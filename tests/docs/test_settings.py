"""Every setting, every environment variable and every route stands in docs/settings.md, and nothing else does."""

import re
from typing import Any

import httpx
from pydantic_core import PydanticUndefined

from service.settings import Settings
from tests.support.repository import ROOT

TEXT = (ROOT / "docs" / "settings.md").read_text()
MISSPELT = {"UNDERSKIN_MAX_HAEDER_KB"}  # set by tests of what is said of names that nothing reads
SECTIONS = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", TEXT, flags=re.MULTILINE | re.DOTALL))


def rows(section: str) -> dict[str, str]:
    """First cell, without its quotes, and the others of each row of the table in a section."""
    return dict(re.findall(r"^\| `([^`]+)` \| (.+) \|$", SECTIONS[section], flags=re.MULTILINE))


def test_every_setting_is_documented_with_its_default() -> None:
    documented = {name: section for name, section in SECTIONS.items() if name.startswith("`")}
    for name, field in Settings.model_fields.items():
        section = documented.pop(f"`UNDERSKIN_{name.upper()}`")
        assert len(section.split()) > 10, name
        if field.default not in (PydanticUndefined, None, ""):
            assert f"Default: `{field.default}`" in section, name
    assert not documented


def test_every_variable_that_is_read_is_documented() -> None:
    """Read: quoted in Python, or expanded in shell."""
    folders = ("underskin", "service", "tablegen", "examples", "bench", "docs", "scripts", "tests")
    sources = [source for folder in folders for source in (ROOT / folder).rglob("*.*")]
    used: set[str] = set()
    for source in sources:
        if source.suffix in (".py", ".sh", ".m"):
            used |= set(re.findall(r"[\"'{](UNDERSKIN_[A-Z_]*[A-Z])[\"':}]", source.read_text()))
    settings = {f"UNDERSKIN_{name.upper()}" for name in Settings.model_fields}
    assert used - settings - MISSPELT == set(rows("Variables that the service does not read"))
    assert "UNDERSKIN_TABLES" in used


def test_every_route_is_documented(http: httpx.Client) -> None:
    document: dict[str, Any] = http.get("/openapi.json").json()
    routes = {f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods}
    assert set(rows("Routes")) == routes
