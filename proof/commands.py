"""`underskin prove`: the diagnosis judged on campaigns whose answer it cannot know, and the page about it."""

import os
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from proof.progress import progress_bars


def prove(
    part: Annotated[
        list[str] | None,
        typer.Argument(
            help="open, sealed, recordings, paper, mixture, ceiling, quiet, curves, quiet_curves, unlisted, "
            "quiet_unlisted, left_out, joint, wrong_modulus, slips, search, coverage, sensitivity, solved_contact; "
            "default: all."
        ),
    ] = None,
    count: Annotated[int | None, typer.Option(min=1, help="Campaigns of each part at most; default: all.")] = None,
    workers: Annotated[int, typer.Option(min=0, help="Processes; 0 is one for each core.")] = 0,
    work_dir: Annotated[
        Path, typer.Option(help="Where single answers are kept, so that a stopped run resumes.")
    ] = Path("build/proof"),
    results_dir: Annotated[
        Path, typer.Option(help="Where each finished part is kept; the page is made of them.")
    ] = Path("proof/results"),
    docs_dir: Annotated[Path, typer.Option(help="Where proof.md and its figures are written.")] = Path("docs"),
) -> None:
    """Judge the diagnosis, part by part, and write docs/proof.md from every stored part."""
    if find_spec("matplotlib") is None:
        typer.echo(
            "underskin: Figures of the proof need matplotlib, which is not installed: run `make proof`, or "
            "`pip install -e '.[docs]'`.",
            err=True,
        )
        raise typer.Exit(1)
    from proof.page import write_page
    from proof.results import PARTS, stored_parts, work_out
    from proof.stored import Work

    for name in part or ():
        if name not in PARTS:
            raise typer.BadParameter(f"{name!r}: must be one of {', '.join(PARTS)}", param_hint="PART")
    work = Work(work_dir, workers or os.cpu_count() or 1, count)
    written: list[Path] = []
    with progress_bars() as bar:
        for name in part or PARTS:
            work_out(name, work, results_dir, bar(name))
            # After each part, so that a stopped run leaves a page.
            written = write_page(stored_parts(results_dir), docs_dir)
    for path in written:
        typer.echo(str(path))
