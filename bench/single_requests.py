"""Single evaluations a second at 8 keep-alive connections: ours against the umbridge server and Tesseract's runtime.

Every server runs on one core and answers from the same spline; wrk asks from another core.
"""

import re
import shutil
import subprocess
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

from bench import servers
from bench.figures import Figure, interleaved, ratio

CONNECTIONS = 8
ROUNDS = 7
SECONDS = 3
_SCRIPTS = Path(__file__).parent / "load"
_POINT = [0.3, 0.6, 0.01]


def measure() -> list[Figure]:
    """Requests a second of each server, and the ratios."""
    if shutil.which("wrk") is None:
        raise SystemExit("The load generator is missing. On Debian and Ubuntu: apt-get install wrk")
    with servers.underskin() as ours, servers.umbridge() as umbridge, servers.tesseract() as tesseract:
        _check_same_answers(ours, umbridge, tesseract)
        rates = interleaved(
            {
                "umbridge": partial(_rate, umbridge, "/Evaluate", "umbridge.lua"),
                "tesseract": partial(_rate, tesseract, "/apply", "tesseract.lua"),
                "ours GET": partial(_rate, ours, "/v1/sigma", "sigma.lua"),
                "ours POST": partial(_rate, ours, "/umbridge/Evaluate", "umbridge.lua"),
            },
            ROUNDS,
        )
    return [
        Figure("umbridge package's server", median(rates["umbridge"]), "requests/s"),
        Figure("Tesseract Core's runtime", median(rates["tesseract"]), "requests/s"),
        Figure("GET /v1/sigma", median(rates["ours GET"]), "requests/s"),
        Figure("POST /umbridge/Evaluate", median(rates["ours POST"]), "requests/s"),
        Figure("GET /v1/sigma over umbridge", ratio(rates["ours GET"], rates["umbridge"]), "×", 1.5),
        Figure("POST /umbridge/Evaluate over umbridge", ratio(rates["ours POST"], rates["umbridge"]), "×", 1.5),
        Figure("GET /v1/sigma over Tesseract", ratio(rates["ours GET"], rates["tesseract"]), "×", 5.0),
        Figure("POST /umbridge/Evaluate over Tesseract", ratio(rates["ours POST"], rates["tesseract"]), "×", 5.0),
    ]


def _rate(server: servers.Server, path: str, script: str) -> float:
    """Requests a second; raises RuntimeError when any answer was an error."""
    wrk = f"taskset -c {servers.LOAD_CORE} wrk -t1 -c{CONNECTIONS} -d{SECONDS}s -s".split()
    command = [*wrk, str(_SCRIPTS / script), f"http://127.0.0.1:{server.port}{path}"]
    report = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    if "Non-2xx" in report or "Socket errors" in report:
        raise RuntimeError(report)
    match = re.search(r"Requests/sec:\s+([\d.]+)", report)
    if match is None:
        raise RuntimeError(report)
    return float(match[1])


def _check_same_answers(ours: servers.Server, umbridge: servers.Server, tesseract: servers.Server) -> None:
    """All servers must give the same σ, or the comparison would not be fair."""
    evaluation = {"name": "sigma", "input": [_POINT], "config": {}}
    names = ("a_over_h", "rt_over_h", "load_parameter")
    inputs = dict(zip(names, _POINT, strict=True))
    answers = {
        "ours": ours.post("/umbridge/Evaluate", evaluation)["output"][0][0],
        "umbridge": umbridge.post("/Evaluate", evaluation)["output"][0][0],
        "tesseract": tesseract.post("/apply", {"inputs": inputs})["sigma"]["data"]["buffer"],
        "columns": ours.post("/v1/sigma", {name: [value] for name, value in inputs.items()})["sigma"][0],
    }
    np.testing.assert_allclose(list(answers.values()), answers["ours"], rtol=1e-12)
