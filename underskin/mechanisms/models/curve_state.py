"""A force curve as mechanisms change it: the elastomer, the stage, and relaxation. SI.

Relaxation with fading memory: E(t)/E(0) = 1 − Σ g (1 − e^(−t/τ)) over the Prony pairs. A power law (t/1 s)^(−n) is
the sum of the pairs of 1/Γ(n) ∫ τ^(−n) e^(−t/τ) d ln τ by the trapezoidal rule, to 0.3 % for n up to 0.5; times longer
and shorter than those of a recording count as one constant and one dashpot. u(t) is the force of the elastic body;
F(t) = ∫ E(t−s)/E(0) du(s) = (1 − Σ g) u(t) + Σ g Y(t) with the fading memories
Y(t) = ∫ e^(−(t−s)/τ) du(s). u is taken as linear between samples, for which the step is exact (Fung, Biomechanics,
1993, section 7.6). Memories have the pairs on a last axis of their own.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import gamma

from underskin.autodiff import Differentiated, contiguous
from underskin.units import Floats

_POWER_STEP = float(np.log(4.0))  # of ln τ, as compiled functions take it: τ falls by a factor of 4 each
_SLOWER, _FASTER = 30.0, 0.2  # times the longest and the shortest time of a recording: the range of τ


@dataclass(frozen=True)
class Relaxation:
    """The Prony pairs: g and τ [s], (points, 1, 1, pairs); `at_rest`, E(0) over the stated modulus (points, 1, 1).

    `series`: how many pairs are those of a power law, whose times fall by a factor of 4 each; single pairs are before
    them, their products with every single pair after them.
    """

    fraction: Floats
    time: Floats
    at_rest: Floats | float = 1.0
    series: int = 0

    @classmethod
    def of_power_law(cls, exponent: Floats, times: tuple[float, float]) -> "Relaxation":
        """(t/1 s)^(−n) for exponents n (points, 1, 1) from 0 to 0.5 and between the shortest and the longest times
        [s]; E(0), which the power law does not have, is that of the shortest."""
        low, high = np.log(_FASTER * times[0]), np.log(_SLOWER * times[1])
        count = int(np.ceil((high - low) / _POWER_STEP)) + 1
        log_time = high - _POWER_STEP * np.arange(count)
        n = exponent[..., None]
        density = np.exp(-n * log_time) / gamma(1.0 + n)  # over n h, of each τ
        weight = n * _POWER_STEP * density
        faster = np.exp(-(1.0 - n) * _POWER_STEP)
        weight[..., -1:] /= 1.0 - faster
        step = n * _POWER_STEP
        slower = density[..., :1] * np.where(step > 0, step / np.expm1(np.maximum(step, 1e-300)), 1.0)
        at_rest = (slower + weight.sum(axis=-1, keepdims=True))[..., 0]
        return cls(weight / at_rest[..., None], np.exp(log_time) + np.zeros_like(weight), at_rest, count)

    def times(self, other: "Relaxation") -> "Relaxation":
        """The product of two relaxations."""
        mine, others = self.fraction[..., :, None], other.fraction[..., None, :]
        both = 1.0 / (1.0 / self.time[..., :, None] + 1.0 / other.time[..., None, :])
        shape = (*both.shape[:-2], -1)
        fractions = self.fraction * other.unrelaxed[..., None], other.fraction * self.unrelaxed[..., None]
        return Relaxation(
            np.concatenate([*fractions, (mine * others).reshape(shape)], axis=-1),
            np.concatenate([self.time, other.time, both.reshape(shape)], axis=-1),
            self.at_rest * other.at_rest,
            0 if self.series else other.series,
        )

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

    def of_points(self, count: int) -> tuple[Floats, Floats, int]:
        """g and τ broadcast to `count` points, (points, pairs), and the length of the series."""
        pairs = self.fraction.shape[-1]
        fraction, time = (
            np.broadcast_to(values.reshape(-1, pairs), (count, pairs)) for values in (self.fraction, self.time)
        )
        return contiguous(fraction), contiguous(time), self.series


def memories(history: Floats, time: Floats, relaxation: Relaxation) -> Floats:
    """Y (points, curves, samples, pairs) of histories u (points, curves, samples) at times [s]; u at the first
    sample is a step."""
    from underskin.mechanisms.models.sphere_kernels import memory_rows

    pairs = relaxation.of_points(len(history))
    memory = np.empty((*history.shape, pairs[0].shape[-1]))
    memory_rows(contiguous(history), contiguous(np.broadcast_to(time, history.shape)), *pairs, memory)
    return memory


_FEW, _MORE = 3, 7  # samples whose straight line gives a speed; more where the displacement is noisy
_STEADY = 0.05  # of the largest speed: scatter of a steady speed, by noise of the displacement


def speeds(displacement: Floats, time: Floats) -> Floats:
    """The speed at each sample (curves, samples) of displacements at times: the slope of the straight line through it
    and its neighbours, few so that it turns as fast as the motion does."""
    few, more = _slopes(displacement, time, _FEW), _slopes(displacement, time, _MORE)
    scatter = np.median(np.abs(few - more), axis=-1, keepdims=True)
    return np.where(scatter > _STEADY * np.abs(more).max(axis=-1, keepdims=True), more, few)


def _slopes(displacement: Floats, time: Floats, count: int) -> Floats:
    """Slopes of the lines through `count` samples around each, fewer where there are no more."""
    count = min(count, displacement.shape[-1])
    places, times = (sliding_window_view(column, count, axis=-1) for column in (displacement, time))
    places, times = (part - part.mean(axis=-1, keepdims=True) for part in (places, times))
    slope = (times * places).sum(axis=-1) / np.maximum((times * times).sum(axis=-1), np.finfo(float).tiny)
    first = np.clip(np.arange(displacement.shape[-1]) - count // 2, 0, slope.shape[-1] - 1)
    return np.asarray(slope[..., first])


@dataclass(frozen=True)
class Samples:
    """The samples before any law: `travel` from the contact point [m] (points, curves, samples), `time` [s] and
    `speed` of what holds the sphere [m/s] (curves, samples), and the recordings' `ids`."""

    ids: Sequence[str]
    travel: Floats
    time: Floats
    speed: Floats

    def along(self, axis: str, force: Floats, origins: Mapping[str, float]) -> Floats:
        """An axis of laws of curves: the depth beyond the contact point [mm], the contact force [N], or the time since
        the origin of each recording, by its id, else its first sample [s]."""
        if axis == "displacement_mm":
            return np.asarray(1e3 * np.maximum(self.travel, 0.0))
        if axis == "force_n":
            return np.maximum(force, 0.0)
        first = [origins.get(name, float(times[0])) for name, times in zip(self.ids, self.time, strict=True)]
        return np.asarray(self.time - np.array(first)[:, None])


@dataclass(frozen=True)
class SampleLaw:
    """A law that changes samples one by one: millimetres added to the travel (`acts_on` position), newtons added to
    the force (force), or a factor on the force."""

    acts_on: str
    change: Callable[[Samples, Floats], Floats]  # of samples where the contact force is that [N]

    def pressed_travel(self, samples: Samples, travel: Floats) -> Floats:
        """The travel at which the sphere presses [m] (points, curves, samples)."""
        if self.acts_on != "position":
            return travel
        return travel + 1e-3 * self.change(samples, np.zeros_like(travel))

    def measured_force(self, samples: Samples, force: Floats) -> Floats:
        """The measured force [N] where the contact force is `force` [N] (points, curves, samples)."""
        if self.acts_on == "position":
            return force
        change = self.change(samples, force)
        return force + change if self.acts_on == "force" else force * change


@dataclass
class Curve:
    """The quantities that govern an indentation or compression; each is one number per point of the fit coordinates."""

    modulus: Differentiated  # E [Pa]
    poisson_ratio: Differentiated
    strain_share: Differentiated | None = None  # of an indentation: that of finite strain's correction (Sphere)
    thickness: Differentiated | None = None  # h [m]
    layered: bool = False
    work_of_adhesion: Differentiated | None = None  # [J/m²]
    work_of_separation: Differentiated | None = None  # the same where it is no larger
    stiffening: tuple[Differentiated, ...] | None = None  # of an indentation: c, q and m (Stiffening)
    stiffened: tuple[Differentiated, ...] | None = None  # of a compression: c2, c3, m and α (physics/uniaxial.py)
    foam: Callable[[Floats], Floats] | None = None  # of a compression that does not widen: stress over E of strains
    softening: Callable[[Floats], Floats] | None = None  # of a compression: factor on the stress, of all strains
    relaxation: tuple[tuple[Differentiated, Differentiated], ...] = ()  # g and τ [s] of each Prony pair
    power_exponent: Differentiated | None = None  # n of the power law by which the modulus falls too
    times: tuple[float, float] = (1.0, 1.0)  # the shortest time between samples and the longest in a recording [s]
    stage_stiffness: Differentiated | None = None  # [N/m]
    platen_friction: Differentiated | None = None  # 0 to 1
    laws: list[SampleLaw] = field(default_factory=list)

    @property
    def relaxes(self) -> Relaxation | None:
        """The Prony pairs, times the power law; None without relaxation."""
        if not self.relaxation:
            return None
        fraction, time = (np.stack([numbers(pair[part]) for pair in self.relaxation], axis=-1) for part in range(2))
        pairs = Relaxation(fraction, time)
        if self.power_exponent is None:
            return pairs
        return pairs.times(Relaxation.of_power_law(numbers(self.power_exponent), self.times))


def numbers(quantity: Differentiated) -> Floats:
    """A quantity's value at each point, with axes for curves and samples: (points, 1, 1)."""
    return quantity.value[..., None]
