"""The prototype's array through the service: a server of its own, asked over HTTP as a lab would ask it."""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from docs.paper.prototype import MODULUS_MPA, RHO, SENSOR_RADIUS_MM, SKIN, THICKNESS_MM
from tablegen import linear_layer
from tablegen.sigma import Nodes, solve_column
from underskin.physics import charge_response, hertz
from underskin.physics.charge_response import Indenter
from underskin.units import Floats

INDENTER_RADIUS_MM = 4.0
SENSORS = (12, 41)  # the array's sensors, at
PRELOAD_N = (1.0, 3.0)  # and what the paper reports for them:
D33_PC_PER_N = (14.0, 22.0)
_START_S = 30.0
_ORDER = 6  # of the elements of the fresh solve; the table has 5


@dataclass(frozen=True)
class ArrayRun:
    """One entry for each of the two groups of sensors; FRF and d33 in pC/N."""

    frf_from_service: Floats
    d33_from_service: Floats
    frf_from_fresh_solve: Floats
    d33_from_fresh_solve: Floats
    status: list[str]
    largest_spread: float  # relative, of d33 over the sensors of one group


def run_array() -> ArrayRun:
    """FRF for 12 sensors at 1 N and 41 at 3 N, by the service and by fresh solves; d33 of both by the service."""
    fresh = fresh_frf_pc_per_n()
    preload = np.repeat(PRELOAD_N, SENSORS)
    first = np.array([0, SENSORS[0]])
    with running_service() as client:
        skin = {
            "thickness_mm": THICKNESS_MM,
            "youngs_modulus_mpa": MODULUS_MPA,
            "sensor_radius_mm": SENSOR_RADIUS_MM,
            "indenter_radius_mm": INDENTER_RADIUS_MM,
            "preload_n": preload.tolist(),
        }
        response = _post(client, "/v1/frf", {**skin, "d33_pc_per_n": np.repeat(D33_PC_PER_N, SENSORS).tolist()})
        frf = np.array(response["frf_pc_per_n"])
        answer = _post(client, "/v1/d33", {**skin, "frf_pc_per_n": frf.tolist()})
        of_fresh = _post(client, "/v1/d33", {**skin, "frf_pc_per_n": np.repeat(fresh, SENSORS).tolist()})
    d33 = np.array(answer["d33_pc_per_n"])
    groups = np.split(d33, first[1:])
    return ArrayRun(
        frf_from_service=frf[first],
        d33_from_service=d33[first],
        frf_from_fresh_solve=fresh,
        d33_from_fresh_solve=np.array(of_fresh["d33_pc_per_n"])[first],
        status=sorted(set(answer["status"]) | set(response["status"]) | set(of_fresh["status"])),
        largest_spread=max(float(np.ptp(group) / group.mean()) for group in groups),
    )


def fresh_frf_pc_per_n() -> Floats:
    """FRF = d33 (3/2) ρ² σ with σ from a finite-element solve of each case, without table or interpolation."""
    radius = Indenter.from_lab(indenter_radius_mm=INDENTER_RADIUS_MM).radius
    frf = []
    for preload, d33 in zip(PRELOAD_N, D33_PC_PER_N, strict=True):
        a = float(hertz.contact_radius(preload, radius, SKIN.youngs_modulus) / SKIN.thickness)
        load = float(hertz.load_parameter(preload, radius, SKIN.youngs_modulus))
        nodes = Nodes(np.array([a]), np.array([0.0, RHO]), np.array([0.0, np.cbrt(load)]), np.array([0.0, 1.0]))
        sigma = linear_layer.sigma(a, RHO) + solve_column(a, nodes, _ORDER).sigma_change[1, 1]
        frf.append(float(d33 * charge_response.gain(sigma, RHO)))
    return np.array(frf)


@contextmanager
def running_service() -> Iterator[httpx.Client]:
    """`underskin serve` on a free port with an empty data folder; yields a client once it is ready."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        with log.open("wb") as stderr:
            server = subprocess.Popen(
                [Path(sys.executable).with_name("underskin"), "serve", "--port", str(port)],
                env={**os.environ, "UNDERSKIN_DATA": folder},
                stderr=stderr,
            )
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=_START_S) as client:
                if not _becomes_ready(client, server):
                    raise RuntimeError(f"the server did not become ready:\n{log.read_text()}")
                yield client
        finally:
            server.terminate()
            server.wait()


def _becomes_ready(client: httpx.Client, server: subprocess.Popen[bytes]) -> bool:
    end = time.monotonic() + _START_S
    while server.poll() is None and time.monotonic() < end:
        try:
            if client.get("/ready").is_success:
                return True
        except httpx.TransportError:
            pass  # not listening yet
        time.sleep(0.1)
    return False


def _post(client: httpx.Client, path: str, body: dict[str, object]) -> dict[str, Any]:
    answer = client.post(path, json=body)
    answer.raise_for_status()
    columns: dict[str, Any] = answer.json()
    return columns
