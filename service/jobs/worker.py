"""The worker process: one campaign in, its report or next experiment out, at the lowest priority and within a limit on
memory.

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
from pathlib import Path
from typing import Any, BinaryIO

import orjson

_NICENESS = 10


@dataclass(frozen=True)
class Job:
    """What a worker needs beside the campaign: where its bytes end, the table to use, what was left out and why.

    With `limits` (of `RigLimits`, by name) it plans the next experiment within them, and makes no report.
    """

    campaign_bytes: int
    table: str
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
    job = Job(**orjson.loads(sys.stdin.buffer.readline()))
    campaign = sys.stdin.buffer.read(job.campaign_bytes)
    threading.Thread(target=_end_with_the_runner, args=(sys.stdin.buffer,), daemon=True).start()
    from underskin.errors import UnderskinError

    try:
        _work(job, campaign, say)
    except UnderskinError as error:
        say({"error": str(error)})
    except MemoryError:
        say({"error": f"it takes more than {job.memory_bytes / 1e6:g} MB of memory (UNDERSKIN_DIAGNOSIS_MEMORY_MB)"})


def _work(job: Job, campaign: bytes, say: Callable[[dict[str, Any]], None]) -> None:
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
    from underskin.surrogate.sigma_table import load_table

    table = load_table(Path(job.table))
    if table.sha256 != job.table_sha256:
        raise TableError(f"{job.table} changed since the server started: restart it")
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
