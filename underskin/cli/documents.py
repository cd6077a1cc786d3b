"""Answers of the service: as JSON for scripts, as tables for people."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any

import typer

Document = Mapping[str, Any]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON, with the fields of the HTTP interface.")]


def write_json(document: Any) -> None:
    """Write a document, or a list of documents."""
    typer.echo(json.dumps(document, default=dict, ensure_ascii=False, indent=1))


def write_rows(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table; the last column takes the remaining width.

    Raises ValueError where a row has more or fewer cells than there are headings.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from underskin.cli.columns import PIPED_WIDTH

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in headings:
        table.add_column(heading, overflow="fold", no_wrap=heading in ("id", "campaign"))
    for row in rows:
        if len(row) != len(headings):
            raise ValueError(f"{len(row)} cells under {len(headings)} headings: {row}")
        table.add_row(*map(Text, row))
    Console(highlight=False, width=None if sys.stdout.isatty() else PIPED_WIDTH).print(table)


def moment(time: str | None) -> str:
    """A time of the interface, to the minute, in UTC."""
    return "-" if time is None else time[:16].replace("T", " ")


def state_of(campaign: Document) -> str:
    """Whether results use a campaign and, where not, why."""
    if campaign["state"] == "withdrawn":
        if campaign["discarded_at"] is not None:
            return f"discarded: {campaign['withdraw_reason']}"
        return f"withdrawn: {campaign['withdraw_reason']}"
    if campaign["state"] == "corrected":
        return f"corrected by {campaign['corrected_by']}"
    return "in use"
