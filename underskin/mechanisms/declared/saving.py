"""A law that a diagnosis found, written as the document of a declared mechanism."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import yaml

from underskin.errors import InvalidInput
from underskin.mechanisms.declared.document import SCHEMA
from underskin.mechanisms.unlisted.forms import EVERYWHERE
from underskin.mechanisms.unlisted.laws import PREFIX
from underskin.mechanisms.unlisted.vocabulary import OF_SAMPLES

_WIDER = 0.5  # of a value, or of its logarithm: the prior's sd in later campaigns
_MARGIN = 0.05  # of the range, off its ends
_ADDS = {"force", "position"}
_POSITIONS = ("onset", "centre")  # parameters that are positions along the axis


def document(report: Mapping[str, Any], name: str, description: str | None = None) -> str:
    """The YAML of the law in a report; raises InvalidInput where no expression can describe it."""
    law = report.get("unnamed")
    if law is None:
        raise InvalidInput("report", report.get("verdict"), "must hold a law that nobody listed (unnamed)")
    provenance = report["provenance"].get("unnamed")
    if provenance is None:
        raise InvalidInput("report", "an older report", "says too little of its law: diagnose the campaign again")
    values: dict[str, float] = {
        key.removeprefix("law_"): float(value) for key, value in provenance["parameters"].items()
    }
    expressions, logarithmic = _expressions(law, provenance["law"], values)
    units = {parameter["name"]: parameter["unit"] for parameter in law.get("parameters", ())}
    strengths = {key for key in values if key.startswith(("change", "lag"))} or {"exponent"}
    parameters: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        if key in logarithmic:
            declared = _logarithmic(value)
        elif key in _POSITIONS:
            declared = _within(next(iter(law["range"].values())))
        else:
            declared = {**_linear_in(value), **({"limit": 0} if key in strengths else {})}
        parameters[key] = {"unit": units.get(key, "-"), **declared}
    axes = [law["axis"], *(["preload_n"] if "__relative__" in provenance["law"] else [])]
    body = {
        "schema": SCHEMA,
        "name": name,
        "description": description or f"Found by a diagnosis: {law['acts_on']} over {law['axis']}, {law['form']}.",
        "acts_on": law["acts_on"],
        "axes": axes,
        "law": expressions[0] if len(expressions) == 1 else expressions,
        "parameters": parameters,
        "source": f"Diagnosis of the campaign {report['campaign']}: {law['expression']}",
    }
    return str(yaml.safe_dump(body, sort_keys=False, allow_unicode=True, width=110))


def _logarithmic(value: float) -> dict[str, Any]:
    low, high = float(f"{value / 10:.4g}"), float(f"{value * 10:.4g}")
    return {"low": low, "high": high, "scale": "log", "prior": {"mean": value, "sd": _WIDER}}


def _linear_in(value: float) -> dict[str, Any]:
    size = max(abs(value), 1e-6)
    low, high = float(f"{value - 6 * size:.4g}"), float(f"{value + 6 * size:.4g}")
    return {"low": low, "high": high, "prior": {"mean": value, "sd": float(f"{_WIDER * size:.4g}")}}


def _within(ends: Sequence[float]) -> dict[str, Any]:
    """A position along the axis, inside the measured range: at its end a threshold's slope is unbounded."""
    low, high = ends
    margin = _MARGIN * (high - low)
    return {"low": float(f"{low + margin:.6g}"), "high": float(f"{high - margin:.6g}")}


_LOGARITHMIC = {  # parameters with a logarithmic scale
    *("growth_length", "approach", "period", "width", "corner", "centre", "damping"),
}


def _expressions(law: Mapping[str, Any], name: str, values: Mapping[str, float]) -> tuple[list[str], set[str]]:
    """The law's expressions, and which of its parameters have a logarithmic scale."""
    parts = name.removeprefix(PREFIX).split("__")
    logarithmic = {key for key in values if key in _LOGARITHMIC}
    if law["axis"] == "frequency_hz":
        low, high = next(iter(law["range"].values()))
        return [_over_frequency(parts[-1], float(np.sqrt(low * high)))], logarithmic
    ends = next(iter(law["range"].values()))
    if law["form"] == "free" or not all(isinstance(end, int | float) for end in ends):
        raise InvalidInput(
            "report", law["form"], "a smooth course, or one of words, is no expression: it cannot be kept"
        )
    x = f"{law['axis']}/preload_n" if "relative" in parts else law["axis"]
    low, high = (float(end) for end in ends)
    form = parts[parts.index("relative") + 1 if "relative" in parts else 2]
    variant = parts[-1]
    if law["form"] in ("peak", "notch") and "centre" in logarithmic:
        logarithmic.discard("centre")  # along an axis of recordings the centre may be negative
    kind = next((part for part in parts if part in ("angle", "delay", "power", "corner")), None)
    if law["acts_on"] == "frequency_response":
        raise InvalidInput("report", kind, "a lag that follows an axis of the recordings: write its file by hand")
    amplitudes = [key for key in values if key.startswith("change")]
    if law["axis"] in OF_SAMPLES and form == "power":
        growing = f"change * ({x} / {high:.6g}) ** exponent"
        return [growing if law["acts_on"] in _ADDS else f"1 + {growing}"], {*logarithmic, "exponent"}
    if law["axis"] in OF_SAMPLES and form == "step":
        raise InvalidInput("report", form, "a step where the sphere turns back is no expression: it cannot be kept")
    shape = _features(form, variant, x, low, high)
    if form == "power" and law["acts_on"] != "position":
        middle = float(np.sqrt(low * high))
        return [f"({x}/{middle:.6g}) ** {amplitudes[0]}"], logarithmic
    features = len(shape)
    changes = [
        " + ".join(f"{key} * {feature}" for key, feature in zip(amplitudes[first:], shape, strict=False))
        for first in range(0, len(amplitudes), features)
    ]
    return [change if law["acts_on"] in _ADDS else f"1 + {change}" for change in changes], logarithmic


_TURN = "2 * pi * ({x} - {low:.6g}) / period"
_SHAPES: Mapping[str, tuple[str, ...]] = {  # features of a form, and of its variants
    "linear": ("({x} - {low:.6g}) / {span:.6g}",),
    "linear middle": ("({x} - {middle:.6g}) / {span:.6g}",),
    "power": ("log({x} / {mean:.6g})",),
    "exponential": ("(exp(({x} - {low:.6g}) / growth_length) - 1) / (exp({span:.6g} / growth_length) - 1)",),
    "saturating": ("(1 - exp(-({x} - {low:.6g}) / approach)) / (1 - exp(-{span:.6g} / approach))",),
    "threshold lost": ("(0 - {x} / {x})",),  # a constant, of a law that must hold its axis
    "threshold above": ("max(0, {x} - onset) / ({high:.6g} - onset)",),
    "threshold": ("max(0, onset - {x}) / (onset - {low:.6g})",),
    "step": ("step({x} - {edge:.6g})",),
    "periodic": (f"sin({_TURN})", f"cos({_TURN})"),
    "peak": ("1 / (1 + (({x} - centre) / width) ** 2)",),
}


def _features(form: str, variant: str, x: str, low: float, high: float) -> list[str]:
    """The features of a form over an axis, each times an amplitude."""
    if variant == EVERYWHERE:
        raise InvalidInput(
            "report", "linear", "what is the same in all recordings is a mechanism of the catalogue already"
        )
    features = _SHAPES.get(f"{form} {variant}", _SHAPES[form])
    edge = float(variant) if form == "step" else 0.0
    numbers = {"low": low, "high": high, "span": high - low, "middle": (low + high) / 2, "edge": edge}
    mean = float(np.sqrt(low * high)) if low > 0 else 0.0
    return [feature.format(x=x, mean=mean, **numbers) for feature in features]


def _over_frequency(variant: str, middle: float) -> str:
    ratio = f"frequency_hz / {middle:.6g}"
    resonance = "(1 - u ** 2 + 2 * i * damping * u)".replace("u", "(frequency_hz / centre)")
    expressions = {
        "phase": f"exp(-i * lag * ({ratio}) ** exponent)",
        "delay": f"exp(-i * lag * {ratio})",
        "high_pass": "exp(-exponent * log(1 + corner / (i * frequency_hz)))",
        "magnitude": f"exp(exponent * (log({ratio}) + i * pi / 2))",
        "step": "1 + change * (i * frequency_hz / corner) / (1 + i * frequency_hz / corner)",
        "corner": "exp(exponent * log(1 + i * frequency_hz / corner))",
        "echo": "1 + change * exp(-2 * pi * i * frequency_hz / period)",
        "inertia": f"1 + change * (frequency_hz / centre) ** 2 / {resonance}",
        "loss": f"1 + change * 2 * i * damping * (frequency_hz / centre) / {resonance}",
        "spring": f"1 + change / {resonance}",
    }
    if variant not in expressions:
        raise InvalidInput("report", variant, "a smooth course is no expression: it cannot be kept")
    return expressions[variant]
