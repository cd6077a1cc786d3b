"""A worker: one campaign in, its report or next experiment out, within a limit on memory.

It is a process that fork_server.py forks for one job, so that nothing of a job is left for the next.

Standard input: a line of JSON (`Job`), then the campaign (`campaign/1`), then nothing until the runner ends: a worker
whose runner is gone ends too. Standard output: a line of JSON for each progress, then one with the report and one with
its figures, or one with the plan where the job has limits of a rig, or one with the error.
"""

import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, BinaryIO

import orjson

if TYPE_CHECKING:
    from underskin.surrogate.sigma_table import SigmaTable

_FEW_NUMBERS: dict[str, Any] = {
    "schema": "campaign/1",
    "name": "a few numbers",
    "skin": {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16.0,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": 1.5,
        "sensors": [{"id": "s", "x_mm": 0.0, "y_mm": 0.0}],
    },
    "recordings": [
        {
            "id": str(number),
            "sensor": "s",
            "indenter_radius_mm": 4.0,
            "preload_n": 0.5 + number / 2,
            "dynamic_force_n": 0.05,
            "frequency_hz": [1.0, 3.0, 10.0, 30.0, 100.0],
            "frf_re_pc_per_n": [6.0, 6.01, 6.0, 6.02, 5.99],
            "frf_im_pc_per_n": [0.0, 0.01, 0.0, -0.01, 0.01],
        }
        for number in range(4)
    ],
}


@dataclass(frozen=True)
class Job:
    """What a worker needs beside the campaign: where its bytes end, the table's hash, what was left out and why.

    With `limits` (of `RigLimits`, by name) it plans the next experiment within them, and makes no report. Mechanisms
    `without` which it is to be explained are left out.
    """

    campaign_bytes: int
    table_sha256: str
    memory_bytes: int
    excluded: tuple[tuple[str, str], ...]
    limits: dict[str, Any] | None = None
    without: tuple[str, ...] = ()

    def line(self) -> bytes:
        """As the worker reads it."""
        return orjson.dumps(asdict(self), option=orjson.OPT_APPEND_NEWLINE)


def work(table: "SigmaTable | None", problem: str) -> None:
    """The job on standard input; `problem` says why there is no table."""
    from underskin.errors import UnderskinError

    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints is no answer

    def say(message: dict[str, Any]) -> None:
        answers.write(orjson.dumps(message, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE))

    stdin = os.fdopen(0, "rb", closefd=False)
    line = stdin.readline()
    if not line:
        return  # the server ended before there was a job
    job = Job(**orjson.loads(line))
    campaign = stdin.read(job.campaign_bytes)
    threading.Thread(target=_end_with_the_runner, args=(stdin,), daemon=True).start()
    if table is None:
        say({"error": problem})
        return
    try:
        _work(job, campaign, table, say)
    except UnderskinError as error:
        say({"error": str(error)})
    except MemoryError:
        say({"error": f"it takes more than {job.memory_bytes / 1e6:g} MB of memory (UNDERSKIN_DIAGNOSIS_MEMORY_MB)"})


def warm_up(table: "SigmaTable") -> None:
    """Diagnose a few numbers, so that what is loaded at its first use is loaded before the first job."""
    from underskin.diagnosis.pipeline import diagnose
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report
    from underskin.recordings.campaign import parse

    diagnosis = diagnose(parse(_FEW_NUMBERS), table)
    for figure in figures(diagnosis, report(diagnosis)).values():
        figure.to_json()


def _work(job: Job, campaign: bytes, table: "SigmaTable", say: Callable[[dict[str, Any]], None]) -> None:
    """The report, with what was left out of it among the findings; then the figures, without which it is kept too."""
    from underskin.diagnosis.pipeline import diagnose
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report
    from underskin.errors import TableError
    from underskin.findings.codes import Reason
    from underskin.findings.finding import Finding
    from underskin.mechanisms.registry import CATALOGUE
    from underskin.parallel import limit_process
    from underskin.recordings.campaign import parse

    if table.sha256 != job.table_sha256:
        raise TableError(f"{sys.argv[1]} changed since the server started: restart it")
    CATALOGUE.reload()  # the lab's own may have changed since the fork server loaded them
    CATALOGUE.load()
    limit_process(job.memory_bytes)
    limits = RigLimits(**job.limits or {})
    diagnosis = diagnose(parse(_read(campaign)), table, lambda share: say({"progress": share}), limits, job.without)
    if job.limits is not None:
        say({"plan": diagnosis.next_experiment})
        return
    document = report(diagnosis)
    left_out = [
        Finding(Reason.EXCLUDED, name, "", {"excluded_for": reason}).in_report() for name, reason in job.excluded
    ]
    say({"report": {**document, "findings": left_out + list(document["findings"])}})
    say({"figures": {name: figure.to_json() for name, figure in figures(diagnosis, document).items()}})


def _read(campaign: bytes) -> Any:
    """The campaign's JSON, which the server has written: where it cannot be read, memory is short."""
    try:
        return orjson.loads(campaign)
    except orjson.JSONDecodeError as error:
        raise MemoryError from error


def _end_with_the_runner(stdin: BinaryIO) -> None:
    with suppress(OSError):
        stdin.read(1)
    os._exit(1)
