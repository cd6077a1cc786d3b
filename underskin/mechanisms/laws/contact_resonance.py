"""The mechanism `contact_resonance`."""

from collections.abc import Sequence

import numpy as np

from underskin.autodiff import constant
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts, FrfState, frf_design, press, stiffness
from underskin.physics.elastic_layer import Layer, curves_of
from underskin.recordings.campaign import Conditions, FrfRecording
from underskin.recordings.frf.estimation import lines_of, resonance
from underskin.units import to_si
from underskin.weak_cache import cached_while_alive

_MASS = "what sits in front of a force cell, from a bead to a shaker's table: 2 g within a factor of 6"
_DAMPING = "silicones lose little, tan δ 0.02 to 0.3, ζ half of it: 0.05 within a factor of 2.7"

_BROADER, _BROAD = 3.0, 0.03  # times the damping that is seen, and at least that damping


class ContactResonance(Mechanism):
    """The tip's mass on the stiffness of the contact, a resonance."""

    name = "contact_resonance"
    plain = """The tip between force cell and skin bounces on the contact as a mass on a spring, so the response swells
    towards a resonance and falls beyond it, at a frequency that moves with preload and sphere."""
    law = """FRF/(1 − (ω/ω0)² + 2iζω/ω0), ω0² = k/m, k = dF/dδ = 2E'a S(a/h) of the layer at the contact radius in
    force: the resonance moves with preload and indenter as the contact does; where the contact creeps it rises, for the
    contact grows."""
    assumptions = """one mass, one damping ratio; damping acts on the tip and is not sensed (a dashpot inside the
    contact would add a numerator 1 + 2iζω/ω0); the edge is held over a cycle, which is short beside the times of creep,
    so that E' is the unrelaxed one; the layer itself has no inertia."""
    source = """Rabe, Janser & Arnold, Rev. Sci. Instrum. 67 (1996) 3281 (contact resonances); Lebedev & Ufliand, J.
    Appl. Math. Mech. 22 (1958) 442, for the layer's S."""
    stage = Stage.LINES
    order = 10
    of = "rig"
    axes = ("frequency_hz", "phase", "preload_n", "indenter_radius_mm")
    reads = ("stiffness",)
    parameters_stated = (
        Parameter("tip_mass", "g", 0.01, 2000.0, HeavyTailed(0.7, 1.8), "log", limit=0.0, shown=2.0, reason=_MASS),
        Parameter("damping_ratio", "-", 1e-3, 1.0, Normal(-3.0, 1.0), "log", limit=None, shown=0.05, reason=_DAMPING),
    )

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """The tip mass and damping of the resonances that recordings show on the base model's contacts; and a
        broader one, from which a fit finds a sharp resonance at other contacts' frequencies."""
        return _resonance_guesses(conditions)

    def act(self, state: FrfState, values: Values) -> None:
        """The tip's transfer function."""
        stiffness_at, design = state.contacts.stiffness, state.design
        assert stiffness_at is not None
        natural = (stiffness_at * (1e3 / values["tip_mass"])) ** 0.5
        ratio = 2 * np.pi * design.line_frequency / natural[design.line_contact]
        state.factor = 1.0 / (1.0 - ratio * ratio + 2j * values["damping_ratio"] * ratio)


@cached_while_alive  # a diagnosis composes dozens of models of one campaign
def _resonance_guesses(conditions: Conditions) -> list[tuple[float, float]]:
    """Tip mass [g] and damping ratio."""
    skin = conditions.skin
    measured = conditions.of(FrfRecording)
    resonances = [
        (index, peak)
        for index, recording in enumerate(measured)
        if (peak := resonance(lines_of(recording))) is not None
    ]
    if not resonances or skin.youngs_modulus_mpa is None or skin.thickness_mm is None:
        return []
    design = frf_design(conditions, (), neighbours=False)
    modulus, thickness = to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa), to_si("thickness_mm", skin.thickness_mm)
    contacts = Contacts(
        design.force,
        design.indenter_radius,
        design.dwell,
        modulus=constant(modulus, 0, (1,)),
        thickness=constant(thickness, 0, (1,)),
        poisson_ratio=constant(skin.poisson_ratio, 0, (1,)),
    )
    curves = curves_of(Layer(skin.poisson_ratio))
    spring = stiffness(contacts, press(contacts, None), curves).value[0]
    contact_of = design.point_contact[design.point]
    masses = [1e3 * spring[contact_of[index]] / (2 * np.pi * peak.frequency) ** 2 for index, peak in resonances]
    mass, damping = float(np.median(masses)), float(np.median([peak.damping for _, peak in resonances]))
    return [(mass, damping), (mass, max(_BROADER * damping, _BROAD))]
