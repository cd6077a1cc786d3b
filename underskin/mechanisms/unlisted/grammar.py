"""The grammar of unlisted laws: all laws that a campaign could show, with the prior share of each.

Laws over frequency are the same in all recordings: minimum phase, where the phase follows from the magnitude by the
Kramers–Kronig relations (Bode 1945), since the system is causal; or a pure phase: a dispersive delay, a loss angle over
the measured band.

The share of a law is that of the quantity it acts on, times that of its axis, times that of its form; shapes of one
form (edges of a step, periods) divide its share. All columns of `conditions` together have the share of one axis and a
half, so that many columns are penalised.

A law found on one campaign applies to other recordings of the skin within its range only.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from operator import add

import numpy as np

from underskin.autodiff import Differentiated, exp, log
from underskin.mechanisms.base import Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import FrfState
from underskin.mechanisms.unlisted.forms import Axis, Shape, axes_of, constant, every_axis, shapes
from underskin.mechanisms.unlisted.laws import (
    DISPERSIONS,
    LagLaw,
    LawDescription,
    LevelTables,
    RecordingLaw,
    UnlistedLaw,
    changes,
)
from underskin.mechanisms.unlisted.vocabulary import AXES, ActsOn, Form
from underskin.recordings.campaign import Conditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Mask

_BAND = "anywhere within the measured band"
_BELOW = 30.0  # times below the band a corner may lie whose phase still shows in it
_BUMPS, _BUMP_WIDTH = 8, 0.55  # of a free response; width over the distance of neighbours

Factor = Callable[[Floats, Values], Differentiated]  # at frequencies [Hz]


class FrequencyLaw(UnlistedLaw):
    """A law over frequency, with the band in which it was found."""

    stage = Stage.LINES
    order = 210

    middle_hz: float  # of the band, to which powers refer

    def __init__(
        self,
        form: Form,
        variant: str,
        amplitudes: tuple[Parameter, ...],
        shape_parameters: tuple[Parameter, ...],
        grid: Sequence[Sequence[float]],
        factor: Factor,
        share: float = 1.0,
    ) -> None:
        """`factor` at frequencies, as a function of the amplitudes and the shape parameters."""
        description = LawDescription("frequency_response", "frequency_hz", form)
        self.describe(description, (form, variant), amplitudes, shape_parameters)
        self.variant, self.share, self.factor = variant, share, factor
        self.grid = np.array(grid, dtype=float).reshape(len(grid), -1)

    def act(self, state: FrfState, values: Values) -> None:
        """Set the factor on each distinct line."""
        state.factor = self.factor(state.design.line_frequency, values)

    def tangents(self, frequency: Floats) -> Array:
        """∂ ln factor by each amplitude at 0, at the grid of the shape parameters (points, frequencies, amplitudes)."""
        points, count = len(self.grid), len(self.amplitudes)
        values: dict[str, Differentiated] = {}
        for number, parameter in enumerate(self.parameters_stated):
            slopes = np.zeros((count, points, 1))
            value = np.zeros((points, 1))
            if number < count:
                slopes[number] = 1.0
            else:
                at = self.grid[:, number - count, None]
                value = np.exp(at) if parameter.scale == "log" else at
            values[parameter.name] = Differentiated(value, slopes)
        answer = self.factor(frequency, values)
        return np.moveaxis(answer.slopes / answer.value, 0, -1)


def frequency_laws(frequency: Floats) -> list[FrequencyLaw]:
    """All laws over a band of lines [Hz]."""
    low, high = float(frequency.min()), float(frequency.max())
    if high < 1.5 * low or len(frequency) < 6:
        return []
    middle = float(np.sqrt(low * high))
    laws = [*_phases(middle), *_powers(low, high, middle), *_peaks(low, high), _echo(low, high), _free(low, high)]
    for law in laws:
        law.middle_hz = middle
    return laws


def _amplitude(sd: float, name: str = "law_change") -> Parameter:
    (amplitude,) = changes(name, "-", sd, 1)
    return amplitude


def _corner(low: float, high: float, name: str = "law_corner") -> Parameter:
    return Parameter(name, "Hz", low, high, Uniform(), "log", None, _BAND)


def _over_band(low: float, high: float, count: int) -> list[float]:
    return np.linspace(np.log(low), np.log(high), count).tolist()


def _phases(middle: float) -> list[FrequencyLaw]:
    """exp(−i A (f/f1)^n): 0 a loss angle, 1 a delay, others a dispersive delay; and a pure delay."""
    exponent = Parameter(
        "law_exponent", "-", 0.0, 4.0, Uniform(), "linear", None, "from a loss angle to f⁴", closed=(0.0,)
    )

    def factor(frequency: Floats, values: Values) -> Differentiated:
        return exp(values["law_lag"] * exp(values["law_exponent"] * np.log(frequency / middle)) * -1j)

    def late(frequency: Floats, values: Values) -> Differentiated:
        return exp(values["law_lag"] * (-1j * frequency / middle))

    grid = [(value,) for value in (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)]
    lag = _amplitude(0.2, "law_lag")
    return [
        FrequencyLaw("power", "phase", (lag,), (exponent,), grid, factor),
        FrequencyLaw("linear", "delay", (lag,), (), [()], late),
    ]


def _powers(low: float, high: float, middle: float) -> list[FrequencyLaw]:
    """Minimum phase: (if)^n; a step from 1 to 1 + A; beyond a corner (1 + if/f1)^n; below one (1 + f1/(if))^(−n)."""

    def power(frequency: Floats, values: Values) -> Differentiated:
        return exp(values["law_exponent"] * (np.log(frequency / middle) + 0.5j * np.pi))

    def step(frequency: Floats, values: Values) -> Differentiated:
        ratio = 1j * frequency / values["law_corner"]
        return 1.0 + values["law_change"] * (ratio / (1.0 + ratio))

    def beyond(frequency: Floats, values: Values) -> Differentiated:
        return exp(values["law_exponent"] * log(1.0 + 1j * frequency / values["law_corner"]))

    def beneath(frequency: Floats, values: Values) -> Differentiated:
        return exp(-values["law_exponent"] * log(1.0 + values["law_corner"] * (-1j / frequency)))

    corner, lower = _corner(low, high), _corner(low / _BELOW, high)
    grid = [(at,) for at in _over_band(low, high, 8)]
    from_below = [(at,) for at in _over_band(low / _BELOW, high, 8)]
    order = _amplitude(0.7, "law_exponent")
    return [
        FrequencyLaw("power", "magnitude", (_amplitude(0.15, "law_exponent"),), (), [()], power),
        FrequencyLaw("saturating", "step", (_amplitude(0.3),), (corner,), grid, step),
        FrequencyLaw("threshold", "corner", (order,), (corner,), grid, beyond, 0.5),
        FrequencyLaw("threshold", "high_pass", (order,), (lower,), from_below, beneath, 0.5),
    ]


def _peaks(low: float, high: float) -> list[FrequencyLaw]:
    """A resonance at one frequency in all recordings, added to the response: 1 + A u²/(1 − u² + 2iζu), and variants."""
    corner = _corner(0.8 * low, 1.25 * high, "law_centre")
    damping = Parameter("law_damping", "-", 5e-3, 1.0, Normal(-2.8, 1.0), "log", None, "sharp to broad")
    grid = [
        (at, float(np.log(zeta)))
        for zeta, count in ((0.03, 60), (0.1, 24), (0.35, 10))
        for at in _over_band(low, high, count)
    ]
    numerators: dict[str, Callable[[Differentiated, Values], Differentiated | complex]] = {
        "inertia": lambda u, _: u * u,
        "loss": lambda u, values: 2j * values["law_damping"] * u,
        "spring": lambda *_: 1.0,
    }

    def of(name: str) -> FrequencyLaw:
        def factor(frequency: Floats, values: Values) -> Differentiated:
            u = frequency / values["law_centre"]
            numerator = numerators[name](u, values)
            return 1.0 + values["law_change"] * (numerator / (1.0 - u * u + 2j * values["law_damping"] * u))

        return FrequencyLaw("peak", name, (_amplitude(0.2),), (corner, damping), grid, factor, 1 / len(numerators))

    return [of(name) for name in numerators]


def _echo(low: float, high: float) -> FrequencyLaw:
    """1 + A e^(−2πif/f1): an echo, whose ripples recur every f1."""
    spacing = _corner(2.2 * (high - low) / 60, 2 * (high - low), "law_period")

    def factor(frequency: Floats, values: Values) -> Differentiated:
        return 1.0 + values["law_change"] * exp((-2j * np.pi * frequency) / values["law_period"])

    turns = np.arange(1.0, 14.0, 0.5)
    grid = [(float(np.log((high - low) / turn)),) for turn in turns.tolist()]
    return FrequencyLaw("periodic", "echo", (_amplitude(0.15),), (spacing,), grid, factor)


def _free(low: float, high: float) -> FrequencyLaw:
    """ln |FRF| a sum of bumps over ln f, the phase by Kramers and Kronig."""
    centres = np.linspace(np.log(low), np.log(high), _BUMPS)
    width = _BUMP_WIDTH * (centres[1] - centres[0])
    names = tuple(f"law_change_{number + 1}" for number in range(_BUMPS))

    def factor(frequency: Floats, values: Values) -> Differentiated:
        away = (np.log(frequency) - centres[:, None]) / width
        bumps = np.exp(-0.5 * away**2) + 1j * phase_of_bump(away, float(width))
        return exp(reduce(add, [values[name] * bump for name, bump in zip(names, bumps, strict=True)]))

    return FrequencyLaw("free", "minimum_phase", tuple(_amplitude(0.1, name) for name in names), (), [()], factor)


@lru_cache(maxsize=8)
def _phase_table(width: float) -> tuple[Floats, Floats]:
    """The phase of a bump of this width in ln ω, over u: φ = (1/π) ∫ dM/dx ln coth(|x − x0|/2) dx (Bode 1945)."""
    stride = width / 60
    x = np.arange(-6 * width, 6 * width, stride) + stride / 2
    slope = -x / width**2 * np.exp(-0.5 * (x / width) ** 2)
    at = np.linspace(-12 * width, 12 * width, 481)  # midpoints, off the logarithm's pole
    kernel = -np.log(np.tanh(np.abs(x - at[:, None]) / 2))
    return at / width, np.asarray(kernel @ slope * stride / np.pi)


def phase_of_bump(away: Floats, width: float) -> Floats:
    """The phase [rad] that belongs to ln |H| = e^(−u²/2), u = ln(ω/ω0)/width, at u = `away`; 0 far off."""
    return np.interp(away, *_phase_table(width))


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
_FREQUENCY = 0.5  # of the frequency response: laws over frequency only
_POSITION_AXES = ("order", "recorded_at", "time_of_day", "previous_preload_n", "preload_n", "load_cycles")
_CONSTANTS: Mapping[
    ActsOn, tuple[str, tuple[str, ...]]
] = {  # the mechanism of the catalogue, and the axes that show it best
    "modulus": ("modulus_error", ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")),
    "thickness": ("thickness_error", ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")),
    "position": ("misalignment", ("x_mm", "y_mm", "preload_n", "indenter_radius_mm")),
}
_SENSORS_GAIN = "sensor_spread"
_OF_LEVELS: tuple[ActsOn, ...] = ("gain", "modulus", "thickness", "contact_radius", "force", "position")


@dataclass(frozen=True, eq=False)
class Grammar:
    """The laws of one campaign and the log prior share of each."""

    laws: Sequence[UnlistedLaw]
    log_shares: Floats  # (laws,)

    @classmethod
    def of(
        cls,
        conditions: Conditions,
        frequency: Floats,
        table: SigmaTable,
        listed: Collection[str],
    ) -> "Grammar":
        """The laws for FRFs at these distinct lines [Hz].

        `listed`: names of mechanisms; a law that one of them describes exactly is left out.
        """
        laws: list[UnlistedLaw] = []
        shares: list[float] = []
        axes = axes_of(conditions) if len(conditions.recordings) >= _LEAST_RECORDINGS else []
        columns = [axis for axis in axes if axis.name not in AXES]
        tables = LevelTables(conditions, table)
        lines = np.unique(frequency)
        for axis in axes:
            share = 1.0 if axis.name in AXES else _COLUMNS / len(columns)
            for law in [*_over_recordings(axis, lines, tables, listed), *_constants(axis, axes, tables, listed)]:
                laws.append(law)
                shares.append(share * _share(law))
        total = sum(1.0 for axis in axes if axis.name in AXES) + (_COLUMNS if columns else 0.0)
        log_shares = np.log(np.array(shares) / max(total, 1.0)) if shares else np.zeros(0)
        over_frequency = frequency_laws(lines) if len(lines) >= _LEAST_LINES else []
        frequency_shares = [_FREQUENCY * _share(law) for law in over_frequency]
        return cls([*laws, *over_frequency], np.append(log_shares, np.log(frequency_shares)))


def combination(law: UnlistedLaw) -> tuple[str, str, str]:
    """The quantity it acts on, the axis it follows, and its form."""
    return law.description.acts_on, law.description.axis, law.description.form


def _share(law: UnlistedLaw) -> float:
    return _ACTS_ON[law.description.acts_on] * _FORMS[law.description.form] * law.share


def _over_recordings(axis: Axis, lines: Floats, tables: LevelTables, listed: Collection[str]) -> list[UnlistedLaw]:
    laws: list[UnlistedLaw] = []
    for shape in shapes(axis):
        laws += [
            RecordingLaw(acts_on, axis, shape, tables)
            for acts_on in _OF_LEVELS
            if _makes_sense(acts_on, axis, shape, listed)
        ]
        if len(lines) >= 2 and shape.form != "free":
            laws += [LagLaw(dispersion, axis, shape, lines) for dispersion in DISPERSIONS]
    if axis.name == "preload_n":
        lost = Shape("threshold", lambda x, _: [-np.ones_like(x)], variant="lost", share=_CONSTANT)
        laws.append(RecordingLaw("force", axis, lost, tables))
    return laws


def _constants(axis: Axis, axes: Sequence[Axis], tables: LevelTables, listed: Collection[str]) -> list[UnlistedLaw]:
    """Changes that are the same in all recordings, on the axis that shows them best."""
    available = {other.name for other in axes}
    return [
        RecordingLaw(acts_on, axis, constant(_CONSTANT), tables)
        for acts_on, (mechanism, best) in _CONSTANTS.items()
        if mechanism not in listed and axis.name == next((name for name in best if name in available), None)
    ]


def _makes_sense(acts_on: ActsOn, axis: Axis, shape: Shape, listed: Collection[str]) -> bool:
    """Whether a rig can have this combination and no other combination is equivalent."""
    if axis.name == "sensor":
        return acts_on in ("thickness", "modulus") or (acts_on == "gain" and _SENSORS_GAIN not in listed)
    if acts_on == "position":
        return axis.name in _POSITION_AXES or axis.name not in AXES
    if acts_on == "force":  # a force that is scaled is a modulus that is
        return not shape.logarithmic and axis.name not in ("preload_n", "indenter_radius_mm", "x_mm", "y_mm")
    return True


_ROUNDING = 1e-9  # of the range, by which a value may lie beyond it
CAMPAIGN_SPECIFIC_AXES = ("order",)  # axes without meaning for other recordings


def bound_to(law: UnlistedLaw, conditions: Conditions, table: SigmaTable) -> tuple[UnlistedLaw, Mask]:
    """The law on these recordings, and which of them (recordings,) lie in its range.

    A recording beyond the range, or without a value on its axis, is predicted at the end of the range.
    """
    ids = [recording.id for recording in frf_of(conditions)]
    if not isinstance(law, RecordingLaw | LagLaw):
        return law, np.ones(len(ids), dtype=bool)
    axis, inside = _on(law.axis, conditions, ids)
    if isinstance(law, LagLaw):
        return law.on(axis), inside
    return law.on(axis, LevelTables(conditions, table)), inside


def _on(axis: Axis, conditions: Conditions, ids: Sequence[str]) -> tuple[Axis, Mask]:
    axes = {
        (candidate.name, candidate.relative): candidate
        for candidate in every_axis(conditions, axis.origin)
        if candidate.name not in CAMPAIGN_SPECIFIC_AXES
    }
    current = axes.get((axis.name, axis.relative))
    if current is not None and axis.name == "previous_preload_n":
        timed = all(recording.recorded_at is not None for recording in frf_of(conditions))
        current = current if timed else None  # the order is unknown
    if current is None:
        return replace(axis, values=dict.fromkeys(ids, axis.low), range=(axis.low, axis.high)), np.zeros(
            len(ids), dtype=bool
        )
    if axis.words:
        words = [current.words[round(value)] for value in current.of(ids)]
        inside = np.array([word in axis.words for word in words])
        indices = [float(axis.words.index(word)) if word in axis.words else 0.0 for word in words]
        return replace(axis, values=dict(zip(ids, indices, strict=True)), range=(axis.low, axis.high)), inside
    values = current.of(ids)
    tolerance = _ROUNDING * axis.span
    inside = (values >= axis.low - tolerance) & (values <= axis.high + tolerance)
    clipped = np.clip(values, axis.low, axis.high).tolist()
    return replace(axis, values=dict(zip(ids, clipped, strict=True)), range=(axis.low, axis.high)), inside
