"""Diagnoses in worker processes: the queue in the store is worked off while the server answers.

runner.py claims and keeps them alive, process.py is the server's end of a worker, worker.py the worker itself;
planner.py plans next experiments within a rig's limits, which are not kept.
"""

from service.jobs.planner import Planner
from service.jobs.process import WorkerProcesses
from service.jobs.runner import Runner

__all__ = ["Planner", "Runner", "WorkerProcesses"]
