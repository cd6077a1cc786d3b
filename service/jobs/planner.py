"""Next experiments within the limits of a rig, each planned in a worker process, one at a time.

Plans are not stored: a server caches the latest, and computes them again after a restart.
"""

import threading
import time
from collections import OrderedDict
from dataclasses import asdict, dataclass
from queue import SimpleQueue
from typing import Any, Literal

from service.jobs.process import CampaignInput, WorkerProcesses
from service.log import logger
from service.problems import Refusal
from service.store import AnyRow, Database, diagnoses
from underskin.diagnosis.planning.rig_limits import RigLimits

_REMEMBERED = 50
_MOST_WAITING = 8
_JOIN_S = 10.0
_RETRY_S = 60.0  # how long a failure is answered before the plan is tried again


@dataclass
class Planned:
    """One plan; `plan` is empty if no experiment would separate the explanations better."""

    state: Literal["queued", "running", "done", "failed"] = "queued"
    progress: float = 0.0
    plan: dict[str, Any] | None = None
    reason: str = ""
    failed_at: float = 0.0

    def fail(self, reason: str) -> None:
        """End it without a plan."""
        self.reason, self.failed_at, self.state = reason, time.monotonic(), "failed"


class Planner:
    """Plans next experiments one after another until `stop`, and caches the latest."""

    def __init__(self, store: Database, processes: WorkerProcesses, workers: int) -> None:
        """`workers`: 0 where this server runs no diagnoses and plans nothing."""
        self._store = store
        self._processes = processes
        self._workers = workers
        self._plans: OrderedDict[tuple[str, str], Planned] = OrderedDict()
        self._lock = threading.Lock()
        self._waiting: SimpleQueue[tuple[AnyRow, RigLimits, Planned] | None] = SimpleQueue()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="planning", daemon=True)

    def plan(self, row: AnyRow, limits: RigLimits) -> Planned:
        """The plan of a diagnosis within these limits; computed if it is not cached, or failed over a minute ago.
        Raises Refusal 503 if too many are waiting, or if this server runs no diagnoses."""
        key = (str(row.id), repr(limits))
        with self._lock:
            remembered = self._plans.get(key)
            if remembered is not None and (
                remembered.state != "failed" or time.monotonic() < remembered.failed_at + _RETRY_S
            ):
                self._plans.move_to_end(key)
                return remembered
            if not self._workers:
                raise Refusal(503, "This server runs no diagnoses and plans nothing; use the command below.")
            if sum(job.state in ("queued", "running") for job in self._plans.values()) >= _MOST_WAITING:
                raise Refusal(503, "Many plans are being worked out: try again in a minute.")
            planned = self._plans[key] = Planned()
            while len(self._plans) > _REMEMBERED:
                self._plans.popitem(last=False)
            self._waiting.put((row, limits, planned))
            if self._thread.ident is None:
                self._thread.start()
        return planned

    def stop(self) -> None:
        """Stop the computation under way."""
        self._ending.set()
        self._waiting.put(None)
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _work(self) -> None:
        while (waiting := self._waiting.get()) is not None and not self._ending.is_set():
            row, limits, planned = waiting
            try:
                self._run(row, limits, planned)
            except Exception as error:  # the thread has no caller to raise to
                logger.exception("a plan could not be made", extra={"fields": {"diagnosis": row.id}})
                planned.fail(f"{type(error).__name__}: {error}")

    def _run(self, row: AnyRow, limits: RigLimits, planned: Planned) -> None:
        planned.state = "running"
        campaign, _ = self._store.read(diagnoses.campaign_of, row)
        without = diagnoses.without(row)
        given = [CampaignInput.of(campaign, row.skin_id)]
        with self._processes.at_work(given, limits=asdict(limits), without=without) as worker:
            while not (worker.ended or self._ending.is_set()):
                worker.news.wait(0.5)
                planned.progress = worker.messages["progress"]
            if "plan" in worker.messages:
                planned.plan, planned.state = worker.messages["plan"], "done"
            else:
                planned.fail(worker.failure if worker.ended else "the server ended")
