"""The command `read`: what would be taken from a file, and a first rig description of it, without sending anything."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.cli.rigs import RigOption, reading_notes, rig_description_in
from underskin.errors import FileError, UnderskinError

if TYPE_CHECKING:
    from underskin.recordings.channels import Contents
    from underskin.recordings.reading import Reading

_MOST_LISTED = 40  # columns, recordings, properties
_MOST_TEXTS = 3  # of a column, that are shown


def read(
    file: Annotated[Path, typer.Argument(help="A file of recordings, as the instrument wrote it.")],
    rig: RigOption = None,
    draft: Annotated[
        Path | None, typer.Option(help="Where to write a first rig description, to be looked over and completed.")
    ] = None,
) -> None:
    """Say what would be taken from a file for what, and draft a rig description of it.

    Nothing is sent or kept. With a rig description, and of files that describe themselves, the recordings are listed;
    exit status 2 if any cannot be used. Without a rig description they are listed too if the headings suffice.
    """
    from underskin.recordings.channels import Contents
    from underskin.recordings.reading import read_contents, understood

    description = None if rig is None else rig_description_in(rig)
    contents = read_contents(file, str(file), description)
    if isinstance(contents, Contents):
        _print(_columns(contents, None if description is None else description.document))
    if description is not None or not isinstance(contents, Contents):
        if draft is not None:
            raise UnderskinError(f"--draft: {file} is read already, so there is nothing to draft")
        reading = understood(contents, str(file), description)
        _print(_recordings(reading))
        raise typer.Exit(2 if reading.problems else 0)
    text = _draft(contents, file.name)
    with suppress(FileError):  # which says what the draft says
        _print(_recordings(understood(contents, str(file))))
    if draft is None:
        print(f"\n{text}", end="")
    elif draft.exists():
        raise UnderskinError(f"--draft: {draft} is there already, and is not overwritten")
    else:
        draft.write_text(text, encoding="utf-8")
        print(f"\n{draft}: look it over and complete it, then: underskin read {file} --rig {draft}")


def _print(lines: Iterator[str]) -> None:
    for line in lines:
        print(line)
    sys.stdout.flush()


def _columns(contents: "Contents", document: Mapping[str, Any] | None) -> Iterator[str]:
    """The layout, the columns of the first part with what a rig description or the guess takes them for, the properties
    and the warnings."""
    from underskin.recordings import rig_guess

    if contents.layout:
        yield f"read the text as: {contents.layout}"
    taken = rig_guess.taken(rig_guess.of_contents(contents) if document is None else document)
    rows = [("column", "unit", "values", "taken for"), *_rows(contents, taken)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
    others = [block.name for block in contents.blocks if block is not next(iter(rig_guess.main_blocks(contents)), None)]
    if others:
        yield f"and {len(others)} more parts, such as {others[0]!r}"
    for name, value in list(contents.properties.items())[:_MOST_LISTED]:
        yield f"property {name!r}: {str(value)[:80]}"
    for warning in contents.warnings:
        yield f"look at: {warning}"


def _rows(contents: "Contents", taken: Mapping[str, str]) -> Iterator[tuple[str, str, str, str]]:
    import numpy as np

    from underskin.recordings import rig_guess

    for block in rig_guess.main_blocks(contents)[:1]:
        for column in block.texts:
            shown = ", ".join(filter(None, column.texts[:_MOST_TEXTS]))
            values = f"{shown}{', …' if len(column.texts) > _MOST_TEXTS else ''} ({len(column.texts)} different)"
            yield column.name, "", values, taken.get(column.name, "")
        for channel in block.channels[:_MOST_LISTED]:
            numbers = np.abs(channel.values) if channel.is_complex else channel.values
            finite = numbers[np.isfinite(numbers)]
            span = f"{finite.min():.5g} to {finite.max():.5g}" if len(finite) else "no numbers"
            label = channel.label or "?"
            yield channel.name, label, f"{span} ({len(channel.values)})", taken.get(channel.name, "")


def _recordings(reading: "Reading") -> Iterator[str]:
    campaign = reading.campaign
    yield f"campaign {campaign.name}: {len(campaign.recordings)} recordings"
    for recording in campaign.recordings[:_MOST_LISTED]:
        stated = {name: getattr(recording, name, None) for name in ("sensor", "preload_n", "indenter_radius_mm")}
        words = ", ".join(f"{name} {value}" for name, value in stated.items() if value is not None)
        yield f"  {recording.id}: {recording.kind}{f', {words}' if words else ''}"
    if len(campaign.recordings) > _MOST_LISTED:
        yield f"  and {len(campaign.recordings) - _MOST_LISTED} more"
    yield from reading_notes(reading)
    for problem in reading.problems:
        yield f"left out: {problem.recording}: {problem.field} = {problem.value!r}: {problem.allowed}"


def _draft(contents: "Contents", file: str) -> str:
    """The guessed rig description as YAML, with the places that are to be completed."""
    import yaml

    from underskin.recordings import rig_guess

    document: dict[str, Any] = rig_guess.of_contents(contents)
    lacking = rig_guess.missing(document)
    head = f"# Guessed from the headings of {file}: look it over.\n"
    head += f"# To be completed: {', '.join(lacking)}.\n" if lacking else ""
    written = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=10_000)
    return head + written
