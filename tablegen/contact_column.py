"""One column of the contact table: one material contact edge, pressed by ever smaller spheres up to the largest load.

The mesh belongs to the edge, so each column has one, and every sphere starts from the one before. Along a column a/h
of the linear contact changes little and the strain varies, in which all quantities are smooth: splines in x = L^(1/3)
lead from the solved spheres to the table's nodes. They pass through x = 0, where the linear layer is exact. What is
kept is the difference from the exact linear contact at the same force, sphere and layer, `tablegen.linear_contact`.

Spheres that stick (`tablegen.sticking`) are solved in order of their edges. Their first one is close to x = 0; the last
one may be an eighth before the largest x, where wide ones lose their stability at the edge: the splines lead on to it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from threadpoolctl import threadpool_limits

from tablegen.base_stress import PROFILE_END, BaseStress, disc_averages
from tablegen.contact import ContactLayer, PressedState
from tablegen.contact_mesh import contact_mesh
from tablegen.discretisation import discretise
from tablegen.linear_contact import LinearContact, LinearSphere
from tablegen.linear_layer import transmission
from tablegen.neo_hookean import NEO_HOOKEAN, SHEAR_MODULUS, Material
from tablegen.newton import State
from tablegen.sticking import StickingLayer, Touched
from underskin.errors import SolverError
from underskin.physics import hertz
from underskin.physics.hankel_transform import normal_stress, punch_transform
from underskin.units import Floats

_SMALLEST_STEP = 1 / 32  # of the way from one sphere to the next
_SPHERES = 8  # of a column, evenly in x
_SMALL = 1e-3  # of the largest x, for the first sphere that sticks
RADII = np.concatenate([np.linspace(0, 4, 65), np.linspace(4, PROFILE_END, 33)[1:]])  # r/h of the profile


@dataclass(frozen=True)
class SphereSolution:
    """The solution for one sphere; lengths in thicknesses, forces in G h².

    Attributes
    ----------
    linear : LinearSphere
        The exact linear contact at the same force.
    correction : ndarray, (RADII,)
        Stress on the base less that of the linear contact, in σ's scale.
    sigma, sigma_increment : ndarray, (rho,)
        σ of the force and of its increment d(Fσ)/dF at fixed R, for each sensor radius.
    force_error : float
        Force on the base over that on the sphere, minus 1.
    lowest_pressure : float
        Lowest over highest pressure in the contact.
    """

    material: Material
    radius: float
    force: float
    contact_radius: float
    indentation: float
    stiffness: float
    linear: LinearSphere
    correction: Floats
    sigma: Floats
    sigma_increment: Floats
    force_error: float
    lowest_pressure: float

    @property
    def cbrt_load(self) -> float:
        """L^(1/3), with L (0.75/(1 − ν²))² in place of L, as of an incompressible layer."""
        load = hertz.load_parameter(self.force, self.radius, self.material.youngs_modulus)
        return float(np.cbrt(load * (0.75 / (1 - self.material.poisson_ratio**2)) ** 2))

    def over_linear(self) -> Floats:
        """Contact radius, indentation and stiffness over those of the linear contact, then the correction."""
        linear = self.linear
        ratios = (
            self.contact_radius / linear.alpha,
            self.indentation / linear.indentation,
            self.stiffness / linear.stiffness,
        )
        return np.concatenate([ratios, self.correction])


def solve_contact_column(
    a: float,
    cbrt_load: Floats,
    order: int,
    material: Material = NEO_HOOKEAN,
    earlier: Sequence[Touched] | None = None,
) -> tuple[Floats, Floats, float, Touched]:
    """Solve one column of the contact table.

    Parameters
    ----------
    a : float
        Material contact edge a/h before pressing.
    cbrt_load : ndarray, (x,)
        x = L^(1/3), ascending from 0.
    order : int
        Order of the displacement elements.
    material : Material
        Of the layer; default: incompressible and neo-Hookean.
    earlier : sequence of Touched, optional
        The smaller edges, ascending, of a contact that sticks; default: a frictionless one.

    Returns
    -------
    alpha : ndarray, (x,)
        a/h of the linear contact under the force; NaN from where it is beyond `linear_contact`'s range.
    values : ndarray, (x, quantities)
        As `SphereSolution.over_linear`.
    force_error : float
        The largest over the column.
    touched : Touched
        Where its edge was touched, for wider contacts that stick.

    Raises
    ------
    SolverError
        Names the point where Newton's method did not converge.
    """
    targets = cbrt_load[-1] * np.arange(1, _SPHERES + 1) / _SPHERES
    if earlier is not None:
        targets = np.append(_SMALL * cbrt_load[-1], targets)
    spheres: list[SphereSolution] = []
    with threadpool_limits(1):  # the same bits whatever the number of cores
        try:
            spheres.extend(_Column(a, np.zeros(0), order, material, earlier).follow(targets))
        except SolverError:
            if earlier is None or len(spheres) < _SPHERES:
                raise
    x = np.array([sphere.cbrt_load for sphere in spheres])
    rows = np.array([np.append(sphere.linear.alpha, sphere.over_linear()) for sphere in spheres])
    strain = np.array([a / sphere.radius for sphere in spheres])
    touched = Touched(a, strain, np.array([sphere.contact_radius / a - 1 for sphere in spheres]) / strain)
    reached = x[-1] if earlier is None else cbrt_load[-1]
    if earlier is None:
        vanishing = np.concatenate([[a, 1.0, 1.0, 1.0], np.zeros(RADII.size)])
        x, rows = np.append(0.0, x), np.vstack([vanishing, rows])
    resampled = np.asarray(make_interp_spline(x, rows, k=min(5, len(rows) - 1))(cbrt_load))
    resampled[cbrt_load > reached] = np.nan
    return resampled[:, 0], resampled[:, 1:], max(abs(sphere.force_error) for sphere in spheres), touched


def press_spheres(
    a: float,
    radii: Floats,
    rho: Floats,
    order: int,
    material: Material = NEO_HOOKEAN,
    earlier: Sequence[Touched] | None = None,
) -> list[SphereSolution]:
    """Spheres of these radii (descending, in thicknesses), each touching up to the material radius `a` (a/h)."""
    column = _Column(a, rho, order, material, earlier)
    return [column.advance(float(radius)) for radius in radii]


def _strain(cbrt_load: float, ratio: float) -> float:
    """a/R from L = (16/9) (a/R)³ · ratio."""
    return float(cbrt_load * np.cbrt(9 / 16 / ratio))


class BeyondLinearContactError(SolverError):
    """The linear contact under the same force is wider than `tablegen.linear_contact` calculates it."""


class _Column:
    """The layer pressed up to one contact edge; knows the last sphere."""

    def __init__(
        self, a: float, rho: Floats, order: int, material: Material, earlier: Sequence[Touched] | None
    ) -> None:
        d = discretise(contact_mesh(a), order)
        self.layer = ContactLayer(d, a, material) if earlier is None else StickingLayer(d, a, material, earlier)
        self.base = BaseStress(self.layer.discretisation)
        self.linear = LinearContact(np.minimum(self.base.points, PROFILE_END), rho, material.poisson_ratio)
        self.a, self.rho, self.material = a, rho, material
        self.now, self.strain = self.layer.untouched(), 0.0

    def follow(self, targets: Floats) -> Iterator[SphereSolution]:
        """Spheres whose x is near each target, the last one's at or beyond it, as far as the linear contact is
        known."""
        reached, ratio = 0.0, 1.0 + self.a  # of the force over Hertz's for a: a first guess
        further = iter(targets)
        while reached < targets[-1]:
            target = next((target for target in further if target > reached), 1.02 * targets[-1])
            try:
                sphere = self.advance(self.a / _strain(target, ratio))
            except BeyondLinearContactError:
                return
            reached, ratio = sphere.cbrt_load, sphere.cbrt_load**3 / (16 / 9 * (self.a / sphere.radius) ** 3)
            yield sphere

    def advance(self, radius: float) -> SphereSolution:
        """To the next sphere, in smaller steps where Newton's method needs them."""
        goal = self.a / radius
        step = goal - self.strain
        smallest = _SMALLEST_STEP * step
        while self.strain < goal:
            strain = min(goal, self.strain + step)
            try:
                self.now = self.layer.press(self._scaled(strain), self.a / strain)
            except SolverError as failure:
                step /= 2
                if step < smallest:
                    raise SolverError(f"contact edge {self.a:g} h, R = {radius:g} h: {failure}") from failure
                continue
            self.strain = strain
        return self._sphere(radius)

    def _scaled(self, strain: float) -> PressedState:
        """The present state in proportion to a/R, which it follows nearly."""
        now, factor = self.now, strain / self.strain if self.strain else 0.0
        state = State(now.state.displacement * factor, now.state.pressure * factor)
        return PressedState(state, now.multiplier * factor, now.indentation * factor, now.spread)

    def _sphere(self, radius: float) -> SphereSolution:
        layer, base, now = self.layer, self.base, self.now
        stress = base.at_points(layer.internal_force(now.state))
        gained = base.at_points(layer.increment(now, radius))
        force, stiffness = layer.force(now, radius), base.total_force(gained)
        contact_radius = float(layer.surface(now, np.array([self.a]))[0, 0])
        pressure = layer.pressure(now)
        total = 2 * np.pi * force * SHEAR_MODULUS
        linear = self.linear.sphere(total, radius)
        if math.isnan(linear.alpha):
            raise BeyondLinearContactError(f"contact edge {self.a:g} h, R = {radius:g} h: beyond the linear contact")
        # F = 2π force and σ = (2π/3) · mean stress/F, for a mean over the disc; 2π cancels.
        correction = base.smooth(stress / (3 * force) - self.linear.profile(linear.alpha))
        sigma, increment = np.zeros(0), np.zeros(0)
        if self.rho.size:
            sigma = self.linear.sigma(linear.alpha) + disc_averages(correction, self.rho)
            increment = self._increment(gained / (3 * stiffness), contact_radius)
        return SphereSolution(
            material=self.material,
            radius=radius,
            force=total,
            contact_radius=contact_radius,
            indentation=now.indentation,
            stiffness=2 * np.pi * stiffness * SHEAR_MODULUS,
            linear=linear,
            correction=correction(RADII),
            sigma=sigma,
            sigma_increment=increment,
            force_error=base.total_force(stress) / force - 1,
            lowest_pressure=float(pressure.min() / pressure.max()),
        )

    def _increment(self, gained: Floats, a: float) -> Floats:
        """Means over the discs of an increment of the stress, which is near that of a flat punch of radius a."""
        moving = self.base.smooth(gained - _punch(a, 0.0, self.base.points))
        return _punch(a, self.rho, 0.0) + disc_averages(moving, self.rho)


def _punch(a: float, rho: Floats | float, offset: Floats | float) -> Floats:
    """σ under the flat punch's pressure on the linear layer."""
    return normal_stress(transmission, punch_transform, a, rho, offset)
