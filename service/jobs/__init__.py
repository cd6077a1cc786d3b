"""Diagnoses in worker processes: the queue in the store is processed while the server answers requests.

runner.py claims diagnoses and keeps them alive, process.py is the server's side of a worker, worker.py the worker;
planner.py plans next experiments within a rig's limits, which are not stored.
"""
