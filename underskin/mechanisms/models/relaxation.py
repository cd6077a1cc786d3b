"""What a body that relaxes remembers: E(t)/E(0) = 1 − Σ g (1 − e^(−t/τ)) over its Prony pairs.

u(t) is what an elastic body would show; F(t) = ∫ E(t−s)/E(0) du(s) = (1 − Σ g) u(t) + Σ g Y(t) with the fading memories
Y(t) = ∫ e^(−(t−s)/τ) du(s). u is taken as linear between samples, for which the step is exact (Fung, Biomechanics,
1993, section 7.6). Memories have the pairs on a last axis of their own.
"""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

_SERIES = 1e-3


@dataclass(frozen=True)
class Relaxation:
    """The Prony pairs: g and τ [s], (points, 1, 1, pairs)."""

    fraction: Floats
    time: Floats

    def decay(self, age: Floats) -> Floats:
        """e^(−t/τ) of each pair."""
        return np.exp(-np.maximum(age, 0.0)[..., None] / self.time)

    def remaining(self, age: Floats) -> Floats:
        """E(t)/E(0)."""
        return self.remaining_of(self.decay(age))

    def remaining_of(self, decay: Floats) -> Floats:
        """The same from e^(−t/τ) of each pair."""
        return np.asarray(1.0 - (self.fraction * (1.0 - decay)).sum(axis=-1))

    def lagging(self, passed: Floats) -> Floats:
        """(1 − e^(−x))/x: what is left of a steady change at its end, x of its duration over τ."""
        x = np.maximum(passed, 0.0)[..., None] / self.time
        safe = np.maximum(x, _SERIES)
        return np.where(x < safe, 1 - x / 2 + x**2 / 6, -np.expm1(-safe) / safe)

    def convolved(self, history: Floats, memory: Floats) -> Floats:
        """∫ e(t−s) du(s) from u(t) and its memories."""
        whole = 1.0 - self.fraction.sum(axis=-1)
        return np.asarray(whole * history + (self.fraction * memory).sum(axis=-1))


def memories(history: Floats, time: Floats, relaxation: Relaxation) -> Floats:
    """Y (…, samples, pairs) of histories u (…, samples) at times [s]; what u is at the first sample came at once."""
    passed = np.diff(time, axis=-1, prepend=time[..., :1])
    decay, lag = relaxation.decay(passed), relaxation.lagging(passed)
    known = lag * np.diff(history, axis=-1, prepend=0.0)[..., None]
    known[..., 0, :] = history[..., :1]
    decay, known = np.broadcast_arrays(np.moveaxis(decay, -2, 0), np.moveaxis(known, -2, 0))
    memory = np.empty(known.shape)
    memory[0] = known[0]
    for sample in range(1, len(known)):
        np.multiply(decay[sample], memory[sample - 1], out=memory[sample])
        memory[sample] += known[sample]
    return np.moveaxis(memory, 0, -2)
