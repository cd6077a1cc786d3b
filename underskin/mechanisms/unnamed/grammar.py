"""All laws of the grammar that a campaign could show, and the share of each in the prior of something unnamed.

The share is that of where a law enters, times that of what it follows, times that of its form; shapes of one form
(edges of a step, periods) divide its share. All columns of `conditions` together have the share of one axis and a half,
so that many of them are paid for.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.unnamed.axes import BUILT_IN, Axis, axes_of
from underskin.mechanisms.unnamed.forms import Shape, constant, shapes
from underskin.mechanisms.unnamed.frequency_laws import FrequencyLaw, frequency_laws
from underskin.mechanisms.unnamed.laws import LAG_KINDS, LagLaw, RecordingLaw, UnnamedLaw
from underskin.mechanisms.unnamed.level_tables import LevelTables
from underskin.mechanisms.unnamed.vocabulary import ActsOn, Form
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_LEAST_RECORDINGS, _LEAST_LINES = 6, 6
_ACTS_ON: Mapping[ActsOn, float] = {
    "gain": 0.25,
    "modulus": 0.2,
    "thickness": 0.1,
    "contact_radius": 0.1,
    "force": 0.1,
    "position": 0.05,
    "frequency_response": 0.2,
}
_FORMS: Mapping[Form, float] = {
    "linear": 0.3,
    "power": 0.15,
    "exponential": 0.04,
    "saturating": 0.13,
    "threshold": 0.08,
    "step": 0.12,
    "periodic": 0.08,
    "peak": 0.05,
    "free": 0.05,
}
_CONSTANT = 4.0  # a constant is looked for along one axis of several
_COLUMNS = 1.5  # axes that all columns of `conditions` count for
_FREQUENCY = 0.5  # of the frequency response: laws over frequency alone
_PLACES_FOLLOW = ("order", "recorded_at", "time_of_day", "previous_preload_n", "preload_n", "load_cycles")
_CONSTANTS: Mapping[ActsOn, tuple[str, tuple[str, ...]]] = {  # what does it by name, and the axes that show it best
    "modulus": ("modulus_error", ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")),
    "thickness": ("thickness_error", ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")),
    "position": ("misalignment", ("x_mm", "y_mm", "preload_n", "indenter_radius_mm")),
}
_SENSORS_GAIN = "sensor_spread"
_OF_LEVELS: tuple[ActsOn, ...] = ("gain", "modulus", "thickness", "contact_radius", "force", "position")


@dataclass(frozen=True, eq=False)
class Grammar:
    """The laws of one campaign, by combination of where, what and form, and the log prior share of each law."""

    laws: Sequence[UnnamedLaw]
    log_shares: Floats  # (laws,)

    @classmethod
    def of(
        cls,
        conditions: Conditions,
        frequency: Floats,
        table: SigmaTable,
        beside: Sequence[Mechanism],
        named: Collection[str],
    ) -> "Grammar":
        """Of FRFs at these distinct lines [Hz]; `beside` mechanisms for which σ has room. What one of those `named`
        does exactly is no law."""
        laws: list[UnnamedLaw] = []
        shares: list[float] = []
        axes = axes_of(conditions) if len(conditions.recordings) >= _LEAST_RECORDINGS else []
        columns = [axis for axis in axes if axis.name not in BUILT_IN]
        tables = LevelTables(conditions, table, beside)
        lines = np.unique(frequency)
        for axis in axes:
            share = 1.0 if axis.name in BUILT_IN else _COLUMNS / len(columns)
            for law in [*_over_recordings(axis, lines, tables, named), *_constants(axis, axes, tables, named)]:
                laws.append(law)
                shares.append(share * _share(law))
        total = sum(1.0 for axis in axes if axis.name in BUILT_IN) + (_COLUMNS if columns else 0.0)
        log_shares = np.log(np.array(shares) / max(total, 1.0)) if shares else np.zeros(0)
        over_frequency = frequency_laws(lines) if len(lines) >= _LEAST_LINES else []
        own = [_FREQUENCY * _share(law) for law in over_frequency]
        return cls([*laws, *over_frequency], np.append(log_shares, np.log(own)))


def combination(law: UnnamedLaw) -> tuple[str, str, str]:
    """Where it enters, what it follows, and its form."""
    return law.spoken.acts_on, law.spoken.axis, law.spoken.form


def _share(law: UnnamedLaw) -> float:
    return _ACTS_ON[law.spoken.acts_on] * _FORMS[law.spoken.form] * law.share


def _over_recordings(axis: Axis, lines: Floats, tables: LevelTables, named: Collection[str]) -> list[UnnamedLaw]:
    each: list[UnnamedLaw] = []
    for shape in shapes(axis):
        each += [
            RecordingLaw(acts_on, axis, shape, tables)
            for acts_on in _OF_LEVELS
            if _makes_sense(acts_on, axis, shape, named)
        ]
        if len(lines) >= 2 and shape.form != "free":
            each += [LagLaw(kind, axis, shape, lines) for kind in LAG_KINDS]
    if axis.name == "preload_n":
        lost = Shape("threshold", lambda x, _: [-np.ones_like(x)], variant="lost", share=_CONSTANT)
        each.append(RecordingLaw("force", axis, lost, tables))
    return each


def _constants(axis: Axis, axes: Sequence[Axis], tables: LevelTables, named: Collection[str]) -> list[UnnamedLaw]:
    """Changes that are the same in all recordings, on the axis that shows them best."""
    available = {entry.name for entry in axes}
    return [
        RecordingLaw(acts_on, axis, constant(_CONSTANT), tables)
        for acts_on, (mechanism, best) in _CONSTANTS.items()
        if mechanism not in named and axis.name == next((name for name in best if name in available), None)
    ]


def _makes_sense(acts_on: ActsOn, axis: Axis, shape: Shape, named: Collection[str]) -> bool:
    """Whether the combination is one that a rig can have and no other combination is."""
    if axis.name == "sensor":
        return acts_on in ("thickness", "modulus") or (acts_on == "gain" and _SENSORS_GAIN not in named)
    if acts_on == "position":
        return axis.name in _PLACES_FOLLOW or axis.name not in BUILT_IN
    if acts_on == "force":  # a force that is scaled is a modulus that is
        return not shape.logarithmic and axis.name not in ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")
    return True


__all__ = ["FrequencyLaw", "Grammar", "combination"]
