"""The store: a campaign of the paper's array posted, stored and inverted; lists and histories of a full store.

The full store, 1,000,000 recordings of 60 lines, is made with UNDERSKIN_SOAK=1 (about 10 minutes); otherwise 50,000.
"""

import os
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bench import servers
from bench.figures import Figure, seconds
from underskin import Indenter, Skin, load_table, transmission

SENSORS, PRELOADS, RADII = 41, np.linspace(0.5, 3.0, 8), (4.0, 10.0)
RECORDINGS = SENSORS * len(PRELOADS) * len(RADII)
SKINS = 25
STORED = 1_000_000 if os.environ.get("UNDERSKIN_SOAK") == "1" else 50_000
ROUNDS = 3


def measure() -> list[Figure]:
    """Time from the first byte of a POST to its d33; time to list, and memory, with a full store."""
    with tempfile.TemporaryDirectory() as folder, servers.underskin(Path(folder)) as server:
        inverted = [_posted_and_inverted(server, campaign(lines=400)) for _ in range(ROUNDS)]
        before = server.resident_mb()
        count = max(1, STORED // RECORDINGS)
        for number in range(count):
            server.post(f"/v1/campaigns?skin=palm-{number % SKINS}", campaign(lines=60, seed=number))
        stored = f"with {count * RECORDINGS:,} recordings of 60 lines kept"
        latest = median(_milliseconds(server, "/v1/campaigns?skin=palm-3&limit=1") for _ in range(9))
        history = median(_milliseconds(server, "/v1/skins/palm-3/history") for _ in range(9))
        grown = server.resident_mb() - before
    return [
        Figure(f"Campaign of {RECORDINGS} × 400 lines posted, kept, inverted", median(inverted), "s", 3.0, "lower"),
        Figure(f"A skin's latest campaign, {stored}", latest, "ms", 100.0, "lower"),
        Figure(f"A skin's history, {stored}", history, "ms", 100.0, "lower"),
        Figure(f"Memory grown, {stored}", grown, "MB"),
    ]


def campaign(lines: int, sensors: int = SENSORS, preloads: int = len(PRELOADS), seed: int = 8) -> dict[str, Any]:
    """The paper's array, or a part of it, simulated: sensor spread 5 %, gain scatter 2 %, line noise 1 %."""
    loads = PRELOADS[:: len(PRELOADS) // preloads]
    generator = np.random.default_rng(seed)
    skin = Skin.from_lab(thickness_mm=2.5, youngs_modulus_mpa=16.0, sensor_radius_mm=1.5)
    frequency = np.linspace(1.0, 400.0, lines).tolist()
    recordings = []
    for radius in RADII:
        reached = transmission(load_table(), skin, Indenter.from_lab(indenter_radius_mm=radius), loads)
        for sensor in range(sensors):
            level = reached.frf(14.0 * generator.normal(1, 0.05)) * generator.lognormal(0, 0.02, len(loads))
            for preload, plateau in zip(loads.tolist(), level.tolist(), strict=True):
                recordings.append(
                    {
                        "id": f"s{sensor:02d}-{radius:g}mm-{preload:.2f}N",
                        "sensor": f"s{sensor:02d}",
                        "indenter_radius_mm": radius,
                        "preload_n": preload,
                        "dynamic_force_n": 0.09,
                        "recorded_at": "2017-05-03T09:00:00Z",
                        "frequency_hz": frequency,
                        "frf_re_pc_per_n": (plateau * generator.normal(1, 0.01, lines)).tolist(),
                        "frf_im_pc_per_n": (plateau * generator.normal(0, 0.01, lines)).tolist(),
                        "coherence": [0.999] * lines,
                    }
                )
    description = {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16.0,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": 1.5,
        "sensors": [{"id": f"s{sensor:02d}", "x_mm": 8.0 * sensor, "y_mm": 0.0} for sensor in range(sensors)],
    }
    return {"schema": "campaign/1", "name": "array", "skin": description, "recordings": recordings}


def _posted_and_inverted(server: servers.Server, document: dict[str, Any]) -> float:
    start = time.perf_counter()
    stored = server.post("/v1/campaigns?skin=first", document)
    if server.get(f"/v1/campaigns/{stored['id']}/d33")["status"] != "ok":
        raise RuntimeError("no d33 from the campaign")
    return time.perf_counter() - start


def _milliseconds(server: servers.Server, path: str) -> float:
    return 1e3 * seconds(lambda: server.get(path))
