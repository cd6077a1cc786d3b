"""The document of a declared mechanism (`mechanism/1`, YAML): read with its lines, refused by line and reason.

    schema: mechanism/1
    name: warm_skin
    description: The skin softens as it warms up.
    acts_on: modulus
    axes: [temperature_c]
    law: 1 - softening * (temperature_c - 23)
    parameters:
      softening: {unit: 1/°C, low: 0, high: 0.1, prior: {mean: 0.01, sd: 0.01}, limit: 0}
    source: Our own measurements.

`law` is a factor on gain, modulus, thickness or contact_radius, a complex factor on frequency_response, newtons added
to the force; for position it is a list of two, the millimetres added to x and y. Over displacement_mm (the depth),
force_n and time_s (since a recording began) it is a law of indentation curves, of each sample: a factor on gain (of
the cell) or modulus, newtons added to the force that is read, millimetres added to the travel (position). `prior` is
normal on the value, or on its natural logarithm where `scale` is log (then `mean` is a value and `sd` one of the
logarithm), or left out: uniform.
"""

import os
import re
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, get_args

import numpy as np
import yaml

from underskin.errors import FileError, InvalidInput
from underskin.mechanisms.declared.expressions import Expression, read, together
from underskin.mechanisms.declared.mechanism import FREQUENCY, DeclaredMechanism, DeclaredOfLines, DeclaredOfRecordings
from underskin.mechanisms.declared.of_curves import DeclaredOfCurves
from underskin.mechanisms.parameter import Normal, Parameter, Prior, Uniform
from underskin.mechanisms.unnamed.vocabulary import OF_CURVES, OF_SAMPLES, ActsOn
from underskin.units import Array

SCHEMA = "mechanism/1"
FOLDER = "UNDERSKIN_MECHANISMS"  # the setting
LARGEST_BYTES = 100_000
_FIELDS = ("schema", "name", "description", "acts_on", "axes", "law", "parameters", "source")
_OF_PARAMETER = ("unit", "low", "high", "scale", "prior", "limit", "reason")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
_AXIS = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_MOST_PARAMETERS = 6
_LONGEST_TEXT = 500
_PLACES = (0.0, 0.01, 0.3, 1.0, 10.0)  # of an axis, where a law is looked at
_NEUTRAL = 1e-6


def parse(data: bytes, file: str) -> DeclaredMechanism:
    """The mechanism of a document; raises FileError that names the file, the line and the reason."""
    if len(data) > LARGEST_BYTES:
        raise FileError(file, "", f"a mechanism may have up to {LARGEST_BYTES} bytes")
    try:
        text = data.decode("utf-8")
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, Loader=yaml.SafeLoader)):
            raise FileError(file, "", "references (*name) are not allowed")
        tree = yaml.compose(text, Loader=yaml.SafeLoader)
        document = yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        place = f"line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FileError(file, place, f"not YAML: {error.problem}") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise FileError(file, "", f"not YAML: {error}") from None
    try:
        return from_dict(document)
    except InvalidInput as refusal:
        value = "" if refusal.value is None else f" = {refusal.value!r:.60}"
        place = f"line {_line(tree, refusal.field)}"
        raise FileError(file, place, f"{refusal.field}{value}: {refusal.allowed}") from None


def _line(tree: Any, field: str) -> int:
    """The line on which a field of the document stands, or else the nearest one above it."""
    node, line = tree, 1
    for key in re.split(r"[.,\s]", field):
        if not isinstance(node, yaml.MappingNode):
            break
        found = [(name, value) for name, value in node.value if name.value == key]
        if not found:
            break
        line, node = found[0][0].start_mark.line + 1, found[0][1]
    return line


def from_dict(document: Any) -> DeclaredMechanism:
    """The mechanism of a document; raises InvalidInput that names the field."""
    if not isinstance(document, Mapping) or document.get("schema") != SCHEMA:
        raise InvalidInput("schema", None, f"must be {SCHEMA}")
    _only(document, _FIELDS, "")
    name = document.get("name")
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidInput("name", name, "must be lower case letters, digits and _")
    acts_on: Any = document.get("acts_on")
    if acts_on not in get_args(ActsOn):
        raise InvalidInput("acts_on", acts_on, f"must be one of {', '.join(get_args(ActsOn))}")
    axes = _axes(document.get("axes"), acts_on)
    of_curves = set(axes) <= set(OF_SAMPLES)
    parameters = _parameters(document.get("parameters"), name)
    known = {*axes, *parameters}
    texts = document.get("law")
    texts = list(texts) if isinstance(texts, list) else [texts]
    if len(texts) != (2 if acts_on == "position" and not of_curves else 1):
        raise InvalidInput("law", None, "must be one expression, of a position of FRFs a list of two: x and y")
    laws = tuple(read(text, "law", known) for text in texts)
    _used(laws, axes, parameters)
    kind: type[DeclaredMechanism] = DeclaredOfLines if acts_on == "frequency_response" else DeclaredOfRecordings
    if of_curves:
        kind = DeclaredOfCurves
        _defined(laws[0], axes, parameters)
    _neutral(laws, acts_on, axes, parameters)
    renamed = tuple(parameters.values())
    return kind(
        name,
        _text(document, "description"),
        acts_on,
        axes,
        laws,
        renamed,
        _text(document, "source"),
    )


def in_folder(folder: Path | None = None) -> list[tuple[DeclaredMechanism, str]]:
    """The mechanisms of the lab's folder, by file name, each with its file and digest.

    Without a folder that of the setting; none where that is not set. Raises FileError for the first that cannot be
    used: a diagnosis without it would be another diagnosis.
    """
    where = folder or (Path(os.environ[FOLDER]) if os.environ.get(FOLDER) else None)
    if where is None or not where.is_dir():
        return []
    found = []
    for file in sorted(where.glob("*.yaml")):
        data = file.read_bytes()
        found.append((parse(data, str(file)), f"{file.name} {sha256(data).hexdigest()[:12]}"))
    return found


def digest() -> str:
    """SHA-256 of the files of the lab's folder, with their names; empty where there are none."""
    where = Path(os.environ[FOLDER]) if os.environ.get(FOLDER) else None
    files = [] if where is None else sorted(where.glob("*.yaml"))
    whole = sha256()
    for file in files:
        whole.update(file.name.encode() + b"\0" + sha256(file.read_bytes()).digest())
    return whole.hexdigest() if files else ""


def _only(document: Mapping[Any, Any], known: tuple[str, ...], prefix: str) -> None:
    for name in document:
        if name not in known:
            raise InvalidInput(f"{prefix}{name}", None, f"is no field; known: {', '.join(known)}")


def _text(document: Mapping[str, Any], name: str) -> str:
    value = document.get(name)
    if not isinstance(value, str) or not value.strip() or len(value) > _LONGEST_TEXT:
        raise InvalidInput(name, value, f"must be a text of 1 to {_LONGEST_TEXT} characters")
    return " ".join(value.split())


def _axes(value: Any, acts_on: str) -> tuple[str, ...]:
    good = isinstance(value, list) and value and all(isinstance(name, str) and _AXIS.fullmatch(name) for name in value)
    if not good:
        raise InvalidInput(
            "axes", value, "must be a list of fields, of axes such as order, or of columns of conditions"
        )
    sampled = [name for name in value if name in OF_SAMPLES]
    if sampled and len(sampled) < len(value):
        raise InvalidInput("axes", value, f"{sampled[0]} is of the samples of curves: none of recordings beside it")
    if sampled and acts_on not in OF_CURVES:
        raise InvalidInput("acts_on", acts_on, f"must be one of {', '.join(OF_CURVES)} for a law of curves")
    if acts_on == "position" and "force_n" in value:
        raise InvalidInput("axes", "force_n", "of a position is a stage that gives: see instrument_compliance")
    if FREQUENCY in value and acts_on != "frequency_response":
        raise InvalidInput("axes", FREQUENCY, "is an axis of acts_on frequency_response only")
    return tuple(value)


def _parameters(value: Any, mechanism: str) -> dict[str, Parameter]:
    if not isinstance(value, Mapping) or not 0 < len(value) <= _MOST_PARAMETERS:
        raise InvalidInput("parameters", None, f"must be 1 to {_MOST_PARAMETERS} parameters by name")
    return {name: _parameter(name, entry, mechanism) for name, entry in value.items()}


def _parameter(name: Any, entry: Any, mechanism: str) -> Parameter:
    field = f"parameters.{name}"
    if not isinstance(name, str) or not _NAME.fullmatch(name) or not isinstance(entry, Mapping):
        raise InvalidInput(field, None, "must be a name with unit, low and high")
    _only(entry, _OF_PARAMETER, f"{field}.")
    unit = entry.get("unit", "-")
    if not isinstance(unit, str) or not 0 < len(unit) <= 12:
        raise InvalidInput(f"{field}.unit", unit, "must be a short text, - for none")
    scale = entry.get("scale", "linear")
    if scale not in ("linear", "log"):
        raise InvalidInput(f"{field}.scale", scale, "must be linear or log")
    low, high = (_number(entry, key, field) for key in ("low", "high"))
    if not low < high or (scale == "log" and low <= 0):
        raise InvalidInput(f"{field}.high", high, f"must be above low, {low:g}, and both above 0 on a log scale")
    limit = None if entry.get("limit") is None else _number(entry, "limit", field)
    prior = _prior(entry.get("prior"), scale, field)
    if isinstance(prior, Normal) and not low <= entry["prior"]["mean"] <= high:
        raise InvalidInput(f"{field}.prior.mean", entry["prior"]["mean"], f"must lie within {low:g} to {high:g}")
    reason = entry.get("reason", f"declared by the lab for {mechanism}")
    return Parameter(name, unit, low, high, prior, scale, limit, str(reason))


def _prior(value: Any, scale: str, field: str) -> Prior:
    if value is None:
        return Uniform()
    if not isinstance(value, Mapping) or set(value) != {"mean", "sd"}:
        raise InvalidInput(f"{field}.prior", None, "must be {mean: …, sd: …}, or be left out")
    mean, sd = (_number(value, key, f"{field}.prior") for key in ("mean", "sd"))
    if sd <= 0 or (scale == "log" and mean <= 0):
        raise InvalidInput(f"{field}.prior.sd", sd, "must be above 0, and on a log scale the mean as well")
    return Normal(float(np.log(mean)) if scale == "log" else mean, sd)


def _number(document: Mapping[str, Any], name: str, field: str) -> float:
    value = document.get(name)
    if type(value) not in (int, float) or not np.isfinite(value):  # type: ignore[arg-type]
        raise InvalidInput(f"{field}.{name}", value, "must be a finite number")
    return float(value)  # type: ignore[arg-type]


def _defined(law: Expression, axes: tuple[str, ...], parameters: Mapping[str, Parameter]) -> None:
    """Whether a law of curves is a real number wherever a curve goes, from 0 on, with usual parameters."""
    found = _evaluated(law, axes, {name: entry.from_fit(entry.quantile(0.5)) for name, entry in parameters.items()})
    if np.iscomplexobj(found):
        raise InvalidInput("law", law.text, "must be real for a law of curves: without i")
    wrong = ~np.isfinite(found[:-1])  # beyond, an exponential may be too large for a number
    if wrong.any():
        at = _PLACES[int(np.argmax(wrong))]
        raise InvalidInput("law", law.text, f"is no number where {axes[0]} is {at:g}: max(0, …) may help")


def _neutral(
    laws: tuple[Expression, ...], acts_on: str, axes: tuple[str, ...], parameters: Mapping[str, Parameter]
) -> None:
    """Whether a law changes nothing where each parameter that has a limit is at it."""
    if all(entry.limit is None for entry in parameters.values()):
        return
    values = {
        name: entry.from_fit(entry.quantile(0.5)) if entry.limit is None else entry.limit
        for name, entry in parameters.items()
    }
    nothing = 0.0 if acts_on in ("force", "position") else 1.0
    for law in laws:
        found = _evaluated(law, axes, values)
        known = found[np.isfinite(found)]
        if len(known) and np.abs(known - nothing).max() > _NEUTRAL:
            said = f"must be {nothing:g}, which changes nothing, where each parameter is at its limit"
            raise InvalidInput("law", law.text, f"{said}; it is {known[np.abs(known - nothing).argmax()]:.3g} there")


def _evaluated(law: Expression, axes: tuple[str, ...], values: Mapping[str, float]) -> Array:
    """At a few places of all axes together (places,)."""
    with np.errstate(all="ignore"):
        found = np.asarray(law({**values, **dict.fromkeys(axes, np.array(_PLACES))}))
    return np.asarray(found + np.zeros(len(_PLACES)))


def _used(laws: tuple[Expression, ...], axes: tuple[str, ...], parameters: Mapping[str, Parameter]) -> None:
    names = together(laws)
    for name in (*axes, *parameters):
        if name not in names:
            field = "axes" if name in axes else f"parameters.{name}"
            raise InvalidInput(field, name, "is not in the law")
