"""The laws in words and numbers."""

from __future__ import annotations

import numpy as np

from rig.unlisted.design import Column, Design
from rig.unlisted.forms import filled, from_unit
from rig.unlisted.laws import Law, multiplies

SYMBOL = {
    "gain": "G = G0",
    "modulus": "E = E0",
    "thickness": "h = h0",
    "contact_radius": "a = a_Hertz",
    "force": "F at the skin = F",
}


def expression(law: Law, design: Design) -> str:
    """The law as a formula of its axis, in the units of the campaign; times in hours."""
    if law.spectral:
        return _along_frequency(law, float(design.frequency_hz[-1]))
    column, c, axis = design.columns[law.axis], law.coefficients, law.axis
    if multiplies(law.acts_on):
        symbol = SYMBOL[law.acts_on]
        if law.form == "power":
            exponent = "F" if axis == "preload_n" else "R"
            exponent_in_words = (
                f" (in all {exponent}^{1.0 / 3.0 + c[0]:.3f} instead of {exponent}^(1/3))" if law.altered else ""
            )
            return f"{symbol}·({axis}/{_mean(column):.4g})^{c[0]:.4g}{exponent_in_words}"
        body = _body(law, column)
        return f"{symbol}·exp({body})" if law.form == "exponential" else f"{symbol}·(1 {body})"
    body = _body(law, column)
    if law.acts_on == "position":
        return f"{law.along} = {law.along} commanded + d, d/mm = {body}"
    return f"H = exp(-iδ), δ/rad = {body}"


def _mean(column: Column) -> float:
    return float(np.exp(np.log(filled(column)).mean()))


def _body(law: Law, column: Column) -> str:
    c, p, axis = law.coefficients, law.parameters, law.axis
    x = filled(column)
    low, span = float(x.min()), float(np.ptp(x))
    log = "ln " if column.logarithmic else ""
    match law.form:
        case "linear" | "exponential":
            return f"{c[0]:+.4g}·({axis} - {low:.4g})/{span:.4g}"
        case "power":
            return f"{c[0]:+.4g}·ln({axis}/{_mean(column):.4g})"
        case "saturating":
            return f"{c[0]:+.4g}·(1 - exp(-({axis} - {low:.4g})/{p[0]:.4g}))"
        case "threshold":
            side = "above" if p[1] > 0.0 else "below"
            position = f"{from_unit(column, p[0]):.4g}"
            return f"{c[0]:+.4g}·t, t how far {log}{axis} is {side} that of {position}, over its range"
        case "step":
            return f"{c[0]:+.4g} where {axis} {f'is {column.words[int(p[0])]}' if column.words else f'> {p[0]:.5g}'}"
        case "periodic":
            return f"{c[0]:+.4g}·sin(2π {axis}/{p[0]:.5g}) {c[1]:+.4g}·cos(2π {axis}/{p[0]:.5g})"
        case "peak":
            centre = f"{from_unit(column, p[0]):.4g}"
            distance = f"t the distance of {log}{axis} from that of {centre}, over {p[1]:.3g} of its range"
            return f"{c[0]:+.4g}·exp(-t²/2), {distance}"
        case _:
            return f"{', '.join(f'{v:+.3g}' for v in c)} at the levels or knots after the first"


def _along_frequency(law: Law, top: float) -> str:
    c = law.coefficients
    centre = f"{np.exp(c[1]):.4g} Hz" if len(c) > 1 else ""
    match law.form:
        case "linear":
            return f"|H| = 1 {c[0]:+.4g} f/{top:.4g} Hz up to twice that, level above, minimum phase"
        case "power":
            return f"H = (if/30 Hz)^{c[0]:.4g}"
        case "exponential":
            return f"H = exp(-{c[0]:.4g} √(if/{top:.4g} Hz))"
        case "saturating":
            return f"H = 1 {c[0]:+.4g} if/({centre} + if)"
        case "threshold":
            return f"H = (1 + if/{centre})^{c[0]:.4g}"
        case "step":
            return f"ln|H| {c[0]:+.4g} above {centre}, minimum phase"
        case "periodic":
            return f"H = 1 {c[0]:+.4g} exp(-2πif/{centre})"
        case "peak":
            return f"H = (1 - v² + 2iz(1 {c[0]:+.4g})v)/(1 - v² + 2izv), v = f/{centre}, z = {np.exp(c[2]):.3g}"
        case _:
            return f"ln|H| a spline of ln f through 0, {', '.join(f'{v:.3g}' for v in c)}, minimum phase"
