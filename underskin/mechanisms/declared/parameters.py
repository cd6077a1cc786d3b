"""The parameters of a declared mechanism: bounds and priors, refused by field where no fit could use them."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from underskin.errors import InvalidInput, out_of_range
from underskin.mechanisms.parameter import Normal, Parameter, Prior, Uniform
from underskin.recordings import validation
from underskin.recordings.shown_values import named, shown

NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
LONGEST_TEXT = 500
_FIELDS = ("unit", "low", "high", "scale", "prior", "limit", "reason")
_MOST = 6
_LONGEST_UNIT = 12
_MAGNITUDES = (1e-30, 1e30)  # in SI the charge of an electron is 1.6e-19 C, and a mole has 6e23 particles
_LEAST_MASS = 0.01  # of a normal prior, within the bounds
_NARROWEST = 1e-6  # sd of a prior, or distance of the bounds, relative: what is known better is a constant


def require_fields(document: Mapping[Any, Any], known: tuple[str, ...], prefix: str) -> None:
    """Raises InvalidInput at the first field that is not known."""
    for name in document:
        if name not in known:
            raise InvalidInput(f"{prefix}{named(name)}", None, f"is no field; known: {', '.join(known)}")


def text(document: Mapping[str, Any], name: str, longest: int, field: str) -> str:
    """A printable text of up to `longest` characters, its white space made single spaces."""
    value = document.get(name)
    words = " ".join(value.split()) if isinstance(value, str) else ""
    if not words or len(words) > longest:
        raise InvalidInput(field, shown(value), f"must be a text of 1 to {longest} characters")
    unprintable = [character for character in words if not character.isprintable()]
    if unprintable:
        raise InvalidInput(field, None, f"must be printable: the character U+{ord(unprintable[0]):04X} is not")
    return words


def parameters(value: Any, mechanism: str) -> dict[str, Parameter]:
    """Those of a document, by name; raises InvalidInput that names the field."""
    if not isinstance(value, Mapping) or not 0 < len(value) <= _MOST:
        raise InvalidInput("parameters", None, f"must be 1 to {_MOST} parameters by name")
    return {name: _parameter(name, entry, mechanism) for name, entry in value.items()}


def _parameter(name: Any, entry: Any, mechanism: str) -> Parameter:
    field = f"parameters.{named(name)}"
    if not isinstance(name, str) or not NAME.fullmatch(name) or not isinstance(entry, Mapping):
        raise InvalidInput(field, None, "must be a name with unit, low and high")
    require_fields(entry, _FIELDS, f"{field}.")
    unit = text({"unit": "-", **entry}, "unit", _LONGEST_UNIT, f"{field}.unit")
    scale = entry.get("scale", "linear")
    if scale not in ("linear", "log"):
        raise InvalidInput(f"{field}.scale", shown(scale), "must be linear or log")
    low, high = (_number(entry, key, field) for key in ("low", "high"))
    if not low < high or (scale == "log" and low <= 0):
        raise InvalidInput(f"{field}.high", high, f"must be above low, {low:g}, and both above 0 on a log scale")
    if high - low < _NARROWEST * max(abs(low), abs(high)):
        raise InvalidInput(f"{field}.high", high, f"must be above low, {low:g}, by more than {_NARROWEST:g} of it")
    limit = None if entry.get("limit") is None else _number(entry, "limit", field)
    prior = _prior(entry.get("prior"), scale, field)
    default = {"reason": f"declared by the lab for {mechanism}"}
    reason = text({**default, **entry}, "reason", LONGEST_TEXT, f"{field}.reason")
    made = Parameter(name, unit, low, high, prior, scale, limit, reason)
    if isinstance(prior, Normal):
        _require_within(entry["prior"], prior, made, field)
    return made


def _prior(value: Any, scale: str, field: str) -> Prior:
    if value is None:
        return Uniform()
    if not isinstance(value, Mapping) or set(value) != {"mean", "sd"}:
        raise InvalidInput(f"{field}.prior", None, "must be {mean: …, sd: …}, or be left out")
    mean, sd = (_number(value, key, f"{field}.prior") for key in ("mean", "sd"))
    if sd <= 0 or (scale == "log" and mean <= 0):
        raise InvalidInput(f"{field}.prior.sd", sd, "must be above 0, and on a log scale the mean as well")
    return Normal(float(np.log(mean)) if scale == "log" else mean, sd)


def _require_within(stated: Mapping[str, Any], prior: Normal, made: Parameter, field: str) -> None:
    """Whether a normal prior is one of values between the bounds: its density is normalised there."""
    if not made.low <= stated["mean"] <= made.high:
        raise InvalidInput(f"{field}.prior.mean", stated["mean"], f"must lie within {made.low:g} to {made.high:g}")
    low, high = made.bounds
    mass = prior.below(high) - prior.below(low)
    if mass < _LEAST_MASS:
        allowed = f"must leave {_LEAST_MASS:.0%} of the prior within low to high; leave the prior out for a uniform one"
        raise InvalidInput(f"{field}.prior.sd", prior.sd, f"{allowed} (it leaves {mass:.1g})")
    if prior.sd < _NARROWEST * (high - low):
        allowed = f"must be above {_NARROWEST:g} of the range from low to high: write what is known so well as a number"
        raise InvalidInput(f"{field}.prior.sd", prior.sd, allowed)


def _number(document: Mapping[str, Any], name: str, field: str) -> float:
    place = f"{field}.{name}"
    value = document.get(name)
    number = validation.number(place, value if isinstance(value, int | float) else None)
    least, largest = _MAGNITUDES
    if number != 0 and not least <= abs(number) <= largest:
        raise out_of_range(place, number, f"must be 0, or {least:g} to {largest:g} in magnitude")
    return number
