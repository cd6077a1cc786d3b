"""A worker: campaigns in, one or several, their report or next experiment out, within a limit on memory.

It is a process that fork_server.py forks for one job, so that nothing of a job is left for the next.

Standard input: a line of JSON (`Job`), then its campaigns (`campaign/1`), then nothing until the runner ends: a worker
whose runner is gone ends too. Standard output: a line of JSON for each progress, then one with the report and, of one
campaign, one with its figures, or one with the plan where the job has limits of a rig, or one with the error.
"""

import math
import os
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, BinaryIO

import orjson

from service.schemas.diagnoses import DiagnosisKind

if TYPE_CHECKING:
    from underskin.recordings.campaign import Campaign
    from underskin.recordings.reading import Reading
    from underskin.surrogate.sigma_table import SigmaTable

SendMessage = Callable[[dict[str, Any]], None]

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
class Part:
    """A campaign of a job: its skin, how many bytes its document has, and what was left out of it and why."""

    skin_id: str
    size: int
    excluded: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class Job:
    """What a worker needs beside the campaigns: what each of them is, the table's hash, the memory and the time on a
    processor that it may take.

    With `limits` (of `RigLimits`, by name) it plans the next experiment within them, and makes no report. Mechanisms
    `without` which it is to be explained are left out. Where it is of several campaigns, of one skin or of a fleet by
    `kind`, the report bears `name`.
    """

    parts: Sequence[Part]
    table_sha256: str
    memory_bytes: int
    cpu_seconds: float
    limits: dict[str, Any] | None = None
    without: Sequence[str] = ()
    kind: DiagnosisKind = "campaign"
    name: str | None = None

    def line(self) -> bytes:
        """As the worker reads it."""
        return orjson.dumps(asdict(self), option=orjson.OPT_APPEND_NEWLINE)

    @classmethod
    def read(cls, line: bytes) -> "Job":
        """The inverse of `line`."""
        fields = orjson.loads(line)
        return cls(**{**fields, "parts": [Part(**part) for part in fields["parts"]]})


def work(table: "SigmaTable | None", problem: str) -> None:
    """The job on standard input; `problem` says why there is no table."""
    from underskin.errors import UnderskinError

    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints is no answer

    def send_message(message: dict[str, Any]) -> None:
        answers.write(orjson.dumps(message, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE))

    stdin = os.fdopen(0, "rb", closefd=False)
    line = stdin.readline()
    if not line:
        return  # the server ended before there was a job
    job = Job.read(line)
    documents = [stdin.read(part.size) for part in job.parts]
    threading.Thread(target=_end_with_the_runner, args=(stdin,), daemon=True).start()
    if table is None:
        send_message({"error": problem})
        return
    try:
        _work(job, documents, table, send_message)
    except UnderskinError as error:
        send_message({"error": str(error)})
    except MemoryError:
        send_message(
            {"error": f"it takes more than {job.memory_bytes / 1e6:g} MB of memory (UNDERSKIN_DIAGNOSIS_MEMORY_MB)"}
        )


def warm_up(table: "SigmaTable") -> None:
    """Diagnose a few numbers, so that what is loaded at its first use is loaded before the first job."""
    from underskin.diagnosis.pipeline import diagnose
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report
    from underskin.recordings.campaign import parse

    diagnosis = diagnose(parse(_FEW_NUMBERS), table)
    for figure in figures(diagnosis, report(diagnosis)).values():
        figure.to_json()


def _work(job: Job, documents: Sequence[bytes], table: "SigmaTable", send_message: SendMessage) -> None:
    """The report, with what was left out of it among the findings, within the limit on memory."""
    from underskin.errors import TableError
    from underskin.mechanisms.registry import CATALOGUE
    from underskin.parallel import limit_process
    from underskin.recordings.campaign import from_dict
    from underskin.recordings.reading import Reading

    if table.sha256 != job.table_sha256:
        raise TableError(f"{sys.argv[1]} changed since the server started: restart it")
    CATALOGUE.reload()  # the lab's own may have changed since the fork server loaded them
    limit_process(job.memory_bytes, cpu_seconds=math.ceil(job.cpu_seconds))
    readings = [Reading(*from_dict(_read(document)), []) for document in documents]  # an older server read otherwise
    if job.kind == "campaign":
        _diagnose(job, readings[0], table, send_message)
    else:
        send_message({"report": _with_exclusions(job, _together(job, readings, table, send_message), readings)})


def _diagnose(job: Job, reading: "Reading", table: "SigmaTable", send_message: SendMessage) -> None:
    """One campaign; its figures come after the report, which is kept without them too."""
    from underskin.diagnosis.pipeline import diagnose, with_refused
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report

    limits = RigLimits(**job.limits or {})
    diagnosis = diagnose(reading.campaign, table, lambda share: send_message({"progress": share}), limits, job.without)
    if job.limits is not None:
        send_message({"plan": diagnosis.next_experiment})
        return
    diagnosis = with_refused(diagnosis, reading.problems)
    document = report(diagnosis)
    send_message({"report": _with_exclusions(job, document, [reading])})
    send_message({"figures": {name: figure.to_json() for name, figure in figures(diagnosis, document).items()}})


def _together(
    job: Job, readings: "Sequence[Reading]", table: "SigmaTable", send_message: SendMessage
) -> dict[str, Any]:
    """The report of several campaigns of a skin, or of those of a fleet."""
    name = job.name or ""
    campaigns = [reading.campaign for reading in readings]

    def progress(share: float) -> None:
        send_message({"progress": share})

    if job.kind == "skin":
        from underskin.diagnosis.several.campaigns import diagnose_together

        return diagnose_together(campaigns, table, name, job.without, progress)
    from underskin.diagnosis.several.fleet import diagnose_fleet

    skins: dict[str, list[Campaign]] = {}
    for part, campaign in zip(job.parts, campaigns, strict=True):
        skins.setdefault(part.skin_id, []).append(campaign)
    return diagnose_fleet(skins, table, name, job.without, progress)


def _with_exclusions(job: Job, document: dict[str, Any], readings: "Sequence[Reading]") -> dict[str, Any]:
    """A report whose findings begin with the recordings that had been excluded; of several campaigns with its name, and
    with those that are refused."""
    from underskin.diagnosis.pipeline import refused
    from underskin.findings.codes import Reason
    from underskin.findings.finding import Finding

    exclusions = [
        (reading.campaign.name, Finding(Reason.EXCLUDED, recording, "", {"excluded_for": reason}).in_report())
        for part, reading in zip(job.parts, readings, strict=True)
        for recording, reason in part.excluded
    ]
    if job.kind != "campaign":
        exclusions += [
            (reading.campaign.name, refusal.in_report())
            for reading in readings
            for refusal in refused(reading.problems)
        ]
    sentences = [
        finding if job.kind == "campaign" else {**finding, "statement": f"{name}: {finding['statement']}"}
        for name, finding in exclusions
    ]
    return {**document, "findings": sentences + list(document["findings"])}


def _read(document: bytes) -> Any:
    """A campaign's JSON, which the server has written: where it cannot be read, memory is short."""
    try:
        return orjson.loads(document)
    except orjson.JSONDecodeError as error:
        raise MemoryError from error


def _end_with_the_runner(stdin: BinaryIO) -> None:
    with suppress(OSError):
        stdin.read(1)
    os._exit(1)
