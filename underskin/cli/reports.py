"""Reports written as files, whole or not at all, each named like its campaign; and what the terminal says of them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import typer


def refuse_overwriting(files: Sequence[Path], campaigns: Sequence[str], output_dir: Path) -> None:
    """Reports are named like their campaigns: two of one name, or a campaign in the folder, would be lost."""
    names = [*(file.stem for file in files), *campaigns]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        sources = [(file.stem, str(file)) for file in files] + [(name, f"--campaign {name}") for name in campaigns]
        clashing = " and ".join(source for name, source in sources if name == twice[0])
        problem = (
            f"reports are named like their campaigns: {clashing} would all become {twice[0]}.json. "
            "Rename files, or run once for each, with an --output-dir of its own"
        )
        raise typer.BadParameter(problem, param_hint="FILES")
    lost = [file for file in files if (output_dir / f"{file.stem}.json").resolve() == file.resolve()]
    if lost:
        raise typer.BadParameter(f"the report would overwrite {lost[0]}", param_hint="--output-dir")


def in_words(document: Mapping[str, Any]) -> str:
    """A report's verdict and, below it, its statement."""
    return f"{document['verdict']}\n{document['statement']}"


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
