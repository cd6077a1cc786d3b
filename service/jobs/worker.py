"""The worker process: one campaign in, its report or next experiment out, at the lowest priority and within a limit on
memory.

It is started ahead of its job, and has loaded the program and the table (its argument) when that comes. Its name in a
list of processes says which: `underskin-ready`, then `underskin-works`.

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
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import orjson

if TYPE_CHECKING:
    from underskin.surrogate.sigma_table import SigmaTable

_NICENESS = 10
_LOADED = "underskin.diagnosis.pipeline", "underskin.diagnosis.reporting.figures"  # ahead of the job


@dataclass(frozen=True)
class Job:
    """What a worker needs beside the campaign: where its bytes end, the table's hash, what was left out and why.

    With `limits` (of `RigLimits`, by name) it plans the next experiment within them, and makes no report.
    """

    campaign_bytes: int
    table_sha256: str
    memory_bytes: int
    excluded: tuple[tuple[str, str], ...]
    limits: dict[str, Any] | None = None

    def line(self) -> bytes:
        """As the worker reads it."""
        return orjson.dumps(asdict(self), option=orjson.OPT_APPEND_NEWLINE)


def main() -> None:
    """The process."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints is no answer

    def say(message: dict[str, Any]) -> None:
        answers.write(orjson.dumps(message, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE))

    os.nice(_NICENESS)
    _be_called("underskin-ready")
    for module in _LOADED:
        import_module(module)
    from underskin.compiled import load_all
    from underskin.errors import UnderskinError
    from underskin.surrogate.sigma_table import load_table

    load_all()
    try:
        table = load_table(Path(sys.argv[1]))
        problem = ""
    except UnderskinError as error:
        problem = str(error)
    line = sys.stdin.buffer.readline()
    if not line:
        return  # the server ended before there was a job
    job = Job(**orjson.loads(line))
    _be_called("underskin-works")
    campaign = sys.stdin.buffer.read(job.campaign_bytes)
    threading.Thread(target=_end_with_the_runner, args=(sys.stdin.buffer,), daemon=True).start()
    if problem:
        say({"error": problem})
        return
    try:
        _work(job, campaign, table, say)
    except UnderskinError as error:
        say({"error": str(error)})
    except MemoryError:
        say({"error": f"it takes more than {job.memory_bytes / 1e6:g} MB of memory (UNDERSKIN_DIAGNOSIS_MEMORY_MB)"})


def _be_called(name: str) -> None:
    """Of this process, in lists of processes; at most 15 characters."""
    with suppress(OSError):
        Path("/proc/self/comm").write_text(name)


def _work(job: Job, campaign: bytes, table: "SigmaTable", say: Callable[[dict[str, Any]], None]) -> None:
    """The report, with what was left out of it among the findings; then the figures, without which it is kept too."""
    from underskin.diagnosis.pipeline import diagnose
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report
    from underskin.errors import TableError
    from underskin.findings.codes import Reason
    from underskin.findings.finding import Finding
    from underskin.parallel import limit_process
    from underskin.recordings.campaign import parse

    if table.sha256 != job.table_sha256:
        raise TableError(f"{sys.argv[1]} changed since the server started: restart it")
    limit_process(job.memory_bytes)
    limits = RigLimits(**job.limits or {})
    diagnosis = diagnose(parse(orjson.loads(campaign)), table, lambda share: say({"progress": share}), limits)
    if job.limits is not None:
        say({"plan": diagnosis.next_experiment})
        return
    document = report(diagnosis)
    left_out = [
        Finding(Reason.EXCLUDED, name, "", {"excluded_for": reason}).in_report() for name, reason in job.excluded
    ]
    say({"report": {**document, "findings": left_out + list(document["findings"])}})
    say({"figures": {name: figure.to_json() for name, figure in figures(diagnosis, document).items()}})


def _end_with_the_runner(stdin: BinaryIO) -> None:
    with suppress(OSError):
        stdin.read(1)
    os._exit(1)


if __name__ == "__main__":
    main()
