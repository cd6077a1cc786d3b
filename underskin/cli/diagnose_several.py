"""`diagnose --together` and `--fleet`: files of campaigns of one skin, or of skins of one make, in one report."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from underskin.cli.reports import in_words, write_page, write_report
from underskin.cli.rigs import reading_notes

if TYPE_CHECKING:
    from underskin.recordings.reading import Reading

_NAME = re.compile(r"\w[\w .-]*")


def of_several(
    files: Sequence[Path],
    read: "Callable[[Path], Reading]",
    without: Sequence[str],
    output_dir: Path,
    *,
    html: bool,
    together: str | None,
    fleet: str | None,
) -> None:
    """Write NAME.json, and NAME.html with `html`; `read` reads a file."""
    from rich.console import Console
    from rich.progress import Progress

    from underskin.diagnosis.diagnose import diagnose_fleet, diagnose_together

    target = output_dir / f"{_name(together, fleet)}.json"
    if any(file.resolve() == target.resolve() for file in files):
        raise typer.BadParameter(f"the report would overwrite {target}", param_hint="--together, --fleet")
    readings = _read(files, read)
    known = sorted({reading.campaign.skin.id for reading in readings if reading.campaign.skin.id is not None})
    if together is not None and len(known) > 1:
        allowed = f"the campaigns are of several skins (skin.id): {', '.join(known)}"
        raise typer.BadParameter(allowed, param_hint="--together")
    console = Console(stderr=True)
    with Progress(console=console) as progress:
        bar = progress.add_task("diagnosing", total=1.0)

        def told(share: float) -> None:
            progress.update(bar, completed=share)

        if together is not None:
            report = diagnose_together(readings, target.stem, without=without, progress=told)
        else:
            report = diagnose_fleet(_by_skin(readings), target.stem, without=without, progress=told)
        told(1.0)
    document = dict(report)
    write_report(document, target)
    if html:
        write_page(document, target.with_suffix(".html"))
    console.print(f"{target.stem}: {in_words(document)}", markup=False, highlight=False, soft_wrap=True)
    for file, reading in zip(files, readings, strict=True):
        for note in reading_notes(reading):
            console.print(f"{file}: {note}", markup=False, highlight=False, soft_wrap=True)


def _name(together: str | None, fleet: str | None) -> str:
    """What the report is called."""
    name = together if together is not None else fleet
    if name is None or (together is not None and fleet is not None):
        raise typer.BadParameter("one of --together and --fleet", param_hint="--fleet")
    if not _NAME.fullmatch(name):
        raise typer.BadParameter(
            f"{name!r}: letters, digits, spaces, points and hyphens", param_hint="--together, --fleet"
        )
    return name


def _read(files: Sequence[Path], read: "Callable[[Path], Reading]") -> list["Reading"]:
    from underskin.errors import UnderskinError

    readings = []
    for file in files:
        try:
            readings.append(read(file))
        except UnderskinError as error:
            raise UnderskinError(f"{file}: {error}") from error
    return readings


def _by_skin(readings: Sequence["Reading"]) -> dict[str, list["Reading"]]:
    """By skin.id, which each must have."""
    skins: dict[str, list[Reading]] = {}
    for reading in readings:
        skin = reading.campaign.skin.id
        if skin is None:
            raise typer.BadParameter(f"{reading.campaign.name} names no skin (skin.id)", param_hint="--fleet")
        skins.setdefault(skin, []).append(reading)
    return skins
