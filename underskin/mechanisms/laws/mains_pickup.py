"""The mechanism `mains_pickup`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfDesign, FrfState, Pickup, frequencies
from underskin.recordings.campaign import Conditions, FrfRecording, frf_of
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.line_choice import HARMONIC_WIDTH_HZ, HARMONICS, MAINS_HZ
from underskin.recordings.frf.spectra import Frf
from underskin.units import Floats, Indices
from underskin.weak_cache import cached_while_alive

_WIDTH_HZ = 1.5  # of a line, in the test for the mains frequency
_FURTHEST_HZ = 20.0  # beyond which no line reaches, and short of half way from one harmonic to the next
_REACHED = 0.05  # of the shape
_LEAST_LINES = 3
_NEIGHBOURS = 9  # lines, nearest in frequency, that give the usual scatter
_LEAST_STRAY = 1e-6  # relative; of recordings without noise
_CHARGE = "unshielded leads of some pF to mains at 230 V collect hundredths to tenths of a pC"
_WIDTH = "the analyser's window and the mains' drift make lines a few Hz wide"
_SHARE = "the n-th harmonic has about 1/n of the charge; a sine has none, rectifiers have more"
_of_lines = partial(Parameter, scale="log", acts_on="line_variance")


class MainsPickup(Mechanism):
    """Charge from the mains on the sensors' leads."""

    name = "mains_pickup"
    plain = """The mains put charge on the sensors' leads, so lines at the mains' frequency and its multiples are off,
    the more the weaker the dynamic force."""
    law = """a charge q at the mains' frequency and a share of q/n at its n-th harmonic, each a line of some width,
    whatever the dynamic force: an FRF error of q/Fd, complex, its phase independent in each recording and on each line.
    It adds its square to the lines' variance."""
    assumptions = """q is the standard deviation of each component over recordings; 50 or 60 Hz, whichever is stronger
    in the campaign's lines; harmonics up to the fifth, all with the same share; lines are bells exp(−½ (f/width)²), f
    from the multiple. How phases of neighbouring lines hang together, and the lines' shape in detail, depend on the
    analyser's window and on how the mains drift: neither is relied on."""
    source = "Ott, Electromagnetic Compatibility Engineering (2009), section 2.1 (capacitive coupling to leads)."
    stage = Stage.ADDED_CHARGE
    order = 10
    of = "chain"
    axes = ("frequency_hz", "dynamic_force_n")
    needs = "a line within 3 Hz of 50 or 60 Hz"
    parameters_stated = (
        _of_lines("pickup_charge", "pC", 1e-4, 1e3, Normal(-3.0, 1.5), limit=0.0, shown=0.05, reason=_CHARGE),
        _of_lines("pickup_width", "Hz", 0.2, 6.0, Normal(0.4, 0.6), limit=None, shown=1.5, reason=_WIDTH),
        _of_lines(
            "pickup_harmonics", "-", 1e-3, 10.0, Normal(0.0, 1.5), limit=None, shown=1.0, reason=_SHARE, closed=(1e-3,)
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Lines near the mains are needed."""
        for recording in frf_of(conditions):
            if any(np.abs(frequencies(recording) - mains).min() < HARMONIC_WIDTH_HZ for mains in MAINS_HZ):
                return None
        return "no line lies within 3 Hz of 50 or 60 Hz (frequency_hz)"

    def act(self, state: FrfState, values: Values) -> None:
        """Add charge on the lines within reach of the mains that stand out, each by its nearest harmonic."""
        state.pickup = _pickup(state.design.conditions, state.design)


@cached_while_alive  # a diagnosis composes dozens of models of one campaign
def _pickup(conditions: Conditions, design: FrfDesign) -> Pickup:
    away = np.abs(design.row_frequency[:, None] - _outstanding_mains(conditions) * HARMONICS)
    rows = np.flatnonzero(away.min(axis=1) < _FURTHEST_HZ)
    harmonic = HARMONICS[away[rows].argmin(axis=1)]
    alike = np.column_stack([harmonic, 0.5 * away[rows].min(axis=1) ** 2, design.row_dynamic_force[rows]])
    distinct, row = np.unique(alike, axis=0, return_inverse=True)
    number, half_square, force = distinct.T

    def deviation(values: Mapping[str, Floats]) -> Floats:
        line = np.exp(-half_square / values["pickup_width"] ** 2)
        share = np.where(number == 1, 1.0, values["pickup_harmonics"] / number)
        return np.asarray(1e-12 * values["pickup_charge"] * share * line / force)

    return Pickup(rows, deviation, row.reshape(-1))


@cached_while_alive  # a diagnosis composes dozens of models of one campaign
def _outstanding_mains(conditions: Conditions) -> float:
    """The mains frequency [Hz] whose lines are stronger; where none does, the one that has a line nearest."""
    lines = np.concatenate([frequencies(recording) for recording in frf_of(conditions)])
    nearest = {mains: float(np.abs(lines - mains).min()) for mains in MAINS_HZ}
    measured = [lines_of(recording) for recording in conditions.of(FrfRecording)]
    return max(MAINS_HZ, key=lambda mains: (_excess(measured, mains), -nearest[mains]))


def _excess(recordings: Sequence[Frf], mains: float) -> float:
    """A score for pick-up at these mains: the scatter of the lines that they reach about a straight line between the
    others, against the scatter of neighbouring other lines, Σ shape² (|stray|² over theirs − 1)/√Σ shape⁴, in
    standard deviations."""
    score = weight = 0.0
    reaches: dict[bytes, _Reach] = {}  # most recordings have the same lines
    for lines in recordings:
        key = lines.frequency.tobytes()
        if key not in reaches:
            reaches[key] = _Reach.of(lines.frequency, mains)
        reach = reaches[key]
        if not len(reach.near) or len(reach.far) < _LEAST_LINES:
            continue
        size = np.maximum(np.abs(lines.values), max(float(np.median(np.abs(lines.values))), 1e-300))
        stray = _stray(lines, size, reach.near, reach.far)
        others = _stray(lines, size, reach.far[1::2], reach.far[::2])
        usual = np.median(others[reach.neighbours] ** 2, axis=1) / np.log(2.0)  # median = mean · ln 2
        score += float((reach.shape**2 * (stray**2 - usual) / np.maximum(usual, _LEAST_STRAY**2)).sum())
        weight += float((reach.shape**4).sum())
    return score / np.sqrt(weight) if weight else 0.0


@dataclass(frozen=True)
class _Reach:
    """Indices of a recording's lines: `near`, reached by the mains, with their `shape`; `far`, the others;
    `neighbours`, for each near line the nearest of every second far one."""

    near: Indices
    shape: Floats
    far: Indices
    neighbours: Indices

    @classmethod
    def of(cls, frequency: Floats, mains: float) -> "_Reach":
        shape = _shape(frequency, mains)
        near, far = np.flatnonzero(shape > _REACHED), np.flatnonzero(shape <= _REACHED)
        neighbours = np.abs(frequency[near, None] - frequency[far[1::2]]).argsort(axis=1)[:, :_NEIGHBOURS]
        return cls(near, shape[near], far, neighbours)


def _stray(lines: Frf, size: Floats, rows: Indices, neighbours: Indices) -> Floats:
    """The distance of rows from a straight line between `neighbours`, relative to `size`."""
    between = np.interp(lines.frequency[rows], lines.frequency[neighbours], lines.values[neighbours])
    return np.asarray(np.abs(lines.values[rows] - between) / size[rows])


def _shape(frequency: Floats, mains: float) -> Floats:
    distance = (frequency[:, None] - mains * HARMONICS) / _WIDTH_HZ
    return np.asarray((np.exp(-0.5 * distance**2) / HARMONICS).sum(axis=1))
