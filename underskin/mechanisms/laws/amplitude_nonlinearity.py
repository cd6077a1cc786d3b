"""The mechanism `amplitude_nonlinearity`."""

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.base import Kind, Mechanism, Stage, Values
from underskin.mechanisms.parameter import Parameter, Uniform
from underskin.recordings.conditions import Conditions, frf_of
from underskin.units import Array, Floats

_NODES = 6
_REASON = "from an edge pinned by adhesion to one that moves freely: nothing is known beforehand"


class AmplitudeNonlinearity(Mechanism):
    """A contact that changes markedly within a cycle of the dynamic force."""

    name = "amplitude_nonlinearity"
    plain = """The dynamic force is not small beside the preload, so the contact grows and shrinks markedly within a
    cycle and charge over force depends on how hard the shaker drives."""
    law = """σ → (1 − m) σ + m · (first harmonic of (F + Fd sin ωt) σ(F + Fd sin ωt))/Fd, with the edge moving and every
    other mechanism of contact and stress inside; tends to moving_contact_edge as Fd/F → 0. d33 is that at the preload:
    where it changes with stress (preload_dependent_d33) it multiplies the harmonic and does not vary within the
    cycle."""
    assumptions = """quasi-static over the cycle; the sphere never leaves the skin (Fd < F); m, the edge's mobility, is
    the same for all recordings."""
    source = """Gelb & Vander Velde, Multiple-Input Describing Functions (1968), for the first harmonic of a nonlinear
    answer. It is (2/π) ∫₋₁¹ Q(F + Fd s) s/√(1 − s²) ds, by Gauss–Chebyshev quadrature."""
    stage = Stage.LOAD_INCREMENT
    order = 20
    axes = ("dynamic_force_n", "preload_n", "indenter_radius_mm")
    needs = "dynamic_force_n below preload_n in every recording"
    needs_fields = ("dynamic_force_n",)
    parameters_stated = (
        Parameter(
            "edge_mobility", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=1.0, reason=_REASON, closed=(1.0,)
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """The contact must not open."""
        for entry in frf_of(conditions):
            if entry.dynamic_force_n >= entry.preload_n:
                return f"recording {entry.id!r}: dynamic_force_n reaches preload_n, the contact would open"
        return None

    def force_nodes(self, force: Floats, dynamic_force: Floats) -> tuple[Array, Array]:
        """The first harmonic's quadrature; a weight is of σ, so it holds the force at its node."""
        s = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)[:, None]
        forces = force + dynamic_force * s
        return forces, 2 / _NODES * s * forces / dynamic_force

    def mobility(self, values: Values) -> Differentiated:
        """The edge's mobility."""
        return values["edge_mobility"]
