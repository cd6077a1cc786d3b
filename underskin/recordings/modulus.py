"""Young's modulus from the first loading branch of a single curve of a sphere. SI inside.

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
from underskin.recordings.campaign import IndentationRecording
from underskin.recordings.curve_course import roughness
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


def least_misfit(misfit: Callable[[float], float], guesses: Floats, error: float) -> tuple[float, int]:
    """Where the misfit is least, to within an error, near the best of rising guesses; and the index of that."""
    best = int(np.argmin([misfit(guess) for guess in guesses.tolist()]))
    around = float(guesses[max(best - 1, 0)]), float(guesses[min(best + 1, len(guesses) - 1)])
    return float(minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": error}).x), best


_AIR = 5  # points before contact needed for a force offset
_CONTACTS = 200  # contact points tried
_THINNED = 300  # samples by which powers are compared
_DEEPEST_OF_RADIUS = 2.0  # a/R is 0.96 there: a sphere pressed deeper is held at its equator
_DEEPEST_OF_THICKNESS = 0.5  # largest depth of the linear layer: strains are of order 1 beyond
_PLAINLY = 0.7  # ratio of residuals below which the half space is chosen instead of the layer
_MISSES = 0.01  # least rms residual of a wrong law beyond the noise, of the range of force
SURE = 10.0  # nats that another of the 24 powers gains, of which ln 24 would be chance
_POWERS = np.arange(0.7, 3.05, 0.1)  # powers of the depth that are compared with the law
_TAKES = 0.4  # largest residual of another power, of the law's, where the law is wrong
AS_NOISE, _AS_IDEAL = 1.5, 1e-3  # largest residual of a sufficient law: times the noise, and of the force
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
        misses = f", {times:.2g} times the noise: the law is incomplete" if times > AS_NOISE else ""
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
        variance = float(fit.residual @ fit.residual) / freedom * correlation_factor(fit.residual)
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
        if _beyond(best, noise) > _TAKES * missed or gained < SURE or _SPHERES[0] <= power <= _SPHERES[1]:
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
        is_plain = best < max(AS_NOISE * noise, _AS_IDEAL * span)
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
    contact_point, best = least_misfit(misfit, guesses, 1e-9 * span)
    return contact_point, not offset and best == 0


def correlation_factor(residual: Floats) -> float:
    """Factor of the variance for residuals with correlation between neighbours, (1 + ρ)/(1 − ρ)."""
    power = float(residual @ residual)
    if power == 0:
        return 1.0
    alike = float(np.clip(residual[1:] @ residual[:-1] / power, 0.0, 0.99))
    return (1 + alike) / (1 - alike)
