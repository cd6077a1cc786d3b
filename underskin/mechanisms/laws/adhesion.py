"""The mechanism `adhesion`."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording
from underskin.recordings.curve_course import curve_landmarks
from underskin.units import to_si

_REASON = "0.04 J/m² is thermodynamic for silicone; rate effects and soft gels raise it to some J/m²"
_OF_FRF = Parameter(
    "work_of_adhesion", "J/m²", 1e-3, 20.0, HeavyTailed(-1.6, 1.3), "log", limit=0.0, shown=0.5, reason=_REASON
)
_WORK = replace(
    _OF_FRF, low=1e-6, high=30.0, prior=Normal(-3.0, 3.0)
)  # of curves: from gels in a liquid, 1e-5, to tacky ones
_SEPARATION = Parameter(
    name="work_of_separation",
    unit="J/m²",
    low=1.0,
    high=30.0,
    prior=Normal(0.0, 1.0),
    scale="log",
    limit=None,
    shown=2.0,
    relative_to="work_of_adhesion",
    closed=(1.0,),
    reason="a rolling or receding edge costs more than an advancing one: twice on silicones, tens of times on gels",
)
_RETURN = 0.05  # of the range of displacement, that a way back covers


class Adhesion(Mechanism):
    """Johnson-Kendall-Roberts adhesion between skin and sphere."""

    name = "adhesion"
    plain = """The skin sticks to the sphere, so the contact is wider than the force alone would make it, most of all at
    low force, under large spheres and on soft skins."""
    law = """Johnson, Kendall and Roberts: on the half space a³ = (3R/4E') [F + 3πwR + √(6πwRF + (3πwR)²)], pressure =
    Hertz' less a flat punch's; on the layer φ(a) = −√(2awE'/π) in the integral equation of layered_contact. Drawn back,
    the edge rests at the a that it reached while the energy release rate G < w_s, the work of separation, and recedes
    at G = w_s."""
    assumptions = """short-ranged adhesion (soft, large contacts: Tabor's number far above 1), equilibrium on the
    loading branch under a given force. FRF = Q(F)/F with the static pressure. An indentation sticks from the first
    touch on. When it is drawn back the edge rests while its energy release rate rises from the work of adhesion to that
    of separation, then recedes. It comes off where the travel δ + F/k has its least value: at JKR's depth under a stiff
    stage, at the force −3πwR/2 under a soft one; from there on it must touch again."""
    source = "Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301."
    stage = Stage.CONTACT
    order = 20
    kinds = ("frf", "indentation")
    axes = ("preload_n", "indenter_radius_mm", "position_mm", "force_n")
    parameters_stated = (_OF_FRF,)

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The work of adhesion, and of separation where an indentation has a way back."""
        if kind == "frf":
            return self.parameters_stated
        returns = any(map(_comes_back, conditions.of(IndentationConditions)))
        return (_WORK, _SEPARATION) if returns else (_WORK,)

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """From the least forces on both ways: -4πwR/3 at snap-in, -5πwR/6 to -3πwR/2 at pull-off."""
        measured = conditions.of(IndentationRecording)
        if not measured:
            return ()
        works = np.array([_works(recording) for recording in measured])
        snap_in, pull_off = np.clip(np.median(works, axis=0), _WORK.low, _WORK.high)
        if len(self.parameters(conditions, kind)) == 1:
            return [(snap_in,)]
        pull_off = max(pull_off, snap_in)
        return [
            (work, max(share * pull_off, work)) for work in (snap_in, 0.5 * pull_off, pull_off) for share in (1.0, 1.8)
        ]

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Make it stick."""
        state.work_of_adhesion = values["work_of_adhesion"]
        if isinstance(state, Curve):
            state.work_of_separation = values.get("work_of_separation")


def _comes_back(recording: IndentationConditions) -> bool:
    travel = recording.displacement_mm
    return bool(travel.max() - travel[int(np.argmax(travel)) :].min() > _RETURN * np.ptp(travel))


def _works(recording: IndentationRecording) -> tuple[float, float]:
    """Works of adhesion and separation [J/m²] for which the least forces on both ways are -4πwR/3 and -3πwR/2."""
    features = curve_landmarks(recording.displacement_mm, recording.force_n, recording.time_s)
    force = recording.force_n - features.zero
    radius = float(to_si("indenter_radius_mm", recording.indenter_radius_mm))
    least = [-float(part.min()) / (np.pi * radius) for part in (force[: features.turn + 1], force[features.turn :])]
    return max(least[0], 0.0) / (4 / 3), max(least[1], 0.0) / 1.5
