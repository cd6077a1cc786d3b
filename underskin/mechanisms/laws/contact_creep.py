"""The mechanism `contact_creep`."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from underskin.autodiff import exp
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import Conditions, CurveConditions, FrfConditions, IndentationConditions, curves_of
from underskin.units import Floats

# Curves that add no information by their times: share of the span, of the duration; ratio of speeds
_TURNED_BACK = 0.02  # of the span
_UNEVEN = 0.1  # of the duration
_LIKE_SPEEDS = 1.5
_FRACTION = "from a few percent in a well cured silicone to most of the modulus in a gel"
_CURVE_TIME = "no shorter than the time between two samples; an instrument sees up to hours"
_SHORTEST = 1e-3  # s, where the recordings have no times
_EXPONENT = "0.10 to 0.18 of gels, acrylic tapes and natural rubber over decades of time; 0 of a well cured silicone"
_TIME = "what a bench can see lies between seconds and an hour; 40 s within a factor of 4.5"
_PLAIN_EXPONENT = 5e-3  # below which a power law falls by a percent in a decade
_LARGEST_EXPONENT = 0.5  # beyond it a body flows more than it resists

_FRF = (
    Parameter("relaxed_fraction", "-", 0.0, 0.9, Uniform(), "linear", limit=0.0, shown=0.4, reason=_FRACTION),
    Parameter("relaxation_time", "s", 0.05, 5e4, Normal(3.7, 1.5), "log", limit=None, shown=40.0, reason=_TIME),
)
_POWER = Parameter(
    "relaxation_exponent",
    "-",
    0.0,
    _LARGEST_EXPONENT,
    HeavyTailed(0.0, 0.1),
    "linear",
    limit=0.0,
    shown=0.1,
    starts=(0.0, 0.15),
    reason=_EXPONENT,
)
_COMPRESSION = (*_FRF, _POWER)
_INDENTATION = (
    replace(_FRF[0], high=0.95, starts=(0.0, 0.1, 0.35)),
    Parameter(
        "relaxation_time", "s", _SHORTEST, 5e4, Normal(2.0, 2.5), "log", limit=None, shown=40.0, reason=_CURVE_TIME
    ),
    _POWER,
)
# Of the longest recording, where fits of its time begin: one much shorter than the loading shows at its foot alone
_STARTS = (0.005, 0.02, 0.1, 0.4)


class ContactCreep(Mechanism):
    """Viscoelastic relaxation of the skin: a Prony pair; of curves also a power law, or both."""

    name = "contact_creep"
    plain = """The skin slowly gives way under the preload, so the contact grows and the response changes with the time
    for which the preload has been held."""
    law = """Curves: E(t) = E (1 − g (1 − e^(−t/τ))) (t/1 s)^(−n): at n = 0 a solid with one time, of modulus E at once
    and E (1 − g) in the end; at g = 0 a power law, of modulus E after 1 s. FRFs: n = 0, and the preload held for t
    creeps with that solid's compliance J(t) = (1 + g/(1 − g) (1 − e^(−(1 − g) t/τ)))/E; a³ ∝ J(t), L ∝ J(t)."""
    assumptions = """linear viscoelasticity; the declared E is the instantaneous one, and with a power law that at 1 s.
    FRFs: an elastic layer of modulus 1/J(t) at each instant, exact for a sphere on a half space whose force rises at
    once and then stays. A held oscillation is felt through the contact radius alone, since transmission through a
    linear layer under force control has no modulus in it, and a contact's stiffness against an oscillation much faster
    than τ is the instantaneous modulus' at that radius. Curves: an indentation F(t) = ∫₀^{t1} e(t−s) du(s), with u the
    elastic force, e = E(t)/E, and t1 = t while the contact grows; while it shrinks t1 is when it last was as large,
    ∫_{t1}^{t} e(t−s) dδ(s) = 0 (Ting's theory, exact for one growing and one shrinking of the contact, with holds
    between). With adhesion the edge lets go where it carries the stretch ℓ of JKR's contact at the instantaneous
    modulus, of a power law that within a fifth of the shortest time between two samples. Where the modulus stiffens
    too, all of the force is multiplied by its ratio at the contact radius of the moment. A stage gives by the relaxed
    force. A sphere that presses again after it was drawn back meets a surface that has not recovered: each ring of the
    contact is a spring of the relaxing body, left without force while the sphere is off it (exact for a half space),
    and adhesion then adds what it adds on the elastic body. A cylinder: F(t) = ∫₀^t e(t−s) du(s)."""
    source = """Lee & Radok, J. Appl. Mech. 27 (1960) 438; Ting, J. Appl. Mech. 33 (1966) 845; Greenwood & Johnson,
    Phil. Mag. A 43 (1981) 697 (the modulus that a moving edge sees); Bonfanti, Kaplan, Charras & Kabla, Soft Matter 16
    (2020) 6002 (power laws)."""
    stage = Stage.MATERIAL
    order = 30
    kinds = ("frf", "indentation", "compression")
    axes = ("dwell_s", "preload_n", "indenter_radius_mm", "time_s")
    needs = "frf: dwell_s of every recording, not all the same; curves: time_s, and two speeds, a hold or a way back"
    reads = ("dwell_s",)
    parameters_stated = _FRF

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """One Prony pair; of curves also the exponent of a power law."""
        stated = {"frf": _FRF, "indentation": _INDENTATION, "compression": _COMPRESSION}[kind]
        if kind != "indentation":
            return stated
        fraction, time, exponent = stated
        intervals = [np.median(np.diff(times)) for times in _times(conditions)]
        time = replace(time, low=max(float(min(intervals, default=0.0)), _SHORTEST))
        longest = max((float(np.ptp(times)) for times in _times(conditions)), default=0.0)
        starts = {float(np.clip(share * longest, time.low, time.high)) for share in _STARTS}
        return fraction, replace(time, starts=tuple(sorted(starts))), exponent

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Times must be independent of the loads: dwell_s that differ, or time_s that does not follow displacement."""
        if kind != "frf":
            curves = [curve for curve in curves_of(conditions) if curve.kind == kind]
            lacking = [recording.id for recording in curves if recording.time_s is None]
            if lacking:
                return f"recording {lacking[0]!r} has no time_s"
            if time_runs_with_displacement(curves):
                return "all curves go one way at one speed: time and displacement cannot be separated"
            return None
        dwell = {recording.id: recording.dwell_s for recording in conditions.of(FrfConditions)}
        lacking = [name for name, value in dwell.items() if value is None]
        if lacking:
            return f"recording {lacking[0]!r} has no dwell_s"
        return "dwell_s is the same in all recordings" if len(set(dwell.values())) == 1 else None

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Creep under the preload; relax the force of a curve."""
        fraction, time = values["relaxed_fraction"], values["relaxation_time"]
        if isinstance(state, Contacts):
            unrelaxed = 1.0 - fraction
            state.relaxed = 1.0 / (1.0 + fraction / unrelaxed * (1.0 - exp(-state.dwell * unrelaxed / time)))
            state.modulus = state.modulus * state.relaxed
        else:
            state.relaxation, state.power_exponent = ((fraction, time),), values.get("relaxation_exponent")


def meaning(values: Mapping[str, float], _: Conditions) -> str:
    """Of a power law, how much the force falls from 1 s to 10 s, and to which time E belongs."""
    exponent = values.get("relaxation_exponent", 0.0)
    if exponent < _PLAIN_EXPONENT:
        return ""
    falls = 100 * (1 - 10**-exponent)
    return f"From each time to one ten times as long the force falls by {falls:.2g} % as a power law; E is that at 1 s."


def _times(conditions: Conditions) -> list[Floats]:
    """The times of the indentations that have them [s]."""
    return [
        recording.time_s
        for recording in conditions.of(IndentationConditions)
        if recording.time_s is not None and len(recording.time_s) > 1
    ]


def time_runs_with_displacement(recordings: Sequence[CurveConditions]) -> bool:
    """Whether no law of time can be identified: all curves move one way at the same constant speed.

    Recordings without time_s are ignored.
    """
    speeds = []
    for recording in recordings:
        if recording.time_s is None:
            continue
        moved = np.abs(recording.displacement_mm - recording.displacement_mm[0])
        elapsed = recording.time_s - recording.time_s[0]
        span, duration = float(moved.max()), float(elapsed[-1])
        if span <= 0 or duration <= 0:
            return False
        turned = float((np.maximum.accumulate(moved) - moved).max())
        uneven = float(np.abs(moved / span - elapsed / duration).max())
        if turned > _TURNED_BACK * span or uneven > _UNEVEN:
            return False
        speeds.append(span / duration)
    return bool(speeds) and max(speeds) < _LIKE_SPEEDS * min(speeds)
