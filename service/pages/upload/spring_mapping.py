"""The part of a mapping form on springs: deflection, spring constant, and the definition of a curve in a file."""

from collections.abc import Mapping
from typing import Any

from underskin.errors import InvalidInput, wrong_type

DEFLECTION = "deflection"  # roles of a channel in the form besides a campaign's fields
SPRING = "spring_constant_n_per_m"
CURVES = {
    "": "each part of the file",
    "file": "the whole file",
    "groups": "each group of rows, apart by blank or comment lines",
    "channel": "the rows with one value in a channel:",
    "segments": "the rows until a channel of segments falls:",
}
_SIGNAL = ("channel", "unit", "labelled", "sign", "sensitivity", "sensitivity_unit")
_DIGITS = 12  # that the conversion between N/m and N/mm leaves


def shown_as(document: Mapping[str, Any], name: str) -> tuple[str, Mapping[str, Any]]:
    """What a channel is in the form, and how it is read; empty where it is not used."""
    for field, how in document.get("channels", {}).items():
        if how.get(DEFLECTION, {}).get("channel") == name:
            return DEFLECTION, how[DEFLECTION]
        if how.get("channel") == name:
            return (DEFLECTION if SPRING in how else field), how
    return "", {}


def spring_constant(document: Mapping[str, Any]) -> Any:
    """The constant [N/m] that the form shows: a number, `{property: NAME}`, or None."""
    channels = document.get("channels", {})
    stated = channels.get("force_n", {}).get(SPRING)
    stiffness = channels.get("displacement_mm", {}).get("stiffness_n_per_mm")
    if isinstance(stiffness, Mapping):
        return stiffness
    return stated if stiffness is None else _rounded(1e3 * stiffness)


def is_travel(document: Mapping[str, Any]) -> bool:
    """Whether the displacement is a stage's travel, from which a deflection is subtracted."""
    how = document.get("channels", {}).get("displacement_mm", {})
    return DEFLECTION in how or "stiffness_n_per_mm" in how


def with_spring(
    channels: dict[str, Any], form: Mapping[str, str], constant: Any, base: Mapping[str, Any]
) -> tuple[dict[str, Any], list[InvalidInput]]:
    """The channels with the deflection inserted, and errors; `constant` as in the form. A form that does not define
    the displacement leaves it as in `base`."""
    channels = {field: dict(how) for field, how in channels.items()}
    deflection = channels.pop(DEFLECTION, None)
    displacement = channels.get("displacement_mm")
    if "travel" not in form:
        for field, name in (("displacement_mm", DEFLECTION), ("force_n", SPRING)):
            before = base.get(field, {})
            if name in before and channels.get(field, {}).get("channel") == before.get("channel"):
                channels[field][name] = before[name]
        return channels, []
    if deflection is not None and constant is not None and "force_n" not in channels:
        channels["force_n"] = {**_signal(deflection), SPRING: constant}
    if displacement is None:
        return channels, []
    displacement.pop("stiffness_n_per_mm", None)
    if not form["travel"]:
        return channels, []
    if deflection is not None:
        displacement[DEFLECTION] = _signal(deflection)
    elif isinstance(constant, float):
        displacement["stiffness_n_per_mm"] = _rounded(1e-3 * constant)
    elif isinstance(constant, Mapping):
        displacement["stiffness_n_per_mm"] = constant
    else:
        must = "must be a number where the force is measured, or say which channel is the deflection"
        return channels, [wrong_type(SPRING, constant and str(constant), must)]
    return channels, []


def _signal(how: Mapping[str, Any]) -> dict[str, Any]:
    return {name: how[name] for name in _SIGNAL if name in how}


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def curves_of(form: Mapping[str, str], base: Any) -> Any:
    """What a curve is, as the form says; as in `base` where it does not."""
    typed = form.get("curves")
    if typed is None:
        return base
    return {typed: form.get("curves-by", "")} if typed in ("channel", "segments") else typed or None
