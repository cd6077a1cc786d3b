"""Three hyperelastic laws fitted to measured silicones: what the priors of strain_stiffening are built on.

`python -m docs.mechanisms.silicones` fits the recordings under `UNDERSKIN_RECORDINGS` anew (silicones.json).

Incompressible uniaxial nominal stress over E/3, with stretch λ (1 − strain in compression), I = λ² + 2/λ − 3:
Yeoh  (λ − λ⁻²)(1 + 2 c2 I + 3 c3 I²);  Gent  (λ − λ⁻²)/(1 − I/J);  Ogden, one term,  (2/α)(λ^(α−1) − λ^(−α/2−1)).
"""

import csv
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from underskin.units import Floats

Law = Callable[[Floats, Floats], Floats]  # stretch, shape parameters -> nominal stress over E/3
_POINTS = 300
RESULTS = Path(__file__).with_name("silicones.json")


@dataclass(frozen=True)
class Fit:
    """E [kPa], the shape parameters and the residual in percent of the largest stress."""

    modulus_kpa: float
    shape: Floats
    residual_percent: float


@dataclass(frozen=True)
class Sample:
    """A loading curve: engineering strain (compression negative) and nominal stress [kPa]."""

    name: str
    strain: Floats
    stress_kpa: Floats

    def up_to(self, strain: float) -> "Sample":
        """The part below a strain."""
        mask = np.abs(self.strain) <= strain
        return Sample(self.name, self.strain[mask], self.stress_kpa[mask])


def yeoh(stretch: Floats, shape: Floats) -> Floats:
    """Three terms."""
    invariant = stretch**2 + 2 / stretch - 3
    return (stretch - stretch**-2) * (1 + 2 * shape[0] * invariant + 3 * shape[1] * invariant**2)


def gent(stretch: Floats, shape: Floats) -> Floats:
    """Limited extensibility; shape is 1/J."""
    invariant = stretch**2 + 2 / stretch - 3
    return (stretch - stretch**-2) / (1 - shape[0] * invariant)


def ogden(stretch: Floats, shape: Floats) -> Floats:
    """One term."""
    (alpha,) = shape
    return 2 / alpha * (stretch ** (alpha - 1) - stretch ** (-alpha / 2 - 1))


LAWS: dict[str, tuple[Law, tuple[float, ...]]] = {
    "Yeoh": (yeoh, (0.0, 0.0)),
    "Gent": (gent, (0.01,)),
    "Ogden": (ogden, (2.5,)),
}


def fit(sample: Sample, law: Law, start: tuple[float, ...]) -> Fit:
    """Least squares in stress over E and the law's shape."""
    stretch = 1 + sample.strain
    largest = np.abs(sample.stress_kpa).max()
    modulus = np.polyfit(sample.strain, sample.stress_kpa, 1)[0]

    def residual(parameters: Floats) -> Floats:
        model = parameters[0] * modulus / 3 * law(stretch, parameters[1:])
        return (model - sample.stress_kpa) / largest

    # Gent's stress ends where I reaches J.
    ends = 0.999 / (stretch**2 + 2 / stretch - 3).max() if law is gent else np.inf
    solution = least_squares(
        residual,
        [1.0, *(min(value, ends / 2) for value in start)],
        x_scale=[1.0, *(0.1 for _ in start)],
        bounds=([-np.inf] * (1 + len(start)), [np.inf, *(ends for _ in start)]),
        max_nfev=2000,
    )
    return Fit(float(solution.x[0] * modulus), solution.x[1:], float(100 * np.sqrt(np.mean(solution.fun**2))))


def compression_samples(folder: Path) -> list[Sample]:
    """The first repeat of each Ecoflex cylinder."""
    files = sorted(folder.glob("silicone-compression/*/*1.csv"))
    return [_sample(path.stem, _numbers(path, ",", 7), 3, 4, 1.0) for path in files]


def tension_samples(folder: Path) -> list[Sample]:
    """All dumbbells."""
    files = sorted(folder.glob("silicone-tension/*.csv"))
    return [_sample(path.stem, _numbers(path, ";", 5), 3, 4, 1e3) for path in files]


def _sample(name: str, rows: Floats, strain: int, stress: int, to_kpa: float) -> Sample:
    thinned = rows[:: max(1, len(rows) // _POINTS)]
    return Sample(name, thinned[:, strain], thinned[:, stress] * to_kpa)


def _numbers(path: Path, delimiter: str, columns: int) -> Floats:
    """The rows that are all numbers, up to the largest strain."""
    rows = []
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        for row in csv.reader(file, delimiter=delimiter):
            try:
                numbers = [float(cell) for cell in row[:columns]]
            except ValueError:
                continue
            if len(numbers) == columns:
                rows.append(numbers)
    values = np.array(rows)
    return values[: int(np.abs(values[:, 3]).argmax()) + 1]


def main(results: Path = RESULTS) -> None:
    """Fit everything in the folder of `UNDERSKIN_RECORDINGS` and store the numbers for the page."""
    folder = Path(os.environ["UNDERSKIN_RECORDINGS"])
    rows = []
    for kind, samples in (("compression", compression_samples(folder)), ("tension", tension_samples(folder))):
        for sample in samples:
            for limit in (3.0, 0.4):
                part = sample.up_to(limit)
                largest = round(float(np.abs(part.strain).max()), 2)
                row: dict[str, Any] = {"kind": kind, "sample": sample.name, "largest_strain": largest}
                for name, (law, start) in LAWS.items():
                    fitted = fit(part, law, start)
                    row[name] = {
                        "modulus_kpa": float(f"{fitted.modulus_kpa:.3g}"),
                        "shape": [float(f"{value:.2g}") for value in fitted.shape],
                        "residual_percent": float(f"{fitted.residual_percent:.2g}"),
                    }
                rows.append(row)
    results.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
