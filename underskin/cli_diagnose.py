"""The commands `diagnose` and `plan`: what recordings and model disagree about, and which recordings would settle it.

`diagnose` writes one report (`report/1`) a campaign, named like its input; it uses all cores, one campaign a process,
so that the reports do not depend on how many there are.
"""

import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import typer

from underskin.errors import UnderskinError

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
Files = Annotated[list[Path], typer.Argument(help="Campaigns (campaign/1, JSON, or any format that is read).")]
Workers = Annotated[int, typer.Option(min=0, help="Processes; 0 is one for each core.")]


@dataclass(frozen=True)
class _Outcome:
    """What became of one file: its verdict, or why it could not be read."""

    file: Path
    problem: str = ""
    verdict: str = ""


def add_commands(app: typer.Typer) -> None:
    """Add both commands."""
    app.command(no_args_is_help=True)(diagnose)
    app.command(no_args_is_help=True)(plan)


def diagnose(
    files: Files,
    output_dir: Annotated[Path, typer.Option(help="Folder for the reports; made where it does not exist.")],
    workers: Workers = 0,
) -> None:
    """Where recordings and model disagree, and what physics the model left out: one report a campaign."""
    from rich.console import Console
    from rich.progress import Progress

    output_dir.mkdir(parents=True, exist_ok=True)
    unreadable = False
    console = Console(stderr=True)
    with Progress(console=console) as progress:
        bar = progress.add_task("diagnosing", total=len(files))
        for outcome in _each(files, output_dir, workers or os.cpu_count() or 1):
            progress.advance(bar)
            unreadable |= bool(outcome.problem)
            line = f"underskin: {outcome.problem}" if outcome.problem else f"{outcome.file}: {outcome.verdict}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)
    if unreadable:
        raise typer.Exit(2)


def _each(files: Sequence[Path], output_dir: Path, workers: int) -> Iterator[_Outcome]:
    if len(files) == 1 or workers == 1:
        for file in files:
            yield _one(file, output_dir)
        return
    # A fresh interpreter a process (spawn), with one BLAS thread: the same numbers whatever the number of cores.
    for name in _THREADS:
        os.environ[name] = "1"
    with ProcessPoolExecutor(min(workers, len(files)), mp_context=get_context("spawn")) as pool:
        pending: list[Future[_Outcome]] = [pool.submit(_one, file, output_dir) for file in files]
        for done in as_completed(pending):
            yield done.result()


def _one(file: Path, output_dir: Path) -> _Outcome:
    """Read, diagnose and write one campaign."""
    from underskin.diagnosis.diagnose import diagnosis_report
    from underskin.recordings import read_file
    from underskin.surrogate import load_table

    try:
        reading = read_file(file, file.name)
    except UnderskinError as error:
        return _Outcome(file, f"{file}: {' '.join(str(error).split())}")
    document = diagnosis_report(reading.campaign, load_table(), refused=reading.problems)
    write_report(document, output_dir / f"{file.stem}.json")
    return _Outcome(file, verdict=str(document["verdict"]))


def write_report(document: dict[str, Any], path: Path) -> None:
    """Write a report as JSON, the same bytes for the same report."""
    text = json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False)
    partial = path.with_name(f".{path.name}.part")
    partial.write_text(f"{text}\n", encoding="utf-8")
    partial.replace(path)


def plan(
    file: Annotated[Path, typer.Argument(help="A campaign.")],
    preload_n: Annotated[
        tuple[float, float] | None, typer.Option(help="Lowest and highest preload that the rig can hold [N].")
    ] = None,
    indenter_radius_mm: Annotated[list[float] | None, typer.Option(help="A sphere at hand [mm]; repeatable.")] = None,
    offset_mm: Annotated[
        list[float] | None, typer.Option(help="How far beside the sensor the sphere can be put [mm]; repeatable.")
    ] = None,
    dwell_s: Annotated[list[float] | None, typer.Option(help="A time to hold the preload [s]; repeatable.")] = None,
    recordings: Annotated[int, typer.Option(min=1, help="Recordings at most.")] = 8,
) -> None:
    """The recordings that best separate what a campaign leaves confusable, and the chance that they do; JSON."""
    from underskin.diagnosis.diagnose import diagnose as work_out
    from underskin.diagnosis.plan import Limits
    from underskin.recordings import read_file
    from underskin.surrogate import load_table

    campaign = read_file(file, file.name).campaign
    limits = Limits(
        preload_n=preload_n,
        indenter_radius_mm=indenter_radius_mm,
        offset_mm=offset_mm,
        dwell_s=dwell_s,
        recordings=recordings,
    )
    found = work_out(campaign, load_table(), limits=limits)
    typer.echo(json.dumps(dict(found.next_experiment), ensure_ascii=False, indent=1))
