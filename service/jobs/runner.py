"""Claims diagnoses from the store's queue and runs each in a worker process, as many at once as there are cores."""

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from service.jobs.process import CampaignInput, Worker, WorkerProcesses
from service.log import LastingFailure, logger
from service.store import STORE_FAILED, AnyRow, Database, StoreMoved, diagnoses
from underskin import __version__
from underskin.mechanisms.declared.document import digest
from underskin.recordings.validation import LONGEST_NAME

_POLL_S = 2.0  # how often the queue is looked at: another server may have put something in
_BEAT_S = 2.0  # interval of heartbeats and of stored progress
_JOIN_S = 10.0
_LONG_S = 30.0  # from which on a diagnosis that runs holds up others no more
_SHORT_S = 60.0  # within which a diagnosis must end that runs in addition to as many long ones as there are workers


def basis(table_sha256: str) -> diagnoses.Basis:
    """The versions with which this server diagnoses at present."""
    return diagnoses.Basis(table_sha256, __version__, digest())


@dataclass
class _Job:
    """A diagnosis in a thread of this server; it has no worker while that starts.

    A job that is `aside` runs in addition to the regular workers while all of those are busy with long jobs, and
    returns to the queue if it takes long itself.
    """

    row: AnyRow
    thread: threading.Thread
    aside: bool
    worker: Worker | None = None
    started: float = field(default_factory=time.monotonic)

    @property
    def lasted_s(self) -> float:
        """Its running time [s]."""
        return time.monotonic() - self.started


class Runner:
    """Runs the queue in threads of the server's process, between `start` and `stop`."""

    def __init__(self, store: Database, processes: WorkerProcesses, workers: int) -> None:
        """`workers`: how many diagnoses run at once."""
        self._store = store
        self._processes = processes
        self._workers = workers
        self._server = secrets.token_hex(8)
        self._ending = threading.Event()
        self._stirred = threading.Event()
        self._jobs: dict[int, _Job] = {}  # by the diagnosis' number
        self._long: set[int] = set()  # those that had to go back into the queue
        self._lock = threading.Lock()
        self._failure = LastingFailure()
        self._dispatcher = threading.Thread(target=self._dispatch, name="diagnosing", daemon=True)

    def start(self) -> None:
        """Process the queue, including diagnoses that ran when their server ended."""
        if self._workers:
            self._dispatcher.start()

    def stir(self) -> None:
        """Check at once for new or cancelled diagnoses."""
        self._stirred.set()
        with self._lock:
            for job in self._jobs.values():
                if job.worker is not None:
                    job.worker.news.set()

    def stop(self) -> None:
        """Kill all workers; their diagnoses return to the queue."""
        self._ending.set()
        self.stir()
        if self._dispatcher.ident is not None:
            self._dispatcher.join(_JOIN_S)
        for job in self._under_way():
            job.thread.join(_JOIN_S)
        self._processes.stop()

    def _dispatch(self) -> None:
        while not self._ending.is_set():
            self._stirred.clear()
            for job in self._starting():
                self._is_ours(job.row, 0.0)  # its thread cannot say so before there is a worker
            try:
                while self._claim():
                    pass
            except STORE_FAILED as error:
                self._failure.log("no diagnosis can be claimed", error)
            # Not while one starts: it may hold for minutes the lock for which this would wait.
            if not self._stirred.wait(_POLL_S) and not self._starting():
                self._processes.get_ready()

    def _under_way(self) -> list[_Job]:
        with self._lock:
            return list(self._jobs.values())

    def _starting(self) -> list[_Job]:
        return [job for job in self._under_way() if job.worker is None]

    def _start(self, row: AnyRow, *, aside: bool) -> None:
        thread = threading.Thread(target=self._job, args=(row,), name=row.id, daemon=True)
        with self._lock:
            self._jobs[row.number] = _Job(row, thread, aside)
        try:
            thread.start()
        except RuntimeError as error:  # the system has no room for a thread now
            with self._lock:
                del self._jobs[row.number]
            self._release(row)
            raise OSError(str(error)) from error

    def _claim(self) -> bool:
        """Start the next diagnosis if there is one and a free worker or, where all workers have been busy for long, one
        aside for the smallest."""
        jobs = self._under_way()
        aside = sum(not job.aside for job in jobs) >= self._workers
        if aside and any(job.aside or job.lasted_s < _LONG_S for job in jobs):
            return False
        not_these = {job.row.number for job in jobs} | (self._long if aside else set())
        claimed_with = basis(self._processes.table_sha256)
        row = self._store.write(diagnoses.claim, self._server, claimed_with, not_these, smallest=aside)
        self._failure.is_over()
        if row is not None:
            self._start(row, aside=aside)
        return row is not None

    def _job(self, row: AnyRow) -> None:
        try:
            self._run(row)
        except StoreMoved as error:
            self._failure.log("a diagnosis cannot be run now", error)
            self._release(row)
        except Exception as error:  # the thread has no caller to raise to
            logger.exception("a diagnosis could not be run", extra={"fields": {"diagnosis": row.id}})
            self._end(row, diagnoses.fail, f"{type(error).__name__}: {error}")
        finally:
            with self._lock:
                del self._jobs[row.number]
            self._stirred.set()

    def _run(self, row: AnyRow) -> None:
        """Run a diagnosis until it has ended, another server has claimed it, or this server ends."""
        without = diagnoses.without(row)
        with self._processes.at_work(self._campaign_inputs(row), None, without, row.kind, row.name) as worker:
            with self._lock:
                job = self._jobs[row.number]
                job.worker, job.started = worker, time.monotonic()
            while not worker.ended and not self._ending.is_set():
                worker.news.wait(_BEAT_S)
                worker.news.clear()
                if not self._is_ours(row, worker.messages["progress"]):
                    return
                if job.aside and job.lasted_s > _SHORT_S and not worker.ended:
                    self._long.add(row.number)
                    break
                if job.lasted_s > self._processes.longest_s:
                    self._end(row, diagnoses.fail, worker.too_long)
                    return
            if not worker.ended:
                self._release(row)
            elif "report" in worker.messages:
                self._end(row, diagnoses.finish, worker.messages["report"], worker.messages.get("figures"))
            else:
                logger.error("a diagnosis failed", extra={"fields": {"diagnosis": row.id, "said": worker.last_words}})
                self._end(row, diagnoses.fail, worker.failure)

    def _campaign_inputs(self, row: AnyRow) -> list[CampaignInput]:
        """The campaigns of a diagnosis, read one after another; campaigns with the same name are distinguished by their
        ids."""
        members = self._store.read(diagnoses.members, row)
        names = [member.name for member in members]
        campaigns = []
        for member in members:
            campaign, excluded = self._store.read(diagnoses.as_diagnosed, member)
            if names.count(member.name) > 1:
                campaign = replace(campaign, name=f"{member.name[: LONGEST_NAME // 2]} ({member.campaign_id})")
            excluded_names = [(exclusion.recording, exclusion.reason) for exclusion in excluded]
            campaigns.append(CampaignInput.of(campaign, member.skin_id, excluded_names))
        return campaigns

    def _is_ours(self, row: AnyRow, progress: float) -> bool:
        """Renew the claim; False if it was cancelled or another server claimed it, True if the store fails."""
        try:
            ours = self._store.write(diagnoses.keep_alive, row.number, self._server, progress)
        except STORE_FAILED as error:
            self._failure.log("a diagnosis cannot be kept alive", error)
            return True
        self._failure.is_over()
        return ours

    def _end(self, row: AnyRow, change: Callable[..., bool], *outcome: Any) -> None:
        """Store the outcome, and retry if the store fails: it took long to compute."""
        while True:
            try:
                self._store.write(change, row.number, self._server, *outcome)
                return
            except STORE_FAILED as error:
                self._failure.log("what came of a diagnosis cannot be kept", error)
                if self._ending.wait(_POLL_S):
                    return

    def _release(self, row: AnyRow) -> None:
        try:
            self._store.write(diagnoses.release, row.number, self._server)
        except STORE_FAILED as error:
            self._failure.log("a diagnosis cannot be put back into the queue", error)
