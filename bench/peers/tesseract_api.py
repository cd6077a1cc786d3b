"""σ as a Tesseract; its runtime finds this file by TESSERACT_API_PATH, and this file the table by SIGMA_TABLE."""

import os

import numpy as np
from pydantic import BaseModel, Field
from tesseract_core.runtime import Float64  # type: ignore[import-not-found]  # in an environment of its own

from bench.peers.spline import read_spline

spline = read_spline(os.environ["SIGMA_TABLE"])


class InputSchema(BaseModel):
    a_over_h: Float64 = Field(description="contact radius over thickness")
    rt_over_h: Float64 = Field(description="sensor radius over thickness")
    load_parameter: Float64 = Field(description="L = F/(R²E)")


class OutputSchema(BaseModel):
    sigma: Float64 = Field(description="σ(a/h, rT/h, L)")


def apply(inputs: InputSchema) -> OutputSchema:
    """Evaluate σ."""
    point = [inputs.a_over_h, inputs.rt_over_h, inputs.load_parameter ** (1 / 3)]
    return OutputSchema(sigma=float(spline(np.array([point], dtype=float))[0]))
