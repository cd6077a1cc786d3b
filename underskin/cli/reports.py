"""Reports written as files, whole or not at all."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_report(document: dict[str, Any], path: Path) -> None:
    """Write a report as JSON, the same bytes for the same report."""
    _write(json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False) + "\n", path)


def write_page(document: dict[str, Any], path: Path, figures: Mapping[str, Any] | None = None) -> None:
    """Write a report as a page, with those of its figures that are given."""
    from underskin.diagnosis.reporting.html_report import page

    _write(page(document, figures), path)


def _write(text: str, path: Path) -> None:
    partial = path.with_name(f".{path.name}.part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
