"""How large each kind of noise is, as `likelihood` takes them: s, κ, p, τ, q and η."""

from dataclasses import dataclass

from underskin.units import Floats


@dataclass(frozen=True)
class NoiseLevels:
    """`gain` s, `level` κ, `position` p [m] (0: none), `spread` τ, `pickup` the distinct q, `smooth` η."""

    gain: float
    level: float
    position: float
    spread: float
    pickup: Floats | None = None
    smooth: float = 0.0  # of curves


@dataclass(frozen=True)
class SeveralLevels:
    """Sets of noise levels (…, 1); of pick-up its distinct deviations (…, distinct)."""

    gain: Floats
    level: Floats
    position: Floats
    spread: Floats
    pickup: Floats | None
    smooth: Floats

    @property
    def at_first(self) -> "SeveralLevels":
        """The first set at each point (points, 1, 1)."""
        gain, level, position, spread, smooth = (
            values[:, :1] for values in (self.gain, self.level, self.position, self.spread, self.smooth)
        )
        return SeveralLevels(gain, level, position, spread, None, smooth)

    @property
    def first(self) -> NoiseLevels:
        """The first set, as numbers."""
        gain, level, position, spread, smooth = (
            float(values.flat[0]) for values in (self.gain, self.level, self.position, self.spread, self.smooth)
        )
        pickup = None if self.pickup is None else self.pickup.reshape(-1, self.pickup.shape[-1])[0]
        return NoiseLevels(gain, level, position, spread, pickup, smooth)
