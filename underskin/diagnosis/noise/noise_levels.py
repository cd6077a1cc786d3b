"""How large each kind of noise is, as `likelihood` takes them: s, κ, p, τ, q and η."""

from dataclasses import dataclass

from underskin.units import Floats


@dataclass(frozen=True)
class NoiseLevels:
    """`gain` s, `level` κ, `position` p [m] (0: none), `spread` τ, `pickup` q on the rows it reaches, `smooth` η."""

    gain: float
    level: float
    position: float
    spread: float
    pickup: Floats | None = None
    smooth: float = 0.0  # of curves


@dataclass(frozen=True)
class SeveralLevels:
    """K sets of noise levels; each a column (K, 1), or a number that all share; of pick-up (K, pick-up rows)."""

    gain: Floats
    level: Floats
    position: Floats | float
    spread: Floats | float
    pickup: Floats | None
