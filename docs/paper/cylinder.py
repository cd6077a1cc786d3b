"""A compressed cylinder whose ends stick to the platens looks stiffer than its elastomer is.

By symmetry the upper half of the section is solved: 0 ≤ r ≤ 1 (the radius), 0 ≤ z ≤ half the height. With shear
modulus 1 (Young's modulus 3), find u and p with u_z = 0 in the middle and u = (0, −1) at the platen so that for all
admissible v and q

    ∫ [2 ε(u):ε(v) − p div v − q div u] r dr dz = 0,        ε_θθ = u_r/r, div v = ∂_r v_r + v_r/r + ∂_z v_z,

in Taylor–Hood elements Q_2/Q_1, graded to the edge of the platen, where the stress is singular. The force is twice the
energy over the platen's travel.
"""

from typing import Any

import numpy as np
from skfem import Basis, BilinearForm, ElementQuad1, ElementQuad2, ElementVector, MeshQuad, bmat, condense, solve

from underskin.units import Floats

_ELEMENTS = 24  # along the radius and along the half height
_GRADING = 3.0  # of the nodes towards the edge of the platen
_YOUNGS_MODULUS = 3.0


def _elasticity(u: Any, v: Any, w: Any) -> Any:
    r, (of_u, of_v) = w.x[0], (u.grad, v.grad)
    shear = of_u[0, 1] + of_u[1, 0]
    strain = 2 * (of_u[0, 0] * of_v[0, 0] + of_u[1, 1] * of_v[1, 1]) + shear * (of_v[0, 1] + of_v[1, 0])
    return (strain + 2 * u[0] * v[0] / r**2) * r


def _volume(u: Any, q: Any, w: Any) -> Any:
    return q * (w.x[0] * (u.grad[0, 0] + u.grad[1, 1]) + u[0])


def stiffness_ratio(height: float, diameter: float, elements: int = _ELEMENTS) -> float:
    """The slope of nominal stress over nominal strain of a stuck incompressible cylinder, over Young's modulus [-].

    1 for a slender one; 1 + 2 S² with S = diameter/(4 height) is Gent and Lindley's approximation for flat ones.
    """
    half_height = height / diameter
    mesh = MeshQuad.init_tensor(_graded(elements), half_height * _graded(elements))
    displacements = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
    pressures = Basis(mesh, ElementQuad1(), intorder=5)
    stiffness = BilinearForm(_elasticity).assemble(displacements)
    volume = BilinearForm(_volume).assemble(displacements, pressures)
    system = bmat([[stiffness, -volume.T], [-volume, None]], "csr")
    platen = displacements.get_dofs(lambda x: np.isclose(x[1], half_height))
    held = np.concatenate([
        platen.all(),
        displacements.get_dofs(lambda x: np.isclose(x[1], 0.0)).all(["u^2"]),
        displacements.get_dofs(lambda x: np.isclose(x[0], 0.0)).all(["u^1"]),
    ])  # fmt: skip
    values = np.zeros(displacements.N + pressures.N)
    values[platen.all(["u^2"])] = -1.0
    solution = solve(*condense(system, np.zeros_like(values), x=values, D=np.unique(held)))
    u = solution[: displacements.N]
    force = 2 * np.pi * float(u @ stiffness @ u)
    return force / np.pi * half_height / _YOUNGS_MODULUS


def gent_lindley(height: float, diameter: float) -> float:
    """1 + 2 S², S = diameter/(4 height) (Gent & Lindley, Proc. Inst. Mech. Eng. 173 (1959) 111)."""
    return 1 + 2 * (diameter / (4 * height)) ** 2


def _graded(elements: int) -> Floats:
    return np.asarray(1 - np.linspace(1, 0, elements + 1) ** _GRADING)
