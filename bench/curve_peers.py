"""Plain least squares of Hertz' and JKR's law by others: SciPy on laws written out here, and nanite with lmfit."""

import json
import os
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from underskin.units import Floats

_CHECKOUT = Path(__file__).parent.parent
_QUANTILES = np.linspace(0.02, 0.9, 12)  # of the way in, where contact points begin
_GAPS = 5  # samples on either side of the least force, between which a contact point begins under JKR's law
_WORKS = (0.3, 1.0, 3.0)  # of what the least force says


@dataclass(frozen=True)
class Curve:
    """One curve of a sphere, in SI units."""

    radius: float
    poisson_ratio: float
    depth: Floats  # (samples,)
    force: Floats  # (samples,)

    @property
    def way_in(self) -> int:
        """The samples up to the deepest one."""
        return int(self.depth.argmax()) + 1


def hertz(curve: Curve, contact_point: float, modulus: float) -> Floats:
    """F = 4/3 E/(1 - ν²) √R δ^(3/2) (samples,)."""
    depth = np.maximum(curve.depth - contact_point, 0.0)
    return np.asarray(4 / 3 * modulus / (1 - curve.poisson_ratio**2) * np.sqrt(curve.radius) * depth**1.5)


def jkr(curve: Curve, contact_point: float, modulus: float, work: float) -> Floats:
    """F = 4E'a³/(3R) - √(8πwE'a³) at δ = a²/R - √(2πwa/E') from the touch of the surfaces on, where δ = 0 (samples,).

    With a = s α, s³ = 2πwR²/E': δ R/s² = α² - √α, whose branch from α = 1 on is solved by Newton's method from above.
    """
    reduced = modulus / (1 - curve.poisson_ratio**2)
    scale = np.cbrt(2 * np.pi * work * curve.radius**2 / reduced)
    depth = np.maximum(curve.depth - contact_point, 0.0) * curve.radius / scale**2
    alpha = np.sqrt(depth) + 1
    for _ in range(20):
        alpha -= (alpha**2 - np.sqrt(alpha) - depth) / (2 * alpha - 0.5 / np.sqrt(alpha))
    a = scale * alpha
    force = 4 * reduced * a**3 / (3 * curve.radius) - np.sqrt(8 * np.pi * work * reduced * a**3)
    return np.where(curve.depth >= contact_point, force, 0.0)


def hertz_residual(curve: Curve) -> float:
    """The residual sum of squares [N²] of SciPy's least squares of Hertz' law."""
    modulus = 1 / _reference(curve)
    return _least(
        curve,
        lambda x: hertz(curve, x[0], modulus * np.exp(x[1])),
        [[contact_point, np.log(start / modulus), zero] for start, contact_point, zero in _starts(curve)],
    )


def jkr_residual(curve: Curve) -> float:
    """The residual sum of squares [N²] of SciPy's least squares of JKR's law with a linear drift, for loading."""
    modulus = 1 / _reference(curve)
    jump = int(curve.force.argmin())
    gaps = np.arange(max(jump - _GAPS, 0), min(jump + _GAPS, len(curve.depth) - 1))
    work = (np.median(curve.force[: max(jump, 1)]) - curve.force[jump]) / (4 / 3 * np.pi * curve.radius)
    deepest, zero = curve.depth.max(), float(np.median(curve.force[: max(jump, 1)]))
    starts = []
    for gap in gaps:
        contact_point = (curve.depth[gap] + curve.depth[gap + 1]) / 2
        stiffness = np.log((curve.force.max() - zero) / _per_modulus(curve, deepest - contact_point) / modulus)
        starts += [[contact_point, stiffness, zero, np.log(share * work), 0.0] for share in _WORKS]
    along = np.ptp(curve.force) * np.linspace(0, 1, len(curve.force))
    return _least(curve, lambda x: jkr(curve, x[0], modulus * np.exp(x[1]), np.exp(x[3])) + x[4] * along, starts)


def nanite_residuals(curves: Sequence[Curve]) -> list[float]:
    """The same of Hertz' law by nanite, from the environment that `make bench` installs for it."""
    python = _CHECKOUT / ".venv-nanite" / "bin" / "python"
    request = [
        {
            "radius_m": curve.radius,
            "poisson_ratio": curve.poisson_ratio,
            "tip_m": (-curve.depth).tolist(),  # a tip's position falls as it indents
            "force_n": curve.force.tolist(),
            "starts": [(modulus, -contact_point, zero) for modulus, contact_point, zero in _starts(curve)],
        }
        for curve in curves
    ]
    run = subprocess.run(
        [python, _CHECKOUT / "bench" / "peers" / "nanite_hertz.py"],
        input=json.dumps(request),
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": ""},
        check=True,
        capture_output=True,
        text=True,
    )
    return [fit["left_n2"] for fit in json.loads(run.stdout)]


def _reference(curve: Curve) -> float:
    """One over the modulus [1/Pa] that the largest force and travel say."""
    return _per_modulus(curve, float(np.ptp(curve.depth))) / float(np.ptp(curve.force))


def _per_modulus(curve: Curve, depth: float) -> float:
    return float(4 / 3 / (1 - curve.poisson_ratio**2) * np.sqrt(curve.radius) * max(depth, 1e-12) ** 1.5)


def _starts(curve: Curve) -> list[tuple[float, float, float]]:
    """Moduli [Pa], contact points [m] and zeros [N]: at each contact point the linear least squares of the others."""
    starts = []
    for contact_point in np.quantile(curve.depth[: curve.way_in], _QUANTILES):
        columns = np.stack([hertz(curve, contact_point, 1.0), np.ones(len(curve.depth))], axis=1)
        scale = np.abs(columns).max(axis=0)
        modulus, zero = np.linalg.lstsq(columns / scale, curve.force, rcond=None)[0] / scale
        starts.append((max(float(modulus), 1.0), float(contact_point), float(zero)))
    return starts


def _least(curve: Curve, law: Callable[[Floats], Floats], starts: Sequence[Sequence[float]]) -> float:
    """The least residual over several starts (contact point [m], logarithm of a factor on the modulus, zero [N], …)."""
    unit, travel = float(np.ptp(curve.force)), float(np.ptp(curve.depth))
    size = np.array([travel, 1.0, unit, *np.ones(len(starts[0]) - 3)])

    def residuals(y: Floats) -> Floats:
        x = y * size
        return np.asarray((law(x) + x[2] - curve.force) / unit)

    return 2 * unit**2 * min(float(least_squares(residuals, start / size).cost) for start in map(np.array, starts))
