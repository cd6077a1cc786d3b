"""Unlisted laws of indentation curves, and all unlisted laws as written expressions and as functions of their axis.

A law of curves changes each sample over depth, force or time. It acts on: the contact force, F (1 + u), equivalent
to the modulus without adhesion and stage compliance; the gain of the cell, F (1 + u); the reading of the cell, F +
u; the position of the surface along the travel, d + u. It follows the depth beyond the contact point, the contact
force, or the time since a recording began. Forms are those of laws over recordings (forms.py), with powers, and with
a step where the sphere turns back.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from operator import add
from typing import ClassVar

import numpy as np

from underskin.autodiff import Differentiated, exp
from underskin.mechanisms.base import Kind, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.curve_state import Curve, SampleLaw, Samples
from underskin.mechanisms.unlisted.forms import EVERYWHERE, Axis, Feature, Shape, reference, shapes
from underskin.mechanisms.unlisted.grammar import FrequencyLaw
from underskin.mechanisms.unlisted.laws import LagLaw, LawDescription, RecordingLaw, UnlistedLaw, changes
from underskin.mechanisms.unlisted.vocabulary import ACTS_ON, AXES, ActsOn, Form
from underskin.units import Array, Floats

_ENTERS: tuple[tuple[ActsOn, str, tuple[Form, ...]], ...] = (  # quantity, axis, and forms
    ("modulus", "displacement_mm", ("linear", "power", "saturating", "threshold")),
    ("modulus", "time_s", ("linear", "power", "saturating", "threshold", "step")),
    ("gain", "force_n", ("linear", "power", "saturating", "threshold")),
    ("force", "time_s", ("power", "saturating", "threshold", "step", "periodic")),  # a linear drift every cell may have
    ("force", "displacement_mm", ("saturating", "periodic", "peak")),
    ("position", "displacement_mm", ("power", "saturating", "threshold", "periodic")),
    ("position", "time_s", ("linear", "power", "saturating", "threshold", "step")),
)
_FORMS: Mapping[Form, float] = {
    "linear": 0.25, "power": 0.25, "saturating": 0.2, "threshold": 0.1, "step": 0.1, "periodic": 0.1, "peak": 0.1,
}  # fmt: skip
_RELATIVE, _OF_LARGEST = 0.2, 0.1  # sds of the prior: of a relative change; of the largest force or depth
_MOST = 0.9  # bound of these changes
_LEVELS = 31  # at which an axis is looked at
_LEAST = 1e-6  # of the range: powers begin at 0
TURN = "turn"  # the variant of a step
_REASON = "how a change grows over the measured range: 0.5 with its root, 2 with its square"


@dataclass(frozen=True)
class Extent:
    """The ranges of a campaign's curves: depth [mm], force [N], and time [s] since each recording began; start and
    turning time of each recording [s], by its id."""

    depth_mm: float
    force_n: float
    time_s: float
    start_times: Mapping[str, float]
    turn_times: Mapping[str, float]


class CurveLaw(UnlistedLaw):
    """An unlisted law that changes each sample of a curve."""

    kinds: ClassVar[tuple[Kind, ...]] = ("indentation",)
    stage = Stage.CURVE
    order = 200

    def __init__(self, acts_on: ActsOn, axis: Axis, shape: Shape, extent: Extent) -> None:
        """Bind the form to the ranges of the campaign's curves."""
        self.axis, self.shape, self.grid, self._extent = axis, shape, shape.points, extent
        unit, share, largest = {
            "force": ("N", _OF_LARGEST, extent.force_n),
            "position": ("mm", _OF_LARGEST, extent.depth_mm),
        }.get(acts_on, ("-", _RELATIVE, 1.0))
        sizes = changes("law_change", unit, share * largest, shape.count, _MOST / share)
        description = LawDescription(acts_on, axis.name, shape.form)
        self.describe(description, (shape.form, shape.variant), sizes, shape.shape_parameters)

    def act(self, state: Curve, values: Values) -> None:
        """Add the law at these parameter values to the curve's laws."""
        sample_values = {name: of_samples(value) for name, value in values.items()}
        state.laws.append(SampleLaw(self.description.acts_on, partial(self._change, sample_values)))

    def features(self, samples: Samples, force: Floats, values: Values) -> Sequence[Feature]:
        """The features at samples (points, curves, samples) where the contact force is `force` [N]."""
        origins = self._extent.turn_times if self.shape.variant == TURN else self._extent.start_times
        return self.shape.features(samples.along(self.axis.name, force, origins), values)

    def _change(self, values: Values, samples: Samples, force: Floats) -> Floats:
        """What is added to the force or the travel, or the factor on the force."""
        features = self.features(samples, force, values)
        parts = [
            values[name].value * (feature.value if isinstance(feature, Differentiated) else feature)
            for name, feature in zip(self.amplitudes, features, strict=True)
        ]
        total = np.asarray(reduce(add, parts))
        return total if self.description.acts_on in ("force", "position") else 1 + total


def curve_laws(extent: Extent, along: Collection[str]) -> list[tuple[CurveLaw, float]]:
    """The laws for a campaign of indentations over the axes `along`, each with its log share of the prior."""
    ranges = {"displacement_mm": extent.depth_mm, "force_n": extent.force_n, "time_s": extent.time_s}
    axes = {
        name: Axis(name, {str(index): value for index, value in enumerate(np.linspace(0, high, _LEVELS).tolist())})
        for name, high in ranges.items()
        if high > 0 and name in along
    }
    combinations = [(acts_on, axes[name], forms) for acts_on, name, forms in _ENTERS if name in axes]
    laws: list[tuple[CurveLaw, float]] = []
    for acts_on, axis, forms in combinations:
        for form in forms:
            form_shapes = _shapes(form, axis, extent)
            share = _FORMS[form] / sum(_FORMS[other_form] for other_form in forms) / len(combinations)
            laws += [
                (CurveLaw(acts_on, axis, shape, extent), float(np.log(share / len(form_shapes))))
                for shape in form_shapes
            ]
    return laws


def _shapes(form: Form, axis: Axis, extent: Extent) -> list[Shape]:
    if form == "power":
        return [_power(axis)]
    if form == "step":  # a step elsewhere cannot be distinguished from the contact point
        return [Shape("step", lambda x, _: [(x > 0).astype(float)], variant=TURN)] if extent.turn_times else []
    matching = [shape for shape in shapes(axis) if shape.form == form]
    return matching if form == "periodic" else matching[:1]


def _power(axis: Axis) -> Shape:
    """(x/x_end)^n."""
    exponent = Parameter("law_exponent", "-", 0.2, 6.0, Normal(float(np.log(1.5)), 0.7), "log", None, _REASON)

    def growing(x: Floats, values: Values) -> list[Feature]:
        return [exp(values["law_exponent"] * np.log(np.maximum(x / axis.high, _LEAST)))]

    return Shape(
        "power", growing, shape_parameters=(exponent,), grid=tuple((float(np.log(n)),) for n in (0.5, 2.0, 3.0))
    )


def of_samples(value: Differentiated) -> Differentiated:
    """A value at each point (points, 1) with an axis for samples: (points, 1, 1)."""
    return Differentiated(value.value[..., None], np.zeros((0, *value.value.shape, 1)))


Numbers = Mapping[str, float]  # a law's parameters in their units, by name


def number(value: float) -> str:
    """Three significant digits, never as a power of ten."""
    return np.format_float_positional(float(f"{value:.3g}"), trim="-")


def symbol(axis: Axis | str) -> str:
    """The symbol of an axis in formulas."""
    name = axis if isinstance(axis, str) else axis.name
    letter = AXES[name][1] if name in AXES else name
    return f"{letter}/F" if isinstance(axis, Axis) and axis.relative else letter


def expression(law: UnlistedLaw, values: Numbers) -> str:
    """The formula of a law."""
    if isinstance(law, RecordingLaw):
        return _of_recordings(law, values)
    if isinstance(law, LagLaw):
        return _of_lag(law, values)
    if isinstance(law, CurveLaw):
        return _of_curves(law, values)
    assert isinstance(law, FrequencyLaw)
    return _of_frequency(law, values)


def change_along(law: UnlistedLaw, values: Numbers, x: Floats) -> Array:
    """The change at values x of the axis: relative, of a force in N, of a position in mm (rows, 1 or 2), of a lag in
    rad or as an exponent; over frequency the complex factor less 1."""
    seeds = {name: Differentiated(np.array([[value]]), np.zeros((0, 1, 1))) for name, value in values.items()}
    if isinstance(law, FrequencyLaw):
        return law.factor(x, seeds).value[0] - 1
    assert isinstance(law, RecordingLaw | LagLaw | CurveLaw)
    features = [
        feature.value[0] if isinstance(feature, Differentiated) else np.asarray(feature)
        for feature in law.shape.features(x, seeds)
    ]
    amplitudes = [values[name] for name in law.amplitudes]
    if isinstance(law, LagLaw) and law.shape.logarithmic:
        features = [np.exp(values["law_exponent"] * features[0])]
    parts = len(amplitudes) // len(features)
    totals = [
        sum(a * f for a, f in zip(amplitudes[part * len(features) :], features, strict=False)) + np.zeros(len(x))
        for part in range(parts)
    ]
    if isinstance(law, RecordingLaw) and law.shape.logarithmic and law.description.acts_on != "position":
        return np.exp(totals[0]) - 1
    return totals[0] if parts == 1 else np.stack(totals, axis=1)


def _with_unit(value: float, unit: str) -> str:
    return number(value) if unit == "-" else f"{number(value)} {unit}"


def _less(axis: Axis, zero: float) -> str:
    """(t − 8.2 h)."""
    name = symbol(axis)
    if zero == 0:
        return name
    return f"({name} {'−' if zero > 0 else '+'} {_with_unit(abs(zero), axis.unit)})"


def _signed(value: float) -> tuple[str, str]:
    return ("−" if value < 0 else "+"), number(abs(value))


def change_text(law: RecordingLaw | LagLaw | CurveLaw, values: Numbers, amplitudes: list[float]) -> str:
    """The change added to 1, with its sign first; of a power the factor."""
    axis, shape = law.axis, law.shape
    a = amplitudes[0]
    sign, size = _signed(a)
    name = symbol(axis)
    match shape.form:
        case "power" if isinstance(law, CurveLaw):
            return f"{sign} {size}·({name}/{_with_unit(axis.high, axis.unit)})^{number(values['law_exponent'])}"
        case "linear":
            return _linear_text(axis, shape, a)
        case "exponential":
            length = values["law_growth_length"]
            sign, size = _signed(a / np.expm1(axis.span / length))
            return f"{sign} {size}·(exp({_less(axis, axis.low)}/{_with_unit(length, axis.unit)}) − 1)"
        case "saturating":
            length = values["law_approach"]
            sign, size = _signed(-a / np.expm1(-axis.span / length))
            return f"{sign} {size}·(1 − exp(−{_less(axis, axis.low)}/{_with_unit(length, axis.unit)}))"
        case "threshold" if shape.variant == "lost":
            return f"{'−' if a > 0 else '+'} {_with_unit(abs(a), 'N')}"
        case "threshold":
            onset, above = values["law_onset"], shape.variant == "above"
            slope = number(abs(a) / ((axis.high - onset) if above else (onset - axis.low)))
            per = "" if axis.unit == "-" else f"/{axis.unit}"
            inside = f"{name} − {_with_unit(onset, axis.unit)}" if above else f"{_with_unit(onset, axis.unit)} − {name}"
            return f"{sign} {slope}{per}·max(0, {inside})"
        case "step":
            return f"{sign} {size}·[{_beyond(axis, shape.variant)}]"
        case "periodic":
            size_of, start = wave(law, values, amplitudes)
            period = _with_unit(values["law_period"], axis.unit)
            return f"+ {number(size_of)}·sin(2π·{_less(axis, start)}/{period})"
        case "peak":
            width = _with_unit(values["law_width"], axis.unit)
            return f"{sign} {size}/(1 + ({_less(axis, values['law_centre'])}/{width})²)"
        case _:
            return f"+ s({name}), {f'a value for each {name}' if axis.words else 'a smooth course'}"


def _beyond(axis: Axis, edge: str) -> str:
    """Where a step applies."""
    if axis.words:
        return f"{symbol(axis)} = {edge}"
    return "on the way back" if edge == TURN else f"{symbol(axis)} > {_with_unit(float(edge), axis.unit)}"


def _linear_text(axis: Axis, shape: Shape, a: float) -> str:
    sign, size = _signed(a if shape.variant == EVERYWHERE else a / axis.span)
    if shape.variant == EVERYWHERE:
        return f"{sign} {size}"
    per = "" if axis.unit == "-" else f"/{axis.unit}"
    return f"{sign} {size}{per}·{_less(axis, reference(axis, shape.variant))}"


def wave(law: RecordingLaw | LagLaw | CurveLaw, values: Numbers, amplitudes: list[float]) -> tuple[float, float]:
    """The amplitude of a periodic law, and where its sine begins."""
    a, b = amplitudes[:2]
    size = float(np.hypot(a, b))
    return size, law.axis.low - float(np.arctan2(b, a)) / (2 * np.pi) * values["law_period"]


def _of_recordings(law: RecordingLaw, values: Numbers) -> str:
    acts_on, axis = law.description.acts_on, law.axis
    quantity = ACTS_ON[acts_on][1]
    amplitudes = [values[name] for name in law.amplitudes]
    if acts_on == "position":
        half = len(amplitudes) // 2
        if law.shape.form == "power":
            middle = _with_unit(float(np.sqrt(axis.low * axis.high)), axis.unit)
            parts = [" ".join(_signed(a)) + f" mm·ln({symbol(axis)}/{middle})" for a in amplitudes]
        else:
            parts = [change_text(law, values, part) + " mm" for part in (amplitudes[:half], amplitudes[half:])]
        return f"x = x0 {parts[0]}, y = y0 {parts[1]}"
    if law.shape.logarithmic:
        middle = _with_unit(float(np.sqrt(axis.low * axis.high)), axis.unit)
        return f"{quantity} = {quantity}0·({symbol(axis)}/{middle})^{number(values[law.amplitudes[0]])}"
    change = change_text(law, values, amplitudes)
    if acts_on == "force":
        unit = "" if law.shape.variant == "lost" else " N"
        return f"F at the skin = F {change}{unit}, at least 0.1·F"
    return f"{quantity} = {quantity}0·(1 {change})"


def _of_lag(law: LagLaw, values: Numbers) -> str:
    amplitudes = [values[name] for name in law.amplitudes]
    if law.shape.logarithmic:
        middle = _with_unit(float(np.sqrt(law.axis.low * law.axis.high)), law.axis.unit)
        change = f"{number(amplitudes[0])}·({symbol(law.axis)}/{middle})^{number(values['law_exponent'])}"
    else:
        change = change_text(law, values, amplitudes).removeprefix("+ ")
    if law.dispersion == "angle":
        return f"FRF = FRF0·exp(−i·({change}))"
    if law.dispersion == "delay":
        return f"FRF = FRF0·exp(−i·({change})·f/{number(law.highest_hz)} Hz)"
    if law.dispersion == "corner":
        return f"FRF = FRF0/(1 + ({change})·{number(law.lowest_hz)} Hz/(i·f))"
    return f"FRF = FRF0·(i·f/{number(law.middle_hz)} Hz)^(−({change}))"


def _of_curves(law: CurveLaw, values: Numbers) -> str:
    change = change_text(law, values, [values[name] for name in law.amplitudes])
    return {
        "modulus": f"F = F0·(1 {change})",
        "gain": f"F read = F·(1 {change})",
        "force": f"F read = F {change} N",
        "position": f"d = d0 {change} mm",
    }[law.description.acts_on]


def _of_frequency(law: FrequencyLaw, values: Numbers) -> str:
    def text(name: str) -> str:
        return number(values[name])

    if law.description.form == "peak":
        change = values["law_change"]
        numerator = {"inertia": "u²", "loss": f"2i·{text('law_damping')}·u", "spring": "1"}[law.variant]
        sign, size = _signed(change)
        return (
            f"FRF = FRF0·(1 {sign} {size}·{numerator}/(1 − u² + 2i·{text('law_damping')}·u)), "
            f"u = f/{text('law_centre')} Hz"
        )
    match law.variant:
        case "phase":
            return f"FRF = FRF0·exp(−i·{text('law_lag')}·(f/{number(law.middle_hz)} Hz)^{text('law_exponent')})"
        case "delay":
            return f"FRF = FRF0·exp(−i·{text('law_lag')}·f/{number(law.middle_hz)} Hz)"
        case "high_pass":
            power = number(-values["law_exponent"])
            return f"FRF = FRF0·(1 + {text('law_corner')} Hz/(i·f))^({power})"
        case "magnitude":
            return f"FRF = FRF0·(i·f/{number(law.middle_hz)} Hz)^{text('law_exponent')}"
        case "step":
            sign, size = _signed(values["law_change"])
            return f"FRF = FRF0·(1 {sign} {size}·iv/(1 + iv)), v = f/{text('law_corner')} Hz"
        case "corner":
            return f"FRF = FRF0·(1 + i·f/{text('law_corner')} Hz)^{text('law_exponent')}"
        case "echo":
            sign, size = _signed(values["law_change"])
            return f"FRF = FRF0·(1 {sign} {size}·exp(−2πi·f/{text('law_period')} Hz))"
        case _:
            return "FRF = FRF0·exp(s(f)), a smooth course of magnitude, with the phase that belongs to it"
