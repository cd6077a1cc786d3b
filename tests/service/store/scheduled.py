"""Servers that make backups on a schedule, and what `underskin doctor` says of a store."""

import json
from pathlib import Path
from typing import Any

from service.usecases.scheduled_backups import stored_backups
from tests.service.waiting import until
from tests.support.store_server import Place

NO_WORKERS = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}


def scheduled(folder: Path, **settings: str) -> dict[str, str]:
    return {**NO_WORKERS, "UNDERSKIN_BACKUP_TO": str(folder), **settings}


def wait_for(folder: Path, count: int) -> list[Path]:
    """Until there are so many backups, or more."""

    def found() -> list[Path]:
        return [entry.path for entry in stored_backups(folder)] if folder.is_dir() else []

    until(lambda: len(found()) >= count, found)
    return found()


def doctor(place: Place, **settings: str) -> tuple[int, dict[str, dict[str, Any]]]:
    """Exit status, and the worst finding of each check."""
    done = place.command("doctor", "--json", **settings)
    assert done.stdout, done.stderr
    levels = ("ok", "warning", "critical")
    findings: dict[str, dict[str, Any]] = {}
    for entry in json.loads(done.stdout):
        worst = findings.get(entry["check"])
        if worst is None or levels.index(entry["level"]) > levels.index(worst["level"]):
            findings[entry["check"]] = entry
    return done.returncode, findings
