"""Relaxation with fading memory: E(t)/E(0) = 1 − Σ g (1 − e^(−t/τ)) over the Prony pairs.

u(t) is the force of the elastic body; F(t) = ∫ E(t−s)/E(0) du(s) = (1 − Σ g) u(t) + Σ g Y(t) with the fading
memories Y(t) = ∫ e^(−(t−s)/τ) du(s). u is taken as linear between samples, for which the step is exact (Fung,
Biomechanics, 1993, section 7.6). Memories have the pairs on a last axis of their own.
"""

from dataclasses import dataclass

import numpy as np

from underskin.autodiff import contiguous
from underskin.mechanisms.models.sphere_kernels import memory_rows
from underskin.units import Floats


@dataclass(frozen=True)
class Relaxation:
    """The Prony pairs: g and τ [s], (points, 1, 1, pairs)."""

    fraction: Floats
    time: Floats

    @property
    def unrelaxed(self) -> Floats:
        """1 − Σ g (points, 1, 1)."""
        return np.asarray(1.0 - self.fraction.sum(axis=-1))

    def remaining(self, age: Floats) -> Floats:
        """E(t)/E(0)."""
        decay = np.exp(-np.maximum(age, 0.0)[..., None] / self.time)
        return np.asarray(1.0 - (self.fraction * (1.0 - decay)).sum(axis=-1))

    def convolved(self, history: Floats, memory: Floats) -> Floats:
        """∫ e(t−s) du(s) from u(t) and its memories."""
        return np.asarray(self.unrelaxed * history + (self.fraction * memory).sum(axis=-1))

    def of_points(self, count: int) -> tuple[Floats, Floats]:
        """g and τ broadcast to `count` points, (points, pairs)."""
        pairs = self.fraction.shape[-1]
        fraction, time = (
            np.broadcast_to(values.reshape(-1, pairs), (count, pairs)) for values in (self.fraction, self.time)
        )
        return contiguous(fraction), contiguous(time)


def memories(history: Floats, time: Floats, relaxation: Relaxation) -> Floats:
    """Y (points, curves, samples, pairs) of histories u (points, curves, samples) at times [s]; u at the first
    sample is a step."""
    _, times = relaxation.of_points(len(history))
    memory = np.empty((*history.shape, times.shape[-1]))
    memory_rows(contiguous(history), contiguous(np.broadcast_to(time, history.shape)), times, memory)
    return memory
