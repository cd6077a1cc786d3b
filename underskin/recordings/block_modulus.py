"""Young's modulus from the first loading branch of a single curve of a cylinder that is pressed or pulled. SI inside.

Two laws are tried, each over the first part of the curve that follows it, the incompressible neo-Hookean solid between
smooth platens, nominal stress = (E/3)(λ⁻² − λ) with λ = 1 − strain, compression positive, and Hooke's line, nominal
stress = E strain. The law that holds over more strain is used; with equal ranges the line if its residual is smaller,
else the neo-Hookean law. Where neither describes the whole branch and Rivlin's series does, E is that of the series at
no strain (`small_strain_modulus`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from underskin.recordings.campaign import CompressionRecording
from underskin.recordings.curve_course import is_one_sided
from underskin.recordings.modulus import (
    AS_NOISE,
    FEWEST,
    SURE,
    correlation_factor,
    least_misfit,
    loading_branch,
)
from underskin.units import Floats, to_lab, to_si
from underskin.weak_cache import cached_while_alive

# Largest departure from a law: of the range of stress of the part, of the stress there, and of the range of the curve
_STRAIGHT, _LOCALLY, _LEAST = 0.012, 0.05, 2e-3
_LEAVES = 0.02  # departure, of the stress, beyond which the curve no longer follows the law
_EARLY = 0.1  # the part starts below this share of the stress at its end
_POINTS = 400
_LEAST_STRETCH = 0.05  # least λ
_ROUNDS = 2  # iterations for the foot of the curve, from which strain counts
_FOOT_RANGE, _FEET = 0.5, 41  # of the strain of a part: where its foot is sought; feet tried
_STEP = 1e-4  # of the range of strain, for a derivative
ZERO_SD = 0.02  # of the largest force: a cell's zero, 0.1 % of its range where a sample uses a twentieth of that
_FOOT = 0.01  # of the strain at a part's end: a part that starts nearer to the foot starts at it
_SMOOTH = 5  # degree of the polynomial that represents a curve of few points
_LONGER = 1.15  # ratio of strain ranges beyond which the law of the longer range is chosen
_DIFFER = 2.0  # standard deviations, by which two numbers differ: 95 %
_BETTER = 0.8  # ratio of departures below which the line is chosen where both hold equally far


@dataclass(frozen=True)
class CompressionModulus:
    """E by the law that holds over the first part of the curve [Pa], its standard uncertainty, the part's ends, and
    where the curve leaves the law.

    Strains count from the foot of the curve, compression or tension positive. `leaves_at_strain` and `leaves_at_stress`
    are None where the curve follows the law to its end; `departure` is the rms residual of the part over its range of
    stress. The uncertainty includes noise and the change of slope within the part, not friction at the platens or the
    sample's size.
    """

    modulus: float
    uncertainty: float
    first_strain: float
    last_strain: float
    leaves_at_strain: float | None
    leaves_at_stress: float | None
    is_straight: bool
    departure: float
    is_pressed: bool  # whether it ends in compression
    is_series: bool = False  # by Rivlin's series

    @property
    def load(self) -> str:
        """How the sample was loaded, in words."""
        if self._first_strain < 0 < self.last_strain:
            return "compression and tension"
        return "compression" if self.is_pressed else "tension"

    @property
    def _first_strain(self) -> float:
        return 0.0 if abs(self.first_strain) < _FOOT * self.last_strain else self.first_strain

    @property
    def statement(self) -> str:
        """The law and its range in words."""
        law = "straight" if self.is_straight else "neo-Hookean"
        if self.is_series:
            law = "E at no strain of Rivlin's series, as its modulus changes with strain,"
        first = self._first_strain
        begins, ends = ("pulled", "pressed") if self.is_pressed else ("pressed", "pulled")
        follows = f"{law} from {100 * first:.3g} to {100 * self.last_strain:.3g} % strain"
        if first < 0 < self.last_strain:
            follows = f"{law} from {begins} by {-100 * first:.3g} to {ends} by {100 * self.last_strain:.3g} %"
        if self.is_series:
            return follows
        if self.leaves_at_strain is None or self.leaves_at_stress is None:
            return f"{follows}, and not seen to leave the {'line' if self.is_straight else 'law'}"
        stress = float(to_lab("mean_stress_mpa", self.leaves_at_stress))
        off = "line" if self.is_straight else "law"
        return f"{follows}; leaves the {off} at {stress:.3g} MPa, {100 * self.leaves_at_strain:.3g} % from its foot"


@cached_while_alive  # a diagnosis composes some dozen models of the same recordings
def of_compression(recording: CompressionRecording) -> CompressionModulus:
    """The modulus of a `compression` recording."""
    return compression_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("sample_height_mm", recording.sample_height_mm)),
        float(to_si("sample_diameter_mm", recording.sample_diameter_mm)),
    )


def small_strain_modulus(recording: CompressionRecording) -> CompressionModulus:
    """The modulus of a `compression` recording, at no strain where it changes with strain.

    Rivlin's series, nominal stress = 2 (λ⁻² − λ) (C1 + C2/λ + C3 (I1 − 3) + C4 (I1 − 3)²), E = 6 (C1 + C2) (Rivlin &
    Saunders, Phil. Trans. R. Soc. A 243 (1951) 251), with a zero of the force and slack. It is used where it leaves
    only noise, with a zero as of a cell, tells E from 0, and gives another E than one modulus does. An uneven end bends
    the start of a curve as well: without that part, the series must still explain the branch surely better than one
    modulus does, and give the same E. A frame that gives changes the slope too: the uncertainty contains a uniform
    value between E so and by one modulus.
    """
    plain = of_compression(recording)
    height = float(to_si("sample_height_mm", recording.sample_height_mm))
    branch = _Branch.of_recording(recording)
    sign, noise, slack = branch.sign, branch.noise, is_one_sided(branch.stress)
    strain, stress = branch.thinned(height)
    early = int(np.argmax(stress >= _EARLY * stress.max())) if slack else 0  # of both signs, no end comes to bear
    if (sign * strain).max() > 1 - _LEAST_STRETCH or len(strain) - early < 2 * FEWEST:
        return plain
    several = _Series(sign, slack, 4)
    series, later = several.fitted(strain, stress, noise), several.fitted(strain[early:], stress[early:], noise)
    one = min(_Series(sign, slack, 1, law).fitted(strain[early:], stress[early:], noise).rms for law in (False, True))
    sure = (len(strain) - early) * float(np.log(one / max(later.rms, 1e-300)))  # nats of normal noise
    differ = abs(series.modulus - later.modulus) > _DIFFER * np.hypot(series.deviation, later.deviation)
    if series.rms > AS_NOISE * noise or abs(series.zero) > 1 or sure < SURE or differ:
        return plain
    if series.modulus < _DIFFER * series.deviation or abs(series.modulus - plain.modulus) < plain.uncertainty:
        return plain
    return replace(
        plain,
        modulus=series.modulus,
        uncertainty=float(np.hypot(series.deviation, (series.modulus - plain.modulus) / np.sqrt(3))),
        first_strain=max(0.0, float(strain[0] - series.foot)) if slack else float(strain[0] - series.foot),
        last_strain=float(strain[-1] - series.foot),
        leaves_at_strain=None,
        leaves_at_stress=None,
        is_straight=False,
        departure=series.rms / float(np.ptp(stress)),
        is_series=True,
    )


def is_neo_hookean(recording: CompressionRecording) -> bool:
    """Whether the whole loading branch of a `compression` recording is, within noise, that of a neo-Hookean solid of
    the stated height and load.

    Raises InvalidInput where the loading branch has too few points, or does not load.
    """
    height = float(to_si("sample_height_mm", recording.sample_height_mm))
    branch = _Branch.of_recording(recording)
    strain, stress = branch.thinned(height)
    law = _Series(branch.sign, is_one_sided(branch.stress), 1)
    return law.fitted(strain, stress, branch.noise).rms <= AS_NOISE * branch.noise


@dataclass(frozen=True)
class _Branch:
    """A loading branch: displacement [m] and nominal stress [Pa] (samples,), 1 where the stress rises or −1, the noise
    of a mean over a bin [Pa], and the displacement where the stress is about 0."""

    along: Floats
    stress: Floats
    sign: float
    noise: float
    foot: float

    @staticmethod
    def of(displacement: Floats, force: Floats, diameter: float) -> "_Branch":
        """Of a curve [m, N] of a cylinder of this diameter [m]."""
        along, load = loading_branch(displacement, force)
        stress = load / (np.pi / 4 * diameter**2)
        sign = 1.0 if stress[-1] >= stress[0] else -1.0
        noise = _noise(along, stress) / np.sqrt(max(1.0, len(along) / _POINTS))
        return _Branch(along, stress, sign, float(noise), float(along[np.abs(load).argmin()]))

    @staticmethod
    def of_recording(recording: CompressionRecording) -> "_Branch":
        """Of a `compression` recording."""
        return _Branch.of(
            to_si("displacement_mm", recording.displacement_mm),
            to_si("force_n", recording.force_n),
            float(to_si("sample_diameter_mm", recording.sample_diameter_mm)),
        )

    def thinned(self, height: float) -> tuple[Floats, Floats]:
        """Means of strain and stress over equal bins of strain, rising as it is loaded; `height` [m]."""
        return _thinned(self.sign * (self.along - self.foot) / height, self.sign * self.stress)


@dataclass(frozen=True)
class _SeriesFit:
    """E at no strain and its deviation [Pa], the strain of the foot, the zero over its deviation, and the rms residual
    [Pa]."""

    modulus: float
    deviation: float
    foot: float
    zero: float
    rms: float


@dataclass(frozen=True)
class _Series:
    """The first `terms` of Rivlin's series, E the first coefficient, or Hooke's line; else as `_Block`."""

    sign: float
    is_slack: bool
    terms: int
    is_line: bool = False

    def columns(self, strain: Floats) -> Floats:
        """The stress of each coefficient (samples, terms), and of a zero of the force."""
        if self.is_slack:
            strain = np.maximum(strain, 0.0)
        stretch = np.maximum(1.0 - self.sign * strain, _LEAST_STRETCH)
        invariant = stretch**2 + 2 / stretch - 3
        first = strain if self.is_line else self.sign * (stretch**-2 - stretch) / 3
        series = [first, first * (1 / stretch - 1), first * invariant, first * invariant**2]
        return np.column_stack([*series[: self.terms], np.ones_like(strain)])

    def fitted(self, strain: Floats, stress: Floats, noise: float) -> _SeriesFit:
        """The series with the foot that fits best, to all samples (samples,)."""
        zero = max(ZERO_SD * float(np.abs(stress).max()), 1e-300)
        span = float(np.ptp(strain))

        def solved(foot: float) -> tuple[Floats, Floats, Floats]:
            columns = self.columns(strain - foot)
            prior = np.append(np.zeros(self.terms), noise / zero)
            rows, values = np.vstack([columns, prior]), np.append(stress, 0.0)
            fitted: Floats = np.linalg.lstsq(rows, values, rcond=None)[0].astype(np.float64)
            return fitted, values - rows @ fitted, columns

        def misfit(foot: float) -> float:
            rest = solved(foot)[1]
            return float(rest @ rest)

        foot = least_misfit(misfit, span * np.linspace(-_FOOT_RANGE, _FOOT_RANGE, _FEET), 1e-9 * span)[0]
        fitted, rest, columns = solved(foot)
        step = _STEP * span
        moved = (self.columns(strain - foot - step) - self.columns(strain - foot + step)) @ fitted / (2 * step)
        rms = float(np.sqrt(rest @ rest / max(len(stress) - self.terms - 2, 1)))
        # `_deviation` takes the level as its second column
        around = np.column_stack([columns[:, [0, -1]], columns[:, 1:-1], moved])
        return _SeriesFit(
            float(fitted[0]), _deviation(around, max(noise, rms), zero), float(foot), float(fitted[-1]) / zero, rms
        )


def compression_modulus(displacement: Floats, force: Floats, height: float, diameter: float) -> CompressionModulus:
    """The modulus of a cylinder; compression positive, or tension with both negative.

    Raises InvalidInput where the loading branch has too few points, or does not load.
    """
    branch = _Branch.of(displacement, force, diameter)
    along, stress, sign, noise, foot = branch.along, branch.stress, branch.sign, branch.noise, branch.foot
    line = _by_law(along, stress, height, sign, noise, foot, straight=True)
    if (along.max() - foot) / height > 1 - _LEAST_STRETCH:  # displacement beyond the sample's height: a slip of units
        return line
    neo_hookean = _by_law(along, stress, height, sign, noise, foot, straight=False)
    by_law, by_line = (fit.last_strain - fit.first_strain for fit in (neo_hookean, line))
    if max(by_law, by_line) > _LONGER * min(by_law, by_line):
        return line if by_line > by_law else neo_hookean
    return line if line.departure < _BETTER * neo_hookean.departure else neo_hookean


def _by_law(
    along: Floats, stress: Floats, height: float, sign: float, noise: float, foot: float, *, straight: bool
) -> CompressionModulus:
    """The modulus by one law; `foot`: displacement where the stress is about 0; `sign`: 1 where the stress rises."""
    laws: list[Callable[[Floats], Floats]] = [_hooke]
    if not straight:
        laws = [_Block(sign, is_slack=False), *_ROUNDS * [_Block(sign, is_one_sided(stress))]]
    for law, following in zip(laws, [*laws[1:], None], strict=True):
        strain, binned = _thinned(sign * (along - foot) / height, sign * stress)
        first, last = _first_straight(law(strain), binned, noise)
        part = slice(first, last + 1)
        if straight:
            break
        if is_one_sided(stress):
            # Only all samples show which of the first ones are slack
            fitted = part if following in (law, None) else slice(0, last + 1)
            moved = _foot(following or law, strain[fitted], binned[fitted], noise)
        else:  # the curve itself shows where the stress is 0
            slope, level = np.polyfit(law(strain)[part], binned[part], 1)
            moved = -float(level / slope) if slope > 0 else 0.0
        foot, strain = foot + sign * height * moved, strain - moved
    stretched = law(strain)
    zero = max(ZERO_SD * float(np.abs(binned).max()), 1e-300)
    columns = np.column_stack([stretched[part], np.ones(last + 1 - first)])
    slope, level = (float(value) for value in np.linalg.lstsq(columns, binned[part], rcond=None)[0])
    if not straight:
        slope, level = _with_zero(columns, binned[part], noise / zero)[0]
        step = _STEP * float(np.ptp(strain))
        columns = np.column_stack([columns, slope * (law(strain - step) - law(strain + step))[part] / (2 * step)])
    rest = binned[part] - level - slope * stretched[part]
    freedom = max(len(rest) - columns.shape[1], 1)
    deviation = max(noise, float(np.sqrt(rest @ rest / freedom * correlation_factor(rest))))
    change = _change(stretched[part], binned[part], noise)
    leaves = _leaves(stretched, binned, slope, level, last, noise)
    foot_strain = -level / slope if straight and slope else 0.0  # else counted from there already
    first_strain = float(strain[first] - foot_strain)
    return CompressionModulus(
        modulus=slope,
        uncertainty=float(np.hypot(_deviation(columns, deviation, zero), change)),
        first_strain=max(first_strain, 0.0) if is_one_sided(stress) else first_strain,  # slack before
        last_strain=float(strain[last] - foot_strain),
        leaves_at_strain=None if leaves is None else float(strain[leaves] - foot_strain),
        leaves_at_stress=None if leaves is None else float(binned[leaves]),
        is_straight=straight,
        departure=float(np.sqrt(np.mean(rest**2)) / max(float(np.ptp(binned[part])), 1e-300)),
        is_pressed=sign > 0,
    )


def _hooke(strain: Floats) -> Floats:
    return strain


@dataclass(frozen=True)
class _Block:
    """Nominal stress over E of the neo-Hookean solid at strains that are positive as it is loaded; `sign`: 1 in
    compression, −1 in tension. `is_slack`: without stress before."""

    sign: float
    is_slack: bool

    def __call__(self, strain: Floats) -> Floats:
        if self.is_slack:
            strain = np.maximum(strain, 0.0)
        stretch = np.maximum(1.0 - self.sign * strain, _LEAST_STRETCH)
        return np.asarray(self.sign * (stretch**-2 - stretch) / 3)


def _foot(law: Callable[[Floats], Floats], strain: Floats, stress: Floats, noise: float) -> float:
    """The strain at which the sample is unloaded, by least squares with a zero of the force known to `ZERO_SD`."""
    weight = noise / max(ZERO_SD * float(np.abs(stress).max()), 1e-300)

    def misfit(foot: float) -> float:
        columns = np.column_stack([law(strain - foot), np.ones_like(strain)])
        return _with_zero(columns, stress, weight)[1]

    span = float(np.ptp(strain))
    return least_misfit(misfit, span * np.linspace(-_FOOT_RANGE, _FOOT_RANGE, _FEET), 1e-9 * span)[0]


def _with_zero(columns: Floats, stress: Floats, weight: float) -> tuple[Floats, float]:
    """The coefficients of two columns, the second with a prior around 0 of this weight, and the sum of squares."""
    weight = float(np.hypot(weight, _STRAIGHT / ZERO_SD))  # nor is the law better known than by its departure
    rows, values = np.vstack([columns, [0.0, weight]]), np.append(stress, 0.0)
    fitted: Floats = np.linalg.lstsq(rows, values, rcond=None)[0].astype(np.float64)
    rest = values - rows @ fitted
    return fitted, float(rest @ rest)


def _deviation(columns: Floats, noise: float, zero: float) -> float:
    """The standard deviation of the slope, the first column's factor, under noise; `zero`: that of the level, the
    second's, before the fit."""
    prior = np.zeros((1, columns.shape[1]))
    prior[0, 1] = noise / zero
    normal = np.vstack([columns, prior])
    size = np.linalg.norm(normal, axis=0)
    if not size[0] > 0:
        return np.inf
    size = np.where(size > 0, size, 1.0)
    return noise * float(np.sqrt(np.linalg.pinv((normal / size).T @ (normal / size))[0, 0])) / float(size[0])


def _change(stretched: Floats, stress: Floats, noise: float) -> float:
    """The standard deviation of a slope that changes evenly between those of the halves, beyond what noise gives."""
    middle = (len(stress) + 1) // 2
    slopes, variances = [], []
    for half in (slice(0, middle), slice(middle, None)):
        about = stretched[half] - stretched[half].mean()
        square = float(about @ about)
        slopes.append(float(about @ stress[half]) / square if square > 0 else 0.0)
        variances.append(noise**2 / square if square > 0 else 0.0)
    return float(np.sqrt(max((slopes[1] - slopes[0]) ** 2 - sum(variances), 0.0) / 12))


def _thinned(strain: Floats, stress: Floats) -> tuple[Floats, Floats]:
    """Means over equal bins of strain, in order."""
    bins = np.clip(((strain - strain.min()) / np.ptp(strain) * _POINTS).astype(int), 0, _POINTS - 1)
    _, member, count = np.unique(bins, return_inverse=True, return_counts=True)
    return np.bincount(member, strain) / count, np.bincount(member, stress) / count


def _noise(along: Floats, values: Floats) -> float:
    """Noise of one point: by second differences, negligible in a smooth curve of many points, and at most the residual
    of a polynomial, since in a curve of few points curvature exceeds the noise."""
    if len(values) < 3:
        return 0.0
    by_difference = float(1.4826 * np.median(np.abs(np.diff(values, n=2))) / np.sqrt(6))
    position = 2 * (along - along.min()) / np.ptp(along) - 1
    degree = min(_SMOOTH, len(values) - 3)
    powers = np.polynomial.legendre.legvander(position, degree)
    residual = values - powers @ np.linalg.lstsq(powers, values, rcond=None)[0]
    freedom = max(len(values) - degree - 1, 1)
    return min(by_difference, float(np.sqrt(residual @ residual / freedom)))


def _first_straight(strain: Floats, stress: Floats, noise: float) -> tuple[int, int]:
    """First and last point of the longest straight part among those that start early.

    A toe is skipped; a steeper start, where the stress lies below the line, is not.
    """
    best = (0, min(len(strain), FEWEST) - 1)
    least = _LEAST * float(np.ptp(stress))
    for first in range(0, len(strain) - FEWEST, max(1, len(strain) // 100)):
        for last in range(len(strain) - 1, first + FEWEST - 2, -max(1, len(strain) // 200)):
            if strain[last] - strain[first] <= strain[best[1]] - strain[best[0]]:
                break
            if stress[first] > _EARLY * stress[last]:
                continue
            part = slice(first, last + 1)
            middle, level = float(strain[part].mean()), float(stress[part].mean())
            x, y = strain[part] - middle, stress[part] - level
            rest = stress - level - (x @ y) / (x @ x) * (strain - middle)
            most = _STRAIGHT * (stress[last] - stress[first])
            allowed = np.minimum(most, _LOCALLY * np.abs(stress[part]) + least) + 4 * noise
            if (np.abs(rest[part]) <= allowed).all() and (rest[:first] >= -most - 4 * noise).all():
                best = (first, last)
                break
    return best


def _leaves(strain: Floats, stress: Floats, slope: float, level: float, last: int, noise: float) -> int | None:
    """The first point from which on the curve stays off the line."""
    line = level + slope * strain
    off = np.abs(stress - line) > _LEAVES * np.abs(stress) + 3 * noise
    off[: last // 2] = False
    staying = np.flatnonzero(~off)
    start = int(staying[-1]) + 1 if len(staying) else last
    return start if start < len(strain) else None
