"""Young's modulus from the first loading branch of a single curve. SI inside.

Cylinders in compression or tension: two laws are tried, each over the first part of the curve that follows it, the
incompressible neo-Hookean solid between smooth platens, nominal stress = (E/3)(λ⁻² − λ) with λ = 1 − strain,
compression positive, and Hooke's line, nominal stress = E strain. The law that holds over more strain is used; with
equal ranges the line if its residual is smaller, else the neo-Hookean law.

Indentations: F = F0 + E' f(d − d0) with a free contact point d0 and f of a sphere on a layer of the declared thickness,
else on a half space; of the full sphere where it is pressed deep (physics/sphere_law.py). No modulus is quoted where
the law does not hold: pressed deeper than its range, or with another power of depth than a sphere's: 1 under a flat
punch or with a compliant stage, 3/2 under a small sphere, 2 under a cone, above 3/2 on a layer of undeclared thickness.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from underskin.errors import InvalidInput, too_few, unequal_lengths, unusable
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.physics.sphere_law import PARABOLOID, Softening, SphereLaw
from underskin.recordings.campaign import CompressionRecording, IndentationRecording
from underskin.recordings.curve_course import is_one_sided, roughness
from underskin.units import Floats, to_lab, to_si

FEWEST = 8  # samples


def loading_branch(along: Floats, load: Floats) -> tuple[Floats, Floats]:
    """The samples up to the largest load (samples,), of those where both are finite.

    `along` is the displacement or the strain, `load` the force or the stress, in any units. Raises InvalidInput where
    the two differ in length, fewer than `FEWEST` samples load, or nothing moves.
    """
    if len(along) != len(load):
        raise unequal_lengths("force_n", len(load), len(along), "displacement_mm")
    finite = np.isfinite(along) & np.isfinite(load)
    along, load = along[finite], load[finite]
    if len(load) < FEWEST:
        raise too_few("force_n", f"{len(load)} samples", f"must load over at least {FEWEST} entries")
    top = int(np.argmax(np.abs(load - load[0])))
    if top + 1 < FEWEST:
        raise too_few("force_n", f"largest at entry {top}", f"must load over at least {FEWEST} entries")
    if along[top] == along[0]:
        raise unusable(
            "displacement_mm", None, "must differ between the first sample and the one with the largest force"
        )
    return along[: top + 1], load[: top + 1]


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
        first = self._first_strain
        begins, ends = ("pulled", "pressed") if self.is_pressed else ("pressed", "pulled")
        follows = f"{law} from {100 * first:.3g} to {100 * self.last_strain:.3g} % strain"
        if first < 0 < self.last_strain:
            follows = f"{law} from {begins} by {-100 * first:.3g} to {ends} by {100 * self.last_strain:.3g} %"
        if self.leaves_at_strain is None or self.leaves_at_stress is None:
            return f"{follows}, and not seen to leave the {'line' if self.is_straight else 'law'}"
        stress = float(to_lab("mean_stress_mpa", self.leaves_at_stress))
        off = "line" if self.is_straight else "law"
        return f"{follows}; leaves the {off} at {stress:.3g} MPa, {100 * self.leaves_at_strain:.3g} % from its foot"


def of_compression(recording: CompressionRecording) -> CompressionModulus:
    """The modulus of a `compression` recording."""
    return compression_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("sample_height_mm", recording.sample_height_mm)),
        float(to_si("sample_diameter_mm", recording.sample_diameter_mm)),
    )


def compression_modulus(displacement: Floats, force: Floats, height: float, diameter: float) -> CompressionModulus:
    """The modulus of a cylinder; compression positive, or tension with both negative.

    Raises InvalidInput where the loading branch has too few points, or does not load.
    """
    along, load = loading_branch(displacement, force)
    stress = load / (np.pi / 4 * diameter**2)
    sign = 1.0 if stress[-1] >= stress[0] else -1.0
    noise = _noise(along, stress) / np.sqrt(max(1.0, len(along) / _POINTS))
    foot = float(along[np.abs(load).argmin()])
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
    deviation = max(noise, float(np.sqrt(rest @ rest / freedom * _correlation_factor(rest))))
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
    return _least(misfit, span * np.linspace(-_FOOT_RANGE, _FOOT_RANGE, _FEET), 1e-9 * span)[0]


def _least(misfit: Callable[[float], float], guesses: Floats, error: float) -> tuple[float, int]:
    """Where the misfit is least, to within an error, near the best of rising guesses; and the index of that."""
    best = int(np.argmin([misfit(guess) for guess in guesses.tolist()]))
    around = float(guesses[max(best - 1, 0)]), float(guesses[min(best + 1, len(guesses) - 1)])
    return float(minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": error}).x), best


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


_AIR = 5  # points before contact needed for a force offset
_CONTACTS = 200  # contact points tried
_THINNED = 300  # samples by which powers are compared
_DEEPEST_OF_RADIUS = 2.0  # a/R is 0.96 there: a sphere pressed deeper is held at its equator
_DEEPEST_OF_THICKNESS = 0.5  # largest depth of the linear layer: strains are of order 1 beyond
_NOT_ALL = 3.0  # residual over a sample's noise, beyond which the law is incomplete
_PLAINLY = 0.7  # ratio of residuals below which the half space is chosen instead of the layer
_MISSES = 0.01  # least rms residual of a wrong law beyond the noise, of the range of force
_SURE = 10.0  # nats that another of the 24 powers gains, of which ln 24 would be chance
_POWERS = np.arange(0.7, 3.05, 0.1)  # powers of the depth that are compared with the law
_TAKES = 0.4  # largest residual of another power, of the law's, where the law is wrong
_AS_NOISE, _AS_IDEAL = 1.5, 1e-3  # largest residual of a sufficient power: times the noise, and of the force
_SPHERES = 1.25, 1.8  # apparent powers of a sphere with adhesion, creep, stiffening or a compliant stage


@dataclass(frozen=True)
class IndentationModulus:
    """The modulus [Pa] with its standard uncertainty, the contact point d0 [m] and the rms residual [N].

    `noise` [N]: of a sample; `depth` [m]: the largest; `radius` and `thickness` [m]: of the law, None for a half space.
    The uncertainty follows from the residuals and their correlation from point to point. A `residual` far above the
    noise means that the law is incomplete and E holds for this curve only.
    """

    modulus: float
    uncertainty: float
    contact_point: float
    residual: float
    depth: float
    radius: float
    thickness: float | None
    declared_thickness: float | None
    noise: float
    finite_strain: float = 0.0  # increase of E by the solved contact [Pa]
    load = "indentation"  # in words

    @property
    def statement(self) -> str:
        """The law, the contact point, the depth and the residual in words."""
        contact = float(to_lab("displacement_mm", self.contact_point))
        over = f"{self.depth / self.radius:.2g} of the radius"
        if self.declared_thickness is not None:
            over += f", {self.depth / self.declared_thickness:.2g} of the thickness"
        strain = (
            f"; up to {100 * self.finite_strain / self.modulus:.2g} % more by finite strain"
            if 0 < self.finite_strain < self.modulus
            else ""
        )
        times = self.residual / self.noise if self.noise > 0 else 0.0
        misses = f", {times:.2g} times the noise: the law is not all" if times > _NOT_ALL else ""
        return (
            f"sphere on a {self._body}, contact from {contact:.4g} mm, pressed {over} deep; it leaves "
            f"{self.residual:.2g} N (root mean square{misses}){strain}"
        )

    @property
    def _body(self) -> str:
        if self.thickness is not None:
            return f"bonded layer of {float(to_lab('thickness_mm', self.thickness)):.3g} mm"
        return "half space" if self.declared_thickness is not None else "half space (no thickness is declared)"


@dataclass(frozen=True)
class _Fit:
    """A law with its contact point fitted to a loading branch: the design (samples, 1 or 2) and its coefficients."""

    law: Callable[[Floats], Floats]
    contact: float
    design: Floats
    fitted: Floats
    residual: Floats
    at_bound: bool

    @property
    def rms(self) -> float:
        """The root mean square of the residual."""
        return float(np.sqrt(np.mean(self.residual**2)))


def of_indentation(
    recording: IndentationRecording,
    poisson_ratio: float,
    thickness_mm: float | None = None,
    softening: Softening | None = None,
) -> IndentationModulus:
    """The modulus of an `indentation` recording; raises InvalidInput where no number can be quoted."""
    thickness = None if thickness_mm is None else float(to_si("thickness_mm", thickness_mm))
    return indentation_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("indenter_radius_mm", recording.indenter_radius_mm)),
        poisson_ratio,
        thickness,
        softening,
    )


def indentation_modulus(
    displacement: Floats,
    force: Floats,
    radius: float,
    poisson_ratio: float,
    thickness: float | None = None,
    softening: Softening | None = None,
) -> IndentationModulus:
    """The modulus with a free contact point, and a free force offset where there are points before contact.

    The modulus is that of the linear contact. The effect of finite strain on the depth is known for one contact only
    (`softening`): the uncertainty is that of a uniform value between the moduli without and with it.
    Raises InvalidInput where the loading branch has too few points, does not load, or does not determine the modulus,
    where it is deeper than the law holds, and where it follows no sphere's law.
    """
    pressed = _Pressed.of(displacement, force, radius, poisson_ratio, thickness)
    fit, used = pressed.by_sphere
    if fit.at_bound:
        allowed = "must show where contact begins: record from the air, or deeper, so that the force bends"
        raise unusable("displacement_mm", None, allowed)
    result = pressed.modulus()
    require_depth(result)
    tip = pressed.tip()
    if tip is not None:
        raise tip.refusal
    if softening is None:
        return result
    more = float(pressed.fitted(used, softening).fitted[0] - fit.fitted[0]) * (1 - poisson_ratio**2)
    return replace(result, uncertainty=float(np.hypot(result.uncertainty, more / np.sqrt(3))), finite_strain=more)


def estimate(
    displacement: Floats, force: Floats, radius: float, poisson_ratio: float, thickness: float | None = None
) -> IndentationModulus:
    """The modulus without checks of the law, as a starting value of fits."""
    return _Pressed.of(displacement, force, radius, poisson_ratio, thickness).modulus()


def require_depth(result: IndentationModulus) -> None:
    """Raise InvalidInput where the depth is beyond the law of a sphere, or of a layer."""
    of_radius = result.depth / result.radius
    depth_mm, radius_mm = (float(to_lab("displacement_mm", length)) for length in (result.depth, result.radius))
    if of_radius > _DEEPEST_OF_RADIUS:
        allowed = (
            f"is {of_radius:.2g} times the declared radius of {radius_mm:.3g} mm, where no sphere's law holds (at most "
            f"{_DEEPEST_OF_RADIUS:g} times): is the tip a cone, or the radius another? "
            "Press less deep, or a larger sphere"
        )
        raise unusable("displacement_mm", f"a depth of {depth_mm:.3g} mm", allowed)
    if result.declared_thickness is None:
        return
    of_thickness = result.depth / result.declared_thickness
    layer = SphereLaw(result.radius, result.declared_thickness, INCOMPRESSIBLE)
    if of_thickness > _DEEPEST_OF_THICKNESS or result.depth >= layer.deepest:
        allowed = (
            f"is {of_thickness:.2g} of the declared thickness, where the linear layer's law does not hold (at most "
            f"{_DEEPEST_OF_THICKNESS:g}, and a contact of at most 4 thicknesses): press less deep, or a thicker sample"
        )
        raise unusable("displacement_mm", f"a depth of {depth_mm:.3g} mm", allowed)


@dataclass(frozen=True)
class Tip:
    """A curve that follows no sphere's law: the power of the depth, and why no modulus follows."""

    power: float
    refusal: InvalidInput
    is_plain: bool  # the power leaves only noise: no sphere with a further effect is needed

    @property
    def is_blunt(self) -> bool:
        """Whether it looks like a flat punch or a compliant stage, from which no modulus can be determined."""
        return self.power < _SPHERES[0]


def tip_of(
    displacement: Floats, force: Floats, radius: float, poisson_ratio: float, thickness: float | None
) -> Tip | None:
    """The apparent tip where it is clearly no sphere; else None."""
    return _Pressed.of(displacement, force, radius, poisson_ratio, thickness).tip()


def _beyond(rms: float, noise: float) -> float:
    """The part of a residual that is not noise."""
    return float(np.sqrt(max(rms**2 - noise**2, 0.0)))


@dataclass(frozen=True)
class _Pressed:
    """The loading branch of a sphere: `depth` [m] and `load` [N] (samples,), its `radius` [m], and the Poisson ratio
    and the declared `thickness` [m] of the layer, None without one."""

    depth: Floats
    load: Floats
    radius: float
    poisson_ratio: float
    thickness: float | None

    @classmethod
    def of(
        cls, displacement: Floats, force: Floats, radius: float, poisson_ratio: float, thickness: float | None
    ) -> "_Pressed":
        """Of a whole curve; raises InvalidInput as `loading_branch`."""
        return cls(*loading_branch(displacement, force), radius, poisson_ratio, thickness)

    def fitted(self, thickness: float | None, softening: Softening | None = None) -> _Fit:
        """The law on a layer, or on the half space, fitted: of the full sphere instead of the paraboloid where it is
        pressed deep."""
        fit = _fitted(self.depth, self.load, SphereLaw(self.radius, thickness, self.poisson_ratio, softening))
        if self.depth.max() - fit.contact < PARABOLOID * self.radius:
            return fit
        full = SphereLaw(self.radius, thickness, self.poisson_ratio, softening, full_sphere=True)
        return _fitted(self.depth, self.load, full)

    @cached_property
    def by_sphere(self) -> tuple[_Fit, float | None]:
        """The fit on the declared layer, or on the half space where that fits clearly better; and its thickness."""
        half_space = self.fitted(None)
        layer = half_space if self.thickness is None else self.fitted(self.thickness)
        return (half_space, None) if half_space.rms < _PLAINLY * layer.rms else (layer, self.thickness)

    def modulus(self) -> IndentationModulus:
        """The modulus by that fit."""
        fit, thickness = self.by_sphere
        # d0 is a parameter as well: its column is the slope of the model.
        step = 1e-4 * float(np.ptp(self.depth))
        behind, before = (fit.law(self.depth - fit.contact + shift) for shift in (-step, step))
        jacobian = np.column_stack([fit.design, fit.fitted[0] * (behind - before) / (2 * step)])
        freedom = max(1, len(self.load) - jacobian.shape[1])
        variance = float(fit.residual @ fit.residual) / freedom * _correlation_factor(fit.residual)
        deviation = float(np.sqrt(variance)) * _amplification(jacobian)
        per_reduced = 1 - self.poisson_ratio**2
        return IndentationModulus(
            modulus=float(fit.fitted[0] * per_reduced),
            uncertainty=float(deviation * per_reduced),
            contact_point=fit.contact,
            residual=fit.rms,
            depth=float(self.depth.max() - fit.contact),
            radius=self.radius,
            thickness=thickness,
            declared_thickness=self.thickness,
            noise=roughness(self.load),
        )

    def tip(self) -> Tip | None:
        """The tip where another power n of the depth, (f(d − d0))^(n/1.5), which includes the stiffening of a declared
        layer, fits far better and is outside the range of spheres; else None."""
        fit, span, noise = self.by_sphere[0], float(np.ptp(self.load)), roughness(self.load)
        missed = _beyond(fit.rms, noise)
        if missed < _MISSES * span:
            return None
        at = np.unique(np.linspace(0, len(self.load) - 1, min(len(self.load), _THINNED)).round().astype(np.intp))
        depth, load = self.depth[at], self.load[at]
        fits = {float(power): _fitted(depth, load, _to_power(fit.law, float(power))) for power in _POWERS}
        power = min(fits, key=lambda power: fits[power].rms)
        best = fits[power].rms
        scale = max(noise, best, _AS_IDEAL * span)
        gained = len(at) * (fit.rms**2 - best**2) / (2 * scale**2)  # nats of normal noise
        if _beyond(best, noise) > _TAKES * missed or gained < _SURE or _SPHERES[0] <= power <= _SPHERES[1]:
            return None
        like = "as under a cone (2)"
        if power < _SPHERES[0]:
            like = "as under a flat punch (1), or where stage or cantilever give way"
        elif self.thickness is None:
            like += ", or on a thin layer whose thickness is not declared"
        allowed = (
            f"is {like}; a sphere has 1.5, and its law misses by {100 * fit.rms / span:.2g} % of the force, "
            f"{fit.rms / max(noise, 1e-300):.2g} times the noise: no modulus follows; look at the tip, and press a "
            "block of known modulus"
        )
        is_plain = best < max(_AS_NOISE * noise, _AS_IDEAL * span)
        return Tip(power, unusable("force_n", f"growth with the depth to the power {power:.2g}", allowed), is_plain)


def _to_power(law: Callable[[Floats], Floats], power: float) -> Callable[[Floats], Floats]:
    return lambda depth: law(depth) ** (power / 1.5)


def _fitted(depth: Floats, load: Floats, law: Callable[[Floats], Floats]) -> _Fit:
    contact, at_bound = _contact_point(depth, load, law, offset=True)
    with_offset = int((depth < contact).sum()) >= _AIR
    if not with_offset:
        contact, at_bound = _contact_point(depth, load, law, offset=False)
    pressed = law(depth - contact)
    design = np.column_stack([pressed, np.ones_like(pressed)]) if with_offset else pressed[:, None]
    fitted: Floats = np.linalg.lstsq(design, load, rcond=None)[0].astype(np.float64)
    return _Fit(law, contact, design, fitted, load - design @ fitted, at_bound)


def _amplification(jacobian: Floats) -> float:
    """The first parameter's standard deviation over that of the noise; raises InvalidInput where it has none."""
    size = np.linalg.norm(jacobian, axis=0)
    shape = jacobian / np.where(size > 0, size, 1)
    normal = shape.T @ shape
    if np.linalg.matrix_rank(normal, hermitian=True) < len(normal):
        allowed = "must tell the modulus from the contact point: more samples in contact"
        raise unusable("displacement_mm", f"{np.count_nonzero(jacobian[:, 0])} samples in contact", allowed)
    return float(np.sqrt(np.linalg.inv(normal)[0, 0]) / size[0])


def _contact_point(depth: Floats, load: Floats, law: Callable[[Floats], Floats], *, offset: bool) -> tuple[float, bool]:
    """d0 by least squares in force, before the first point where the recording starts in contact; and whether it lies
    at the end of the search range."""

    def misfit(contact: float) -> float:
        pressed = law(depth - contact)
        force = load
        if offset:
            pressed, force = pressed - pressed.mean(), force - force.mean()
        square = float(pressed @ pressed)
        return float(force @ force) - (float(pressed @ force) ** 2 / square if square > 0 else 0.0)

    span = float(np.ptp(depth))
    guesses = np.linspace(depth.min() - (0 if offset else span), depth.max() - 0.02 * span, _CONTACTS)
    contact_point, best = _least(misfit, guesses, 1e-9 * span)
    return contact_point, not offset and best == 0


def _correlation_factor(residual: Floats) -> float:
    """Factor of the variance for residuals with correlation between neighbours, (1 + ρ)/(1 − ρ)."""
    power = float(residual @ residual)
    if power == 0:
        return 1.0
    alike = float(np.clip(residual[1:] @ residual[:-1] / power, 0.0, 0.99))
    return (1 + alike) / (1 - alike)
