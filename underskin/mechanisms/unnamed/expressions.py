"""A law as an expression with numbers and units, and as a course over its axis."""

from collections.abc import Mapping

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.unnamed.axes import Axis
from underskin.mechanisms.unnamed.curve_laws import CurveLaw
from underskin.mechanisms.unnamed.forms import EVERYWHERE, Shape, reference
from underskin.mechanisms.unnamed.frequency_laws import FrequencyLaw
from underskin.mechanisms.unnamed.laws import LagLaw, RecordingLaw, UnnamedLaw
from underskin.mechanisms.unnamed.vocabulary import ACTS_ON, AXES
from underskin.units import Array, Floats

Numbers = Mapping[str, float]  # a law's parameters in their units, by name


def number(value: float) -> str:
    """Three significant digits, never as a power of ten."""
    return np.format_float_positional(float(f"{value:.3g}"), trim="-")


def symbol(axis: Axis | str) -> str:
    """An axis as formulas have it."""
    name = axis if isinstance(axis, str) else axis.name
    own = AXES[name][1] if name in AXES else name
    return f"{own}/F" if isinstance(axis, Axis) and axis.relative else own


def expression(law: UnnamedLaw, values: Numbers) -> str:
    """What the law is."""
    if isinstance(law, RecordingLaw):
        return _of_recordings(law, values)
    if isinstance(law, LagLaw):
        return _of_lag(law, values)
    if isinstance(law, CurveLaw):
        return _of_curves(law, values)
    assert isinstance(law, FrequencyLaw)
    return _of_frequency(law, values)


def course(law: UnnamedLaw, values: Numbers, x: Floats) -> Array:
    """The change at values x of the axis: relative, of a force in N, of a place in mm (rows, 1 or 2), of a lag in rad
    or as an exponent; over frequency the complex factor less 1."""
    seeds = {name: Differentiated(np.array([[value]]), np.zeros((0, 1, 1))) for name, value in values.items()}
    if isinstance(law, FrequencyLaw):
        return law.factor(x, seeds).value[0] - 1
    assert isinstance(law, RecordingLaw | LagLaw | CurveLaw)
    features = [
        one.value[0] if isinstance(one, Differentiated) else np.asarray(one) for one in law.shape.features(x, seeds)
    ]
    amplitudes = [values[name] for name in law.amplitudes]
    if isinstance(law, LagLaw) and law.shape.logarithmic:
        features = [np.exp(values["law_exponent"] * features[0])]
    parts = len(amplitudes) // len(features)
    totals = [
        sum(a * f for a, f in zip(amplitudes[part * len(features) :], features, strict=False)) + np.zeros(len(x))
        for part in range(parts)
    ]
    if isinstance(law, RecordingLaw) and law.shape.logarithmic and law.spoken.acts_on != "position":
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
    """What is added to 1, with its sign first; of a power the factor."""
    axis, shape = law.axis, law.shape
    a = amplitudes[0]
    sign, size = _signed(a)
    name = symbol(axis)
    if axis.words and shape.form == "step":
        return f"{sign} {size}·[{name} = {shape.variant}]"
    match shape.form:
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
            return f"{sign} {size}·[{name} > {_with_unit(float(shape.variant), axis.unit)}]"
        case "periodic":
            size_of, start = wave(law, values, amplitudes)
            period = _with_unit(values["law_period"], axis.unit)
            return f"+ {number(size_of)}·sin(2π·{_less(axis, start)}/{period})"
        case "peak":
            width = _with_unit(values["law_width"], axis.unit)
            return f"{sign} {size}/(1 + ({_less(axis, values['law_centre'])}/{width})²)"
        case _:
            return f"+ s({name}), {f'a value for each {name}' if axis.words else 'a smooth course'}"


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
    acts_on, axis = law.spoken.acts_on, law.axis
    quantity = ACTS_ON[acts_on][1]
    amplitudes = [values[name] for name in law.amplitudes]
    if acts_on == "position":
        half = len(amplitudes) // 2
        if law.shape.form == "power":
            middle = _with_unit(float(np.sqrt(axis.low * axis.high)), axis.unit)
            each = [" ".join(_signed(a)) + f" mm·ln({symbol(axis)}/{middle})" for a in amplitudes]
        else:
            each = [change_text(law, values, part) + " mm" for part in (amplitudes[:half], amplitudes[half:])]
        return f"x = x0 {each[0]}, y = y0 {each[1]}"
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
    if law.kind == "angle":
        return f"FRF = FRF0·exp(−i·({change}))"
    if law.kind == "delay":
        return f"FRF = FRF0·exp(−i·({change})·f/{number(law.highest_hz)} Hz)"
    if law.kind == "corner":
        return f"FRF = FRF0/(1 + ({change})·{number(law.lowest_hz)} Hz/(i·f))"
    return f"FRF = FRF0·(i·f/{number(law.middle_hz)} Hz)^(−({change}))"


def _of_curves(law: CurveLaw, values: Numbers) -> str:
    amplitudes = [values[name] for name in law.amplitudes]
    sign, size = _signed(amplitudes[0])
    match law.spoken.form:
        case "power":
            over = f"{symbol(law.axis)}/{_with_unit(law.axis.high, law.axis.unit)}"
            change = f"{sign} {size}·({over})^{number(values['law_exponent'])}"
        case "step":
            change = f"{sign} {size}·[on the way back]"
        case _:
            change = change_text(law, values, amplitudes)
    return {
        "modulus": f"F = F0·(1 {change})",
        "gain": f"F read = F·(1 {change})",
        "force": f"F read = F {change} N",
        "position": f"d = d0 {change} mm",
    }[law.spoken.acts_on]


def _of_frequency(law: FrequencyLaw, values: Numbers) -> str:
    def said(name: str) -> str:
        return number(values[name])

    if law.spoken.form == "peak":
        change = values["law_change"]
        numerator = {"inertia": "u²", "loss": f"2i·{said('law_damping')}·u", "spring": "1"}[law.variant]
        sign, size = _signed(change)
        return (
            f"FRF = FRF0·(1 {sign} {size}·{numerator}/(1 − u² + 2i·{said('law_damping')}·u)), "
            f"u = f/{said('law_centre')} Hz"
        )
    match law.variant:
        case "phase":
            return f"FRF = FRF0·exp(−i·{said('law_lag')}·(f/{number(law.middle_hz)} Hz)^{said('law_exponent')})"
        case "delay":
            return f"FRF = FRF0·exp(−i·{said('law_lag')}·f/{number(law.middle_hz)} Hz)"
        case "high_pass":
            power = number(-values["law_exponent"])
            return f"FRF = FRF0·(1 + {said('law_corner')} Hz/(i·f))^({power})"
        case "magnitude":
            return f"FRF = FRF0·(i·f/{number(law.middle_hz)} Hz)^{said('law_exponent')}"
        case "step":
            sign, size = _signed(values["law_change"])
            return f"FRF = FRF0·(1 {sign} {size}·iv/(1 + iv)), v = f/{said('law_corner')} Hz"
        case "corner":
            return f"FRF = FRF0·(1 + i·f/{said('law_corner')} Hz)^{said('law_exponent')}"
        case "echo":
            sign, size = _signed(values["law_change"])
            return f"FRF = FRF0·(1 {sign} {size}·exp(−2πi·f/{said('law_period')} Hz))"
        case _:
            return "FRF = FRF0·exp(s(f)), a smooth course of magnitude, with the phase that belongs to it"
