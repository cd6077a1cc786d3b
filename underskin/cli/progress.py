"""Progress in bytes, on a terminal; nothing is written to a pipe."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


def byte_progress() -> "Progress":
    """A progress bar on standard error: bytes done, total, rate."""
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    console = Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn()
    # In a terminal, the bar redirects the output to stay below it; a pipe must get the output itself.
    return Progress(*columns, console=console, disable=not console.is_terminal, redirect_stdout=sys.stdout.isatty())


@contextmanager
def byte_steps() -> Iterator[Callable[[str, int, int | None], None]]:
    """A bar for each step of a task; the function takes the step's name, its bytes so far and, where known, in all."""
    with byte_progress() as bar:
        tasks: dict[str, TaskID] = {}

        def advance(step: str, done: int, of: int | None) -> None:
            if step not in tasks:
                tasks[step] = bar.add_task(step, total=None)
            bar.update(tasks[step], completed=done, total=of)

        yield advance
