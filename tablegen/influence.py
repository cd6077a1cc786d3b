"""Influence functions by reciprocity: the layer with a unit lift over the sensor's disc on its base (Betti).

By Betti's theorem the mean stress on a sensor under a point force on the surface is minus that force's work on the
displacement u of the surface when the base is lifted by 1 over the sensor's disc and by 0 beside it:
    γ_n = 2 u_z/(3ρ²),  γ_t = 2 u_r/(3ρ²)                                                    (lengths in thicknesses)
The lift jumps at the disc's rim, which no finite element can follow; it need not. For a load f on the surface and the
stress t_h on the base that the finite elements give for it, recovered from consistent reactions, f(u_h) = ∫ t_h g_h
holds exactly if u_h is lifted by g_h. With g_h the projection of the lift on the traces of the elements (weight r),
∫ t_h g_h is the integral of t_h over the disc. So no accuracy is lost at the rim, wherever it lies in the mesh, and
one factorisation serves all sensor radii, the point sensor (the lift over πρ², ρ → 0) included.

The glue line yields in shear, τ = κ (G/h) u_r on the base; `slip` = 1/(1 + κ) is 0 for a bonded, 1 for a frictionless
base. Elements as in `tablegen.discretisation`; the pressure −λ div u is eliminated in each of them, exactly for ν < 0.5
and for ν = 0.5 by the augmented Lagrangian of `tablegen.newton`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skfem import MeshQuad
from threadpoolctl import threadpool_limits

from tablegen.discretisation import Discretisation, Indices, discretise
from tablegen.faces import gauss_rule, shapes_along
from tablegen.newton import factorise
from underskin.units import Floats

RIM = 80.0  # thicknesses; a glue line that hardly holds spreads shear over 2/√κ
_FINE = 0.125  # thicknesses, the elements that sensors and loads lie on
_FINE_END = 13.0
_GROWTH = 1.5
_AUGMENTATION = 1e4  # of the shear modulus
_SOLVES_PER_FACTORISATION = 3
_SHEAR = np.diag([2.0, 1.0, 1.0, 2.0, 2.0]) + np.eye(5)[[0, 2, 1, 3, 4]] * np.array([0, 1, 1, 0, 0])  # 2 ε : ε


@dataclass(frozen=True)
class SolvedInfluence:
    """γ_n and γ_t for each sensor radius and distance, (rho, r)."""

    normal: Floats
    tangential: Floats


@dataclass(frozen=True)
class _Glued(Discretisation):
    """A discretisation whose base is held in z, and in r only if `bonded`."""

    bonded: bool

    @cached_property
    def free(self) -> Indices:
        base, axis = self.base, self.scalars_on(lambda x: x[0] == 0.0)
        held = [2 * base + 1, 2 * axis] + ([2 * base] if self.bonded else [])
        return np.setdiff1d(np.arange(self.size), np.concatenate(held))

    @cached_property
    def base(self) -> Indices:
        """Scalar numbers on the base."""
        return self.scalars_on(lambda x: x[1] == 0.0)


def solve_influence(poisson_ratio: float, slip: float, rho: Floats, r: Floats, order: int) -> SolvedInfluence:
    """Influence functions γ_n and γ_t of a point force on the surface, by finite elements.

    Parameters
    ----------
    poisson_ratio : float
        ν, 0 to 0.5.
    slip : float
        1/(1 + κ), 0 (bonded) to 1 (frictionless).
    rho : ndarray, (rho,)
        Sensor radii rT/h.
    r : ndarray, (r,)
        Distances r̂/h.
    order : int
        Order of the displacement elements.
    """
    with threadpool_limits(1):  # the same bits whatever the number of cores
        mesh = influence_mesh()
        d = _Glued(**vars(discretise(mesh, order)), bonded=slip == 0)
        surface = _displaced_by(d, poisson_ratio, slip, _lifts(d, rho))
    values, numbers = shapes_along(d, r, 1)
    radial, axial = (np.einsum("pn,pnl->lp", values, surface[2 * numbers + c]) for c in (0, 1))
    return SolvedInfluence(axial / 3, radial / 3)


def influence_mesh() -> MeshQuad:
    """Squares where sensors and loads lie, growing geometrically from there to the rim."""
    columns = np.linspace(0, _FINE_END, round(_FINE_END / _FINE) + 1).tolist()
    step = _FINE
    while columns[-1] < RIM:
        step *= _GROWTH
        columns.append(columns[-1] + step)
    return MeshQuad.init_tensor(np.array(columns), np.linspace(0, 1, round(1 / _FINE) + 1))


def _lifts(d: _Glued, rho: Floats) -> Floats:
    """Base displacements (displacements, rho): the lift by 2/ρ² over each disc, projected on the traces."""
    columns = np.unique(d.basis.mesh.p[0])
    points, weight = gauss_rule(columns, d.order + 1)
    shapes = _base_shapes(d, points)
    mass = shapes.T @ (weight[:, None] * shapes)
    moments = np.zeros((d.base.size, rho.size))
    for number, radius in enumerate(rho):
        if radius == 0:
            moments[:, number] = _base_shapes(d, np.zeros(1))[0]
        else:
            points, weight = gauss_rule(np.append(columns[columns < radius], radius), d.order + 1)
            moments[:, number] = weight @ _base_shapes(d, points) * 2 / radius**2
    lifted = np.zeros((d.size, rho.size))
    lifted[2 * d.base + 1] = np.linalg.solve(mass, moments)
    return lifted


def _displaced_by(d: _Glued, poisson_ratio: float, slip: float, lifted: Floats) -> Floats:
    """All displacements (displacements, lifts) in equilibrium with the displacements given on the base."""
    elements, points = d.weight.shape
    flat = d.gradient.reshape(elements, points * 5, -1)
    shear = np.swapaxes(flat, 1, 2) @ ((d.weight[..., None, None] * _SHEAR) @ d.gradient).reshape(flat.shape)
    divergence = d.gradient[:, :, 0] + d.gradient[:, :, 3] + d.gradient[:, :, 4]
    constraint = np.einsum("eq,qm,eqn->emn", d.weight, d.pressure, divergence)
    inverse_mass = np.linalg.inv(np.einsum("ql,eq,qm->elm", d.pressure, d.weight, d.pressure))
    incompressible = poisson_ratio == 0.5
    bulk = _AUGMENTATION if incompressible else 2 * poisson_ratio / (1 - 2 * poisson_ratio)  # λ/G
    scaled = bulk * inverse_mass @ constraint
    stiffness = shear + np.swapaxes(constraint, 1, 2) @ scaled
    if 0 < slip < 1:
        stiffness = stiffness + (1 / slip - 1) * _base_springs(d)
    factors = factorise(d.assemble_matrix(stiffness))

    def assembled(forces: Floats) -> Floats:
        columns = [d.assemble_vector(np.ascontiguousarray(forces[..., i])) for i in range(forces.shape[-1])]
        return np.stack(columns, axis=-1)

    u = lifted.copy()
    u[d.free] = factors.solve(-assembled(stiffness @ lifted[d.numbers])[d.free])
    if incompressible:  # the remaining volume defect is corrected by each further solve
        defect = constraint @ u[d.numbers]
        for _ in range(_SOLVES_PER_FACTORISATION - 1):
            step = np.zeros_like(u)
            step[d.free] = factors.solve(-assembled(np.swapaxes(scaled, 1, 2) @ defect)[d.free])
            u += step
            defect = defect + constraint @ step[d.numbers]
    return u


def _base_springs(d: _Glued) -> Floats:
    """∫ u_r v_r r dr over the base as element matrices."""
    points, weight = gauss_rule(np.unique(d.basis.mesh.p[0]), d.order + 1)
    values, numbers = shapes_along(d, points, 0)
    corner = d.basis.mesh.p[:, d.basis.mesh.t].min(axis=1)
    on_base = np.flatnonzero(corner[1] == 0.0)
    on_base = on_base[np.argsort(corner[0, on_base])]
    assert (numbers[:: d.order + 1] == d.numbers[on_base, ::2] // 2).all()
    values = values.reshape(on_base.size, d.order + 1, -1)
    weighted = weight.reshape(on_base.size, -1, 1) * values
    springs = np.zeros((len(d.numbers), d.numbers.shape[1], d.numbers.shape[1]))
    springs[on_base, ::2, ::2] = np.swapaxes(values, 1, 2) @ weighted
    return springs


def _base_shapes(d: _Glued, r: Floats) -> Floats:
    """Shape functions of the base at radii r, (r, base)."""
    values, numbers = shapes_along(d, r, 0)
    every = np.zeros((r.size, int(d.basis.N)))
    np.put_along_axis(every, numbers, values, axis=1)
    return every[:, d.base]
