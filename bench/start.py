"""Start of the service on one core: from launching the process to the first 200 of /ready, and its memory then."""

from statistics import median

from bench import servers
from bench.figures import Figure

ROUNDS = 5


def measure() -> list[Figure]:
    """Start time, and resident memory once the table is loaded and has answered."""
    times, memory = [], []
    for _ in range(ROUNDS):
        with servers.underskin() as server:
            times.append(server.started_in)
            server.post("/v1/sigma", {"a_over_h": [0.3], "rt_over_h": [0.6], "load_parameter": [0.01]})
            memory.append(server.resident_mb())
    return [
        Figure("Cold start to /ready", median(times), "s", 2.0, "lower"),
        Figure("Resident memory after load", max(memory), "MB", 250.0, "lower"),
    ]
