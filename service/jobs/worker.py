"""A worker process: one or several campaigns in, their report or next experiment out, within a memory limit.

fork_server.py forks one process for each job, so no state of a job reaches the next. Standard input: a line of JSON
(`Job`), then its campaigns (`campaign/1`), then nothing; a worker ends when the runner closes it. Standard output: a
line of JSON for each progress, then one with the report and, for a single campaign, one with its figures; or one with
the plan if the job has limits of a rig; or one with the error.
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

# A campaign that can be diagnosed, of which nothing can be concluded.
FEW_NUMBERS: dict[str, Any] = {
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
    """A campaign of a job: its skin, the size of its document in bytes, and excluded recordings with the reasons."""

    skin_id: str
    size: int
    excluded: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class Job:
    """What a worker needs besides the campaigns: a `Part` for each, the table's hash, and limits on memory and CPU
    time.

    With `limits` (of `RigLimits`, by name) it plans the next experiment within them and makes no report. The mechanisms
    `without` are not used to explain the data. The report of several campaigns, of one skin or of a fleet (`kind`), has
    the name `name`.
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
        """As one line of JSON."""
        return orjson.dumps(asdict(self), option=orjson.OPT_APPEND_NEWLINE)

    @classmethod
    def read(cls, line: bytes) -> "Job":
        """The inverse of `line`."""
        fields = orjson.loads(line)
        return cls(**{**fields, "parts": [Part(**part) for part in fields["parts"]]})


def work(table: "SigmaTable | None", problem: str) -> None:
    """Do the job on standard input; `problem` says why there is no table."""
    from underskin.errors import UnderskinError

    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # output that a library prints is no answer

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
    """Diagnose a few numbers, so that lazily loaded code is loaded before the first job."""
    from underskin.diagnosis.pipeline import diagnose
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import report
    from underskin.recordings.campaign import parse

    diagnosis = diagnose(parse(FEW_NUMBERS), table)
    for figure in figures(diagnosis, report(diagnosis)).values():
        figure.to_json()


def _work(job: Job, documents: Sequence[bytes], table: "SigmaTable", send_message: SendMessage) -> None:
    """The report, with exclusions among its findings, within the memory limit."""
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
    """Diagnose one campaign; its figures follow the report, which is stored even without them."""
    from underskin.diagnosis.pipeline import diagnose, with_refused
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.diagnosis.reporting.figures import figures
    from underskin.diagnosis.reporting.report import next_experiment, report

    limits = RigLimits(**job.limits or {})
    diagnosis = diagnose(reading.campaign, table, lambda share: send_message({"progress": share}), limits, job.without)
    if job.limits is not None:
        send_message({"plan": next_experiment(diagnosis)})
        return
    diagnosis = with_refused(diagnosis, reading.problems)
    document = report(diagnosis)
    send_message({"report": _with_exclusions(job, document, [reading])})
    send_message({"figures": {name: figure.to_json() for name, figure in figures(diagnosis, document).items()}})


def _together(
    job: Job, readings: "Sequence[Reading]", table: "SigmaTable", send_message: SendMessage
) -> dict[str, Any]:
    """The report on several campaigns of a skin, or on those of a fleet."""
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
    """A report whose findings start with the recordings excluded beforehand; for several campaigns each finding names
    its campaign, and rejected recordings follow."""
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
    """A campaign's JSON as written by the server: if it cannot be read, memory was short (MemoryError)."""
    try:
        return orjson.loads(document)
    except orjson.JSONDecodeError as error:
        raise MemoryError from error


def _end_with_the_runner(stdin: BinaryIO) -> None:
    with suppress(OSError):
        stdin.read(1)
    os._exit(1)
