"""The mechanism `stage_friction`."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.laws.liquid_drag import is_at_one_speed, usual_coefficient
from underskin.mechanisms.models.curve_state import Curve, SampleLaw, numbers, speeds
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording
from underskin.recordings.curve_course import RETURN
from underskin.units import Floats

_REASON = (
    "a hundredth of Hertz's force on 1 MPa at a tenth of the radius, 0.056 N for each mm² of R², within a factor of 12: "
    "guides roll or rub, and samples are softer or harder"
)
_OF_RADIUS_SQUARED, _USUAL_RADIUS_MM = 5.6e-4, 5.0  # N for each mm²
_SD = 2.5
_ENDS, _SMALL = 20, 0.02  # one in so many samples at either end; of the force, the friction of a guess
_AT_ONCE = 2  # samples from motion to motion the other way, without a hold
_MOVES = 0.05  # of the usual speed: below it the stage stands, and its friction stays as it was


class StageFriction(Mechanism):
    """A guide that rubs with a constant force against the motion."""

    name = "stage_friction"
    plain = """A guide between sphere and load cell rubs with a constant force against the motion, so the force is
    higher on the way in than on the way back, by as much at every depth and in the air, however fast it moves; it stays
    through a hold, and changes sides where the motion turns."""
    law = "measured force = contact force + F_f · sign of the last motion of the displacement."
    assumptions = """Coulomb's friction, with one size for all recordings, independent of the load and of the speed, and
    without the travel over which a guide starts to slip after a turn. A drag is proportional to the speed instead: it
    ends in a hold, and differs between two speeds; of a loop at one speed, without a hold, both are the same."""
    source = "Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30 (1994) 1083 (friction of machines)."
    stage = Stage.CURVE
    order = 40
    of = "rig"
    kinds = ("indentation",)
    axes = ("time_s",)
    needs = "time_s, and a way back"
    parameters_stated = (
        Parameter(
            "friction_force",
            "N",
            1e-13,
            1e3,
            Normal(math.log(_OF_RADIUS_SQUARED * _USUAL_RADIUS_MM**2), _SD),
            "log",
            limit=0.0,
            shown=0.02,
            reason=_REASON,
        ),
    )

    def parameters(
        self, conditions: Conditions, kind: Kind = "indentation", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The friction, expected for the spheres of the recordings; at one speed, at which it cannot be told from a drag,
        as probable as that."""
        curves = _indentations(conditions)
        if not curves:
            return self.parameters_stated
        expected = _OF_RADIUS_SQUARED * float(np.median([curve.indenter_radius_mm for curve in curves])) ** 2
        if any(curve.time_s is not None for curve in curves) and is_at_one_speed(curves):
            expected = usual_coefficient(conditions) * _usual_speed(curves)
        usual = Normal(math.log(expected), _SD)
        return tuple(replace(parameter, prior=usual) for parameter in self.parameters_stated)

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """The motion must turn: on one way the friction is a zero of the force."""
        curves = _indentations(conditions)
        lacking = [recording.id for recording in curves if recording.time_s is None]
        if lacking:
            return f"recording {lacking[0]!r} has no time_s"
        if not any(_turns(recording.displacement_mm) for recording in curves):
            return "all curves go one way: a friction and the zero of the force cannot be separated"
        return None

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """Half the difference of the forces of the first and last samples, in the air where there is any, and a small
        share of the whole force."""
        between, of_force = [], []
        for curve in _indentations(conditions):
            if not isinstance(curve, IndentationRecording) or curve.time_s is None:
                continue
            few = max(len(curve.force_n) // _ENDS, 1)
            between.append(0.5 * float(np.median(curve.force_n[:few]) - np.median(curve.force_n[-few:])))
            of_force.append(_SMALL * float(np.ptp(curve.force_n)))
        if not between:
            return ()
        stated = self.parameters_stated[0]
        return [(float(np.clip(np.median(values), stated.low, stated.high)),) for values in (between, of_force)]

    def act(self, state: Curve, values: Values) -> None:
        """Add the friction to the measured force."""
        friction = numbers(values["friction_force"])
        state.laws.append(SampleLaw("force", lambda samples, _: friction * direction(samples.speed)))


def direction(speed: Floats) -> Floats:
    """The mean sign of the last motion over each sample (curves, samples), for speeds of that shape; where the stage
    has not moved yet, of the first.

    A sample may be a mean over several, and the motion turn within it: with u the slopes through three samples, it is
    then 4 u_i/(u_(i−1) − u_(i+1)). After a hold, u of the sample with which the way back begins goes from −1/4 to −3/4
    of the speed as its sign goes from that of the hold to that of the way back.
    """
    return np.stack([_direction_of(curve) for curve in np.atleast_2d(speed)])


def _direction_of(speed: Floats) -> Floats:
    samples = np.arange(len(speed))
    moves = np.abs(speed) > _MOVES * np.median(np.abs(speed))
    last = np.maximum.accumulate(np.where(moves, samples, -1))
    sign = np.sign(speed[np.where(last < 0, moves.argmax(), last)])
    result = sign.copy()
    moving = np.flatnonzero(moves)
    for before, after in zip(moving[:-1].tolist(), moving[1:].tolist(), strict=True):
        if sign[before] == sign[after]:
            continue
        if after - before <= _AT_ONCE:
            for at in range(max(before, 1), min(after + 1, len(speed) - 1)):
                change = speed[at - 1] - speed[at + 1]
                if change * sign[before] > 0:
                    result[at] = np.clip(4 * speed[at] / abs(change), -1.0, 1.0)
            continue
        back = abs(float(speed[min(after + 3, len(speed) - 1)]))
        for at in range(after, min(after + 2, len(speed))):
            result[at] = sign[before] * np.clip(2 - 4 * abs(float(speed[at])) / max(back, 1e-300), -1.0, 1.0)
    return np.asarray(result)


def _usual_speed(curves: Sequence[IndentationConditions]) -> float:
    """The median speed [mm/s] of recordings with times."""
    timed = [(curve.displacement_mm, curve.time_s) for curve in curves if curve.time_s is not None]
    return float(np.median(np.abs(np.concatenate([speeds(travel[None], time[None])[0] for travel, time in timed]))))


def _turns(displacement: Floats) -> bool:
    """Whether a curve moves both ways, by more than a twentieth of its range."""
    least = RETURN * np.ptp(displacement)
    fallen, risen = (
        np.maximum.accumulate(displacement) - displacement,
        displacement - np.minimum.accumulate(displacement),
    )
    return bool(fallen.max() > least and risen.max() > least)


def _indentations(conditions: Conditions) -> list[IndentationConditions]:
    return [recording for recording in conditions.recordings if isinstance(recording, IndentationConditions)]
