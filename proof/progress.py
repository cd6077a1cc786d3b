"""Progress of long runs: a bar for each part, or lines without a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

OnProgress = Callable[[int, int], None]


@contextmanager
def progress_bars() -> Iterator[Callable[[str], OnProgress]]:
    """A function that makes a named bar; the bar is called with the number done and the total."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, TextColumn("left"), TimeRemainingColumn(), console=Console(stderr=True)) as bars:
        yield lambda name: partial(_update, bars, bars.add_task(name, total=None))


def _update(bars: Progress, task: TaskID, done: int, total: int) -> None:
    bars.update(task, completed=done, total=total)
    if not bars.console.is_terminal:
        typer.echo(f"{bars.tasks[task].description}: {done} of {total}", err=True)
