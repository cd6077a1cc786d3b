"""The mechanism `liquid_drag`."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.laws.contact_creep import time_runs_with_displacement
from underskin.mechanisms.models.curve_state import Curve, SampleLaw, numbers, speeds
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording

_REASON = (
    "Stokes' 6πηR of the sphere in water and of a cantilever twenty times as wide: 4e-6 N·s/m under a tip of 10 µm; "
    "within a factor of 12, as liquids are up to a thousand times as viscous"
)
_OF_RADIUS, _USUAL_RADIUS_MM = 4e-7, 0.01  # N·s/mm for each mm
_SD = 2.5
_ENDS, _SMALL = 20, 0.02  # one in so many samples at either end; of the force, the drag of a guess
_AS_FAST = 0.5  # of the usual speed: slower, or as much faster, is another speed


class LiquidDrag(Mechanism):
    """A liquid that drags on the moving sphere and what holds it."""

    name = "liquid_drag"
    plain = """The liquid around the moving sphere, or the cantilever that holds it, resists the motion, so the force
    is higher on the way in than on the way back, in contact and away from it, and steps where the motion turns."""
    law = "measured force = contact force + c dz/dt, with z the displacement; in the air, or the liquid, as in contact."
    assumptions = """proportional to the speed, with one coefficient for all recordings: a laminar flow, without the
    growth of the drag within a diameter of the surface and without inertia. The speed is that of the displacement as
    recorded, the slope through neighbouring samples."""
    source = """Alcaraz, Buscemi, Puig-de-Morales, Colchero, Baró & Navajas, Langmuir 18 (2002) 716 (drag on
    cantilevers in water)."""
    stage = Stage.CURVE
    order = 30
    of = "rig"
    kinds = ("indentation",)
    axes = ("time_s",)
    needs = "time_s, and two speeds, a hold or a way back"
    parameters_stated = (
        Parameter(
            "drag_coefficient",
            "N·s/mm",
            1e-13,
            1e2,
            Normal(math.log(_OF_RADIUS * _USUAL_RADIUS_MM), _SD),
            "log",
            limit=0.0,
            shown=0.05,
            reason=_REASON,
        ),
    )

    def parameters(
        self, conditions: Conditions, kind: Kind = "indentation", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The coefficient, expected for the spheres of the recordings."""
        radii = [curve.indenter_radius_mm for curve in _indentations(conditions)]
        if not radii:
            return self.parameters_stated
        usual = Normal(math.log(_OF_RADIUS * float(np.median(radii))), _SD)
        return tuple(replace(parameter, prior=usual) for parameter in self.parameters_stated)

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Speeds must differ: at one speed the drag is a zero of the force."""
        curves = _indentations(conditions)
        lacking = [recording.id for recording in curves if recording.time_s is None]
        if lacking:
            return f"recording {lacking[0]!r} has no time_s"
        if time_runs_with_displacement(curves):
            return "all curves go one way at one speed: a drag and the zero of the force cannot be separated"
        return None

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """From the forces and speeds of the first and last samples, in the air where there is any, and a small share of
        the whole force."""
        between, of_force = [], []
        for curve in _indentations(conditions):
            if not isinstance(curve, IndentationRecording) or curve.time_s is None:
                continue
            few = max(len(curve.force_n) // _ENDS, 1)
            speed = speeds(curve.displacement_mm[None], curve.time_s[None])[0]
            ends = [
                float(np.median(column[:few]) - np.median(column[-few:]))
                for column in (np.asarray(curve.force_n), speed)
            ]
            between.append(ends[0] / ends[1] if ends[1] else 0.0)
            of_force.append(_SMALL * float(np.ptp(curve.force_n)) / max(float(np.ptp(speed)), 1e-300))
        if not between:
            return ()
        stated = self.parameters_stated[0]
        return [(float(np.clip(np.median(values), stated.low, stated.high)),) for values in (between, of_force)]

    def act(self, state: Curve, values: Values) -> None:
        """Add the drag to the measured force."""
        coefficient = 1e3 * numbers(values["drag_coefficient"])  # N·s/m
        state.laws.append(SampleLaw("force", lambda samples, _: coefficient * samples.speed))


def meaning(values: Mapping[str, float], conditions: Conditions) -> str:
    """What else reads like the drag where the sphere moves at one speed: a friction of the guide, which is constant."""
    curves = _indentations(conditions)
    timed = [(curve.displacement_mm, curve.time_s) for curve in curves if curve.time_s is not None]
    speed = np.abs(np.concatenate([speeds(travel[None], time[None])[0] for travel, time in timed]))
    usual = float(np.median(speed))
    other = np.mean((speed < _AS_FAST * usual) | (_AS_FAST * speed > usual))
    if other > 1 / _ENDS:
        return ""
    times = values["drag_coefficient"] / (_OF_RADIUS * float(np.median([curve.indenter_radius_mm for curve in curves])))
    return (
        "At one speed a friction of the guide, constant against the motion, reads the same, and this is "
        f"{times:.1g} times the drag of water on the sphere: press at a second speed to tell them apart."
    )


def _indentations(conditions: Conditions) -> list[IndentationConditions]:
    return conditions.of(IndentationConditions)
