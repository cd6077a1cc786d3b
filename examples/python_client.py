"""The service from Python. Needs a running service (`make serve`); UNDERSKIN_URL and UNDERSKIN_API_KEY name another."""

import os
from typing import Any

import numpy as np

import underskin

PROTOTYPE: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
}
PRELOADS_N = np.array([0.5, 1.0, 2.0, 3.0])

url = os.environ.get("UNDERSKIN_URL", "http://127.0.0.1:8000")
with underskin.Client(url, api_key=os.environ.get("UNDERSKIN_API_KEY")) as client:
    predicted = client.frf(**PROTOTYPE, preload_n=PRELOADS_N, d33_pc_per_n=14.0)
    for preload, frf, stress in zip(PRELOADS_N, predicted.frf_pc_per_n, predicted.mean_stress_mpa, strict=True):
        print(f"{preload:3.1f} N: FRF {frf:.3f} pC/N, mean stress on the sensor {stress:.4f} MPa")

    measured = client.d33(**PROTOTYPE, preload_n=[1.0, 3.0], frf_pc_per_n=[7.4, 11.5], frf_uncertainty_pc_per_n=0.1)
    for d33, uncertainty in zip(measured.d33_pc_per_n, measured.d33_uncertainty_pc_per_n, strict=True):
        print(f"d33 = {d33:.2f} ± {uncertainty:.2f} pC/N")

    try:
        client.frf(**PROTOTYPE, preload_n=-1.0, d33_pc_per_n=14.0)
    except underskin.ServiceError as refusal:
        print(f"refused: {refusal.problem['detail']}")
