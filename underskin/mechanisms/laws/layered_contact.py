"""The mechanism `layered_contact`."""

import math
from collections.abc import Collection

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording
from underskin.recordings.curve_course import pressed_depth

_THICKNESS = "layer_thickness"
_USUAL, _SD = 5.0, 1.5  # contact radii, and of the logarithm
_LEAST, _MOST = 0.3, 300.0  # contact radii: beyond the solved layers, and where the base has no effect
_REASON = "nobody declared it: 5 contact radii within a factor of 4.5, at 30 the base raises the force by 4 %"


class LayeredContact(Mechanism):
    """Contact with a layer of finite thickness in place of a half space."""

    name = "layered_contact"
    plain = """The hard base under the thin skin holds against the sphere, so the skin feels stiffer and the contact
    stays smaller than on a deep block of the same material, the more so the wider it is."""
    law = """contact radius and pressure from the integral equation of a rigid sphere on the layer, (π/2) φ(x) − ∫₀^a
    φ(t) N(x,t) dt = (E'/2)(δ − x²/R), N = ∫₀^∞ (1 − K(ξh)) cos ξx cos ξt dξ, F = 2π ∫₀^a φ dt, φ(a) = 0; K is the
    surface deflection of the layer over the half space's, with its own ν and glue line; with adhesion where that
    mechanism is present too."""
    assumptions = """linear, frictionless contact; to the stress under it the correction of the sphere's own
    finite-strain contact with a neo-Hookean layer of its ν is added (tables/contact.h5, within 0.5 % of σ up to L
    0.222, of a half space a/R 0.5); under a glue line that yields or adhesion that correction stays the bonded layer's
    without adhesion. A declared thickness makes it no guess: it stands beside the half space with equal odds. Under
    indentations on a skin without a declared one, the layer's thickness is a parameter."""
    source = "Lebedev & Ufliand, J. Appl. Math. Mech. 22 (1958) 442; Dimitriadis et al., Biophys. J. 82 (2002) 2798."
    stage = Stage.CONTACT
    order = 10
    kinds = ("frf", "indentation")
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    needs = "frf: a declared thickness_mm; indentations: nothing, but only a declared one tells it from stiffening"

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """None; of indentations on a skin without a declared thickness, this."""
        if kind != "indentation" or conditions.skin.thickness_mm is not None:
            return ()
        contact = _contact_radius_mm(conditions)
        usual = Normal(math.log(_USUAL * contact), _SD)
        return (
            Parameter(
                _THICKNESS, "mm", _LEAST * contact, _MOST * contact, usual, "log", limit=math.inf, reason=_REASON
            ),
        )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """A thickness is needed, or curves that tell it."""
        lacking = kind == "frf" and conditions.skin.thickness_mm is None
        return "skin.thickness_mm is not given" if lacking else None

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Press the layer."""
        state.layered = True
        if _THICKNESS in values:
            state.thickness = 1e-3 * values[_THICKNESS]


def _contact_radius_mm(conditions: Conditions) -> float:
    """About the largest of the recordings, √(R δ)."""
    radii = [
        math.sqrt(recording.indenter_radius_mm * max(_depth_mm(recording), 1e-12))
        for recording in conditions.of(IndentationConditions)
    ]
    return max(radii, default=1.0)


def _depth_mm(recording: IndentationConditions) -> float:
    """The depth δ after the contact begins; of conditions alone, which begin with it, the travel."""
    travel = recording.displacement_mm
    if not isinstance(recording, IndentationRecording):
        return float(np.ptp(travel))
    return pressed_depth(travel, recording.force_n, recording.time_s)
