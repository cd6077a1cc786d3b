"""The `umbridge` package's own server: umbridge_server.py TABLE PORT."""

import sys
from typing import Any

import numpy as np
import umbridge

from bench.peers.spline import read_spline

spline = read_spline(sys.argv[1])


class SigmaModel(umbridge.Model):  # type: ignore[misc]  # the package has no types
    """σ(a/h, rT/h, L) as a UM-Bridge model."""

    def __init__(self) -> None:
        super().__init__("sigma")

    def get_input_sizes(self, config: dict[str, Any]) -> list[int]:  # noqa: ARG002
        return [3]

    def get_output_sizes(self, config: dict[str, Any]) -> list[int]:  # noqa: ARG002
        return [1]

    def supports_evaluate(self) -> bool:
        return True

    def __call__(self, parameters: list[list[float]], config: dict[str, Any]) -> list[list[float]]:  # noqa: ARG002
        a, rho, load = parameters[0]
        return [[float(spline(np.array([[a, rho, load ** (1 / 3)]]))[0])]]


umbridge.serve_models([SigmaModel()], int(sys.argv[2]))
