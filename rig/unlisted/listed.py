"""Single mechanisms of the published catalogue, fitted to a campaign with a hidden law.

A law that one of them describes as well is not unlisted. Each mechanism is fitted with the true equations and
noise levels (with the nuisances of `observed.py`), beside the base model and the campaign's companion, whose
parameters stay free. Mechanisms have no priors; bounds are wide.

A mechanism is fitted to the numbers in which the law shows: to ln |FRF| of each recording (`listed_static.py`) if the
law changes amplitudes; to all lines (`listed_lines.py`) if it goes along frequency or is a loss angle. The rest of the
catalogue is left out for these reasons:

- Static mechanisms leave the shape of the lines as it is, and line amplitudes are free for each recording.
- timing_delay, amplifier_high_pass and sensor_relaxation change the amplitudes of all recordings alike, as d33 does.
- contact_resonance changes amplitudes by about v^2 (v frequency over resonance) times the share of k that differs
  between recordings; the lines, which a static law leaves flat, would show v^2 itself. mains_pickup has no mean.
- instrument_compliance and platen_friction act on curves, not on FRFs.
- A companion's own mechanism is fitted in its place, with all its forms and parameters; a spectral one, whose
  parameters are free anyway, is not fitted twice.
- ageing and contact_creep are fitted only where the campaign states load cycles and dwell times.

Not modelled: finite strain (designs are drawn so that it does not show), creep with J(t) instead of 1/E(t), the
contact radius of a compressible or slipping layer other than Hertz's, adhesion other than on a half space,
combinations of two mechanisms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

Array = npt.NDArray[np.float64]
Point = tuple[float, ...]

LEADING = 8
"""Starts that are refined, of those given."""
EVALUATIONS = 40


@dataclass(frozen=True)
class Form:
    """One form of a mechanism: what it predicts from its parameters p, starting points of p, and bounds."""

    predict: Callable[[Array], npt.NDArray[Any]]
    starts: tuple[Point, ...] = ((),)
    low: Point = ()
    high: Point = ()


def least_chi2(residual: Callable[[Array], Array], starts: list[Array], low: Array, high: Array) -> float:
    """The least sum of squares from the best of the starts; without parameters, the sum itself."""
    points = [np.clip(s, low, high) for s in starts]
    costs = [float((residual(p) ** 2).sum()) for p in points]
    best = min(costs)
    for i in np.argsort(costs)[: LEADING if low.size else 0]:
        solution = least_squares(residual, points[i], bounds=(low, high), x_scale="jac", max_nfev=EVALUATIONS)
        best = min(best, 2.0 * float(solution.cost))
    return best
