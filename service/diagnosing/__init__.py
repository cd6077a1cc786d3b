"""Diagnoses in worker processes: the queue in the store is worked off while the server answers.

runner.py claims and keeps them alive, process.py is the runner's end of a worker, worker.py the worker itself.
"""

from service.diagnosing.runner import Runner, Terms

__all__ = ["Runner", "Terms"]
