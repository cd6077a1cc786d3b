"""A sweep: independent pieces of work on all cores or on a cluster, each stored on the disk as soon as it is done.

A piece's result is a dictionary of arrays in one file beside the table, written atomically, so that a sweep that was
killed resumes; results do not depend on who computed them or in which order. The folder's
name holds a hash of the sources and settings: pieces of another version are never mixed in.
"""

import inspect
import multiprocessing
import os
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from underskin.errors import SolverError, UnderskinError
from underskin.source_digest import source_digest
from underskin.units import Floats

Arrays = Mapping[str, Floats]
Piece = Callable[[], Arrays]


def sources_hash(modules: Sequence[ModuleType]) -> str:
    """SHA-256 of the sources that decide a table's numbers (`underskin.source_digest`)."""
    return source_digest({module.__name__: inspect.getsource(module) for module in modules})


def run_pieces(
    pieces: Mapping[str, Piece], folder: Path, scheduler: str | None = None, title: str = "solving"
) -> dict[str, Arrays]:
    """The results of all pieces by name, taken from `folder` where they are already there.

    Raises SolverError as soon as a piece fails; what is done stays in the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    done = {name: stored for name in pieces if (stored := _load(folder / f"{name}.npz")) is not None}
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns) as progress, _executor(scheduler) as executor:
        bar = progress.add_task(title, total=len(pieces), completed=len(done))
        running = {executor.submit(piece): name for name, piece in pieces.items() if name not in done}
        try:
            for future in as_completed(running):
                name = running[future]
                done[name] = future.result()
                _save(folder / f"{name}.npz", done[name])
                progress.advance(bar)
        except BaseException as error:
            for future in running:
                future.cancel()
            if isinstance(error, Exception) and not isinstance(error, UnderskinError):
                raise SolverError(f"a worker failed at {name}: {error}") from error
            raise
    return done


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """Processes on all cores, or a Dask cluster through the same interface."""
    if scheduler is None:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as executor:
            yield executor
        return
    from distributed import Client

    with Client(scheduler) as client, client.get_executor(pure=False) as executor:
        yield executor


def _save(path: Path, arrays: Arrays) -> None:
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **dict(arrays))
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


def _load(path: Path) -> Arrays | None:
    """The arrays of a finished piece; None when it is not there or does not read back whole."""
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            return dict(file)
    except (FileNotFoundError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None
