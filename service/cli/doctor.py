"""The command that looks for what keeps a server from its work."""

import json
from typing import Annotated

import typer

from service.cli.shared import read_settings, use_folder_of_lab
from service.jobs.process import CampaignInput, WorkerProcesses
from service.jobs.worker import FEW_NUMBERS
from service.settings import Settings
from service.usecases.checkup import Level, Observation, examine
from underskin.surrogate.sigma_table import SIGMA_TABLE, load_table

_LIMIT_S = 120.0
_MARKS = {Level.OK: "ok", Level.WARNING: "warning", Level.CRITICAL: "CRITICAL"}


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, for programs.")] = False,
) -> None:
    """Look at store, disk, tables, keys, backups, clock and workers; say what is wrong and what to do.

    The exit status is that of monitoring systems: 0 where all is well, 1 with warnings, 2 where something keeps the
    server from its work or endangers what it keeps.
    """
    settings = read_settings()  # one that is wrong ends this with 2 as well: no server starts with it
    use_folder_of_lab(settings)
    findings = list(examine(settings))
    tables = next(observation for observation in findings if observation.check == "tables")
    findings.append(_of_workers(settings, has_tables=tables.level is Level.OK))
    if as_json:
        entries = [
            {
                "check": observation.check,
                "level": observation.level.name.lower(),
                "found": observation.found,
                "advice": observation.advice,
            }
            for observation in findings
        ]
        typer.echo(json.dumps(entries, indent=1, ensure_ascii=False))
    else:
        for observation in findings:
            advice = f"\n{'':31}→ {observation.advice}" if observation.advice else ""
            typer.echo(f"{_MARKS[observation.level]:>9}  {observation.check:20}{observation.found}{advice}")
    raise typer.Exit(max(observation.level for observation in findings))


def _of_workers(settings: Settings, *, has_tables: bool) -> Observation:
    """A small campaign, diagnosed in a process of its own as a server does it."""
    if settings.diagnosis_workers == 0:
        return Observation("workers", Level.OK, "this server runs no diagnoses")
    if not has_tables:
        return Observation("workers", Level.CRITICAL, "no diagnosis can be tried without tables", "see to those first")
    path = settings.tables / SIGMA_TABLE
    try:
        processes = WorkerProcesses(
            path,
            load_table(path).sha256,
            int(settings.diagnosis_memory_mb * 1e6),
            settings.diagnosis_seconds,
            keeps_ready=False,
        )
        with processes.at_work([CampaignInput(json.dumps(FEW_NUMBERS).encode(), "trial")]) as worker:
            while not worker.ended and worker.news.wait(_LIMIT_S):
                worker.news.clear()
            failure = "" if "report" in worker.messages else worker.failure if worker.ended else "it did not end"
        processes.stop()
    except OSError as error:
        failure = str(error)
    if failure:
        advice = "see the memory that is free, and UNDERSKIN_DIAGNOSIS_MEMORY_MB"
        return Observation("workers", Level.CRITICAL, f"a trial diagnosis failed: {failure}", advice)
    return Observation("workers", Level.OK, f"a trial diagnosis ended; at most {settings.diagnosis_workers} at once")
