"""The document of a declared mechanism (`mechanism/1`, YAML), read with its lines; errors name line and reason; and the
lab's folder of them, named by a setting: the usable ones, and the errors of the others.

    schema: mechanism/1
    name: warm_skin
    description: The skin softens as it warms up.
    acts_on: modulus
    axes: [temperature_c]
    law: 1 - softening * (temperature_c - 23)
    parameters:
      softening: {unit: 1/°C, low: 0, high: 0.1, prior: {mean: 0.01, sd: 0.01}, limit: 0}
    source: Our own measurements.

`law` is a factor on gain, modulus, thickness or contact_radius, a complex factor on frequency_response, newtons
added to the force; for position it is a list of two, the millimetres added to x and y. Over displacement_mm (the
depth), force_n and time_s (since a recording began) it is a law of indentation curves, of each sample: a factor on
gain (of the cell) or modulus, newtons added to the reading, millimetres added to the travel (position). `prior` is
normal on the value, or on its natural logarithm where `scale` is log (then `mean` is a value and `sd` one of the
logarithm); without it the prior is uniform. Bounds and priors that no fit could use are rejected by field.
"""

import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, get_args

import numpy as np

from underskin.errors import FileError, InvalidInput, out_of_range
from underskin.mechanisms.base import Normal, Parameter, Prior, Uniform
from underskin.mechanisms.contract import check_numbers
from underskin.mechanisms.declared.mechanism import (
    CONSTANTS,
    FREQUENCY,
    DeclaredMechanism,
    DeclaredOfCurves,
    DeclaredOfLines,
    DeclaredOfRecordings,
    read,
    value_of,
)
from underskin.mechanisms.unlisted.vocabulary import OF_CURVES, OF_SAMPLES, ActsOn
from underskin.recordings import validation
from underskin.recordings.readers import json_file, plain_yaml
from underskin.recordings.readers.expressions import Expression
from underskin.recordings.readers.sandbox import call_apart
from underskin.recordings.validation import named, shown
from underskin.units import Array, Floats

NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
LONGEST_TEXT = 500
_PARAMETER_FIELDS = ("unit", "low", "high", "scale", "prior", "limit", "reason")
_MOST = 6
_LONGEST_UNIT = 12
_MAGNITUDES = (1e-30, 1e30)  # in SI the charge of an electron is 1.6e-19 C, and a mole has 6e23 particles
_LEAST_MASS = 0.01  # of a normal prior, within the bounds
_NARROWEST = 1e-6  # sd of a prior, or distance of the bounds, relative: a better known quantity is a constant


def require_fields(document: Mapping[Any, Any], allowed: tuple[str, ...], prefix: str) -> None:
    """Raise InvalidInput at the first field that is not allowed."""
    for name in document:
        if name not in allowed:
            raise InvalidInput(f"{prefix}{named(name)}", None, f"is no field; known: {', '.join(allowed)}")


def text(document: Mapping[str, Any], name: str, longest: int, field: str) -> str:
    """A printable text of up to `longest` characters, its white space reduced to single spaces."""
    value = document.get(name)
    words = " ".join(value.split()) if isinstance(value, str) else ""
    if not words or len(words) > longest:
        raise InvalidInput(field, shown(value), f"must be a text of 1 to {longest} characters")
    unprintable = [character for character in words if not character.isprintable()]
    if unprintable:
        raise InvalidInput(field, None, f"must be printable: the character U+{ord(unprintable[0]):04X} is not")
    return words


def parameters(value: Any, mechanism: str) -> dict[str, Parameter]:
    """The parameters of a document by name; raises InvalidInput that names the field."""
    if not isinstance(value, Mapping) or not 0 < len(value) <= _MOST:
        raise InvalidInput("parameters", None, f"must be 1 to {_MOST} parameters by name")
    return {name: _parameter(name, declaration, mechanism) for name, declaration in value.items()}


def _parameter(name: Any, declaration: Any, mechanism: str) -> Parameter:
    field = f"parameters.{named(name)}"
    if not isinstance(name, str) or not NAME.fullmatch(name) or not isinstance(declaration, Mapping):
        raise InvalidInput(field, None, "must be a name with unit, low and high")
    require_fields(declaration, _PARAMETER_FIELDS, f"{field}.")
    unit = text({"unit": "-", **declaration}, "unit", _LONGEST_UNIT, f"{field}.unit")
    scale = declaration.get("scale", "linear")
    if scale not in ("linear", "log"):
        raise InvalidInput(f"{field}.scale", shown(scale), "must be linear or log")
    low, high = (_number(declaration, key, field) for key in ("low", "high"))
    if not low < high or (scale == "log" and low <= 0):
        raise InvalidInput(f"{field}.high", high, f"must be above low, {low:g}, and both above 0 on a log scale")
    if high - low < _NARROWEST * max(abs(low), abs(high)):
        raise InvalidInput(f"{field}.high", high, f"must be above low, {low:g}, by more than {_NARROWEST:g} of it")
    limit = None if declaration.get("limit") is None else _number(declaration, "limit", field)
    prior = _prior(declaration.get("prior"), scale, field)
    default = {"reason": f"declared by the lab for {mechanism}"}
    reason = text({**default, **declaration}, "reason", LONGEST_TEXT, f"{field}.reason")
    parameter = Parameter(name, unit, low, high, prior, scale, limit, reason)
    if isinstance(prior, Normal):
        _require_within(declaration["prior"], prior, parameter, field)
    return parameter


def _prior(value: Any, scale: str, field: str) -> Prior:
    if value is None:
        return Uniform()
    if not isinstance(value, Mapping) or set(value) != {"mean", "sd"}:
        raise InvalidInput(f"{field}.prior", None, "must be {mean: …, sd: …}, or be left out")
    mean, sd = (_number(value, key, f"{field}.prior") for key in ("mean", "sd"))
    if sd <= 0 or (scale == "log" and mean <= 0):
        raise InvalidInput(f"{field}.prior.sd", sd, "must be above 0, and on a log scale the mean as well")
    return Normal(float(np.log(mean)) if scale == "log" else mean, sd)


def _require_within(stated: Mapping[str, Any], prior: Normal, parameter: Parameter, field: str) -> None:
    """Check that a normal prior has its mass within the bounds: its density is normalised there."""
    if not parameter.low <= stated["mean"] <= parameter.high:
        raise InvalidInput(
            f"{field}.prior.mean", stated["mean"], f"must lie within {parameter.low:g} to {parameter.high:g}"
        )
    low, high = parameter.bounds
    mass = prior.below(high) - prior.below(low)
    if mass < _LEAST_MASS:
        allowed = f"must leave {_LEAST_MASS:.0%} of the prior within low to high; leave the prior out for a uniform one"
        raise InvalidInput(f"{field}.prior.sd", prior.sd, f"{allowed} (it leaves {mass:.1g})")
    if prior.sd < _NARROWEST * (high - low):
        allowed = f"must be above {_NARROWEST:g} of the range from low to high: write what is known so well as a number"
        raise InvalidInput(f"{field}.prior.sd", prior.sd, allowed)


def _number(document: Mapping[str, Any], name: str, field: str) -> float:
    path = f"{field}.{name}"
    value = document.get(name)
    number = validation.number(path, value if isinstance(value, int | float) else None)
    least, largest = _MAGNITUDES
    if number != 0 and not least <= abs(number) <= largest:
        raise out_of_range(path, number, f"must be 0, or {least:g} to {largest:g} in magnitude")
    return number


SCHEMA = "mechanism/1"
LARGEST_BYTES = 100_000
_READ_YAML = "underskin.recordings.readers.plain_yaml:document"
_FIELDS = ("schema", "name", "description", "acts_on", "axes", "law", "parameters", "source")
_AXIS = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_AXIS_VALUES = (0.0, 0.01, 0.3, 1.0, 10.0)  # of an axis, at which a law is checked
_FAR_VALUES = np.concatenate([[0.0], np.geomspace(1e-3, 1e9, 61), -np.geomspace(1e-3, 1e9, 61)])  # up to load cycles
_NEUTRAL = 1e-6
_ADDED = ("force", "position")  # quantities that a law adds to; the others are factors
# Least change of a law that each parameter can make: a thousandth of what data resolve; an AFM resolves 1e-12 N.
_NOTICED_FACTOR, _NOTICED_ADDED = 1e-9, 1e-15
_AXIS_SHIFT = 5  # of indices from one axis to the next
_QUANTILES = (0.01, 0.25, 0.5, 0.75, 0.99)  # of priors, for that test


def parse(data: bytes, file: str, *, in_sandbox: bool = False) -> DeclaredMechanism:
    """The mechanism of a document; raises FileError that names the file, the line and the reason.

    `in_sandbox`: parse YAML in a process of its own, under the limits for reading a file.
    """
    if len(data) > LARGEST_BYTES:
        raise FileError(file, "", f"a mechanism may have up to {LARGEST_BYTES} bytes")
    try:
        document, lines = _read(data, in_sandbox=in_sandbox)
    except FileError as error:
        raise FileError(file, error.place, error.reason, code=error.code) from None
    try:
        return from_dict(document)
    except InvalidInput as refusal:
        value = "" if refusal.value is None else f" = {shown(refusal.value)!r:.60}"
        line = _line(lines, refusal.field)
        raise FileError(
            file, "" if line is None else f"line {line}", f"{refusal.field}{value}: {refusal.allowed}"
        ) from None


def _read(data: bytes, *, in_sandbox: bool) -> tuple[Any, Mapping[str, int]]:
    """The content of a file and the lines of its fields: YAML, or JSON, which has no lines."""
    if data.lstrip()[:1] == b"{":
        try:
            return json_file.document(data, ""), {}
        except FileError:
            pass  # YAML has braces too
    with tempfile.TemporaryFile() as stream:
        stream.write(data)
        stream.seek(0)
        content = call_apart(_READ_YAML, stream, "", what="a mechanism") if in_sandbox else plain_yaml.document(stream)
    return content["document"], content["lines"]


def _line(lines: Mapping[str, int], field: str) -> int | None:
    """The line of a field in the document, or of the nearest field above it."""
    if not lines:
        return None
    field_path = field.split()[0]
    while field_path and field_path not in lines:
        field_path = field_path.rpartition(".")[0]
    return lines.get(field_path, 1)


def from_dict(document: Any) -> DeclaredMechanism:
    """The mechanism of a document; raises InvalidInput that names the field."""
    if not isinstance(document, Mapping) or document.get("schema") != SCHEMA:
        raise InvalidInput("schema", None, f"must be {SCHEMA}")
    require_fields(document, _FIELDS, "")
    name = document.get("name")
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise InvalidInput("name", shown(name), "must be lower case letters, digits and _")
    acts_on: Any = document.get("acts_on")
    if acts_on not in get_args(ActsOn):
        raise InvalidInput("acts_on", shown(acts_on), f"must be one of {', '.join(get_args(ActsOn))}")
    axes = _axes(document.get("axes"), acts_on)
    of_curves = set(axes) <= set(OF_SAMPLES)
    declared = parameters(document.get("parameters"), name)
    laws = _laws(document.get("law"), {*axes, *declared}, 2 if acts_on == "position" and not of_curves else 1)
    _used(laws, axes, declared)
    kind: type[DeclaredMechanism] = DeclaredOfLines if acts_on == "frequency_response" else DeclaredOfRecordings
    if of_curves:
        kind = DeclaredOfCurves
        _defined(laws[0], axes, declared)
    _neutral(laws, acts_on, axes, declared)
    _noticed(laws, acts_on, axes, declared)
    description, source = (text(document, field, LONGEST_TEXT, field) for field in ("description", "source"))
    return kind(name, description, acts_on, axes, laws, tuple(declared.values()), source)


def _laws(value: Any, names: set[str], count: int) -> tuple[Expression, ...]:
    texts = list(value) if isinstance(value, list) else [value]
    if len(texts) != count:
        raise InvalidInput("law", None, "must be one expression, of a position of FRFs a list of two: x and y")
    return tuple(read(text, "law", names) for text in texts)


def _axes(value: Any, acts_on: str) -> tuple[str, ...]:
    is_valid = (
        isinstance(value, list) and value and all(isinstance(name, str) and _AXIS.fullmatch(name) for name in value)
    )
    if not is_valid:
        raise InvalidInput(
            "axes", shown(value), "must be a list of fields, of axes such as order, or of columns of conditions"
        )
    sampled = [name for name in value if name in OF_SAMPLES]
    if sampled and len(sampled) < len(value):
        raise InvalidInput(
            "axes", shown(value), f"{sampled[0]} is of the samples of curves: none of recordings beside it"
        )
    if sampled and acts_on not in OF_CURVES:
        raise InvalidInput("acts_on", acts_on, f"must be one of {', '.join(OF_CURVES)} for a law of curves")
    if acts_on == "position" and "force_n" in value:
        raise InvalidInput("axes", "force_n", "of a position is a stage that gives: see instrument_compliance")
    if FREQUENCY in value and acts_on != "frequency_response":
        raise InvalidInput("axes", FREQUENCY, "is an axis of acts_on frequency_response only")
    return tuple(value)


def _defined(law: Expression, axes: tuple[str, ...], parameters: Mapping[str, Parameter]) -> None:
    """Check that a law of curves is real and finite over its range, from 0 on, with typical parameters."""
    values = _evaluated(
        law, axes, {name: parameter.from_fit(parameter.quantile(0.5)) for name, parameter in parameters.items()}
    )
    if np.iscomplexobj(values):
        raise InvalidInput("law", law.text, "must be real for a law of curves: without i")
    wrong = ~np.isfinite(values[:-1])  # beyond, an exponential may be too large for a number
    if wrong.any():
        position = _AXIS_VALUES[int(np.argmax(wrong))]
        raise InvalidInput("law", law.text, f"is no number where {axes[0]} is {position:g}: max(0, …) may help")


def _neutral(
    laws: tuple[Expression, ...], acts_on: str, axes: tuple[str, ...], parameters: Mapping[str, Parameter]
) -> None:
    """Check that a law changes nothing where each parameter that has a limit is at it."""
    if all(parameter.limit is None for parameter in parameters.values()):
        return
    values = {
        name: parameter.from_fit(parameter.quantile(0.5)) if parameter.limit is None else parameter.limit
        for name, parameter in parameters.items()
    }
    nothing = 0.0 if acts_on in _ADDED else 1.0
    for law in laws:
        results = _evaluated(law, axes, values)
        finite = results[np.isfinite(results)]
        if len(finite) and np.abs(finite - nothing).max() > _NEUTRAL:
            requirement = f"must be {nothing:g}, which changes nothing, where each parameter is at its limit"
            raise InvalidInput(
                "law", law.text, f"{requirement}; it is {finite[np.abs(finite - nothing).argmax()]:.3g} there"
            )


def _noticed(
    laws: tuple[Expression, ...], acts_on: str, axes: tuple[str, ...], parameters: Mapping[str, Parameter]
) -> None:
    """Check that each parameter changes a law somewhere within its bounds; one that does not is unidentifiable."""
    least = _NOTICED_ADDED if acts_on in _ADDED else _NOTICED_FACTOR
    for name in parameters:
        changes = (_change(law, name, axes, parameters) for law in laws if name in law.names)
        if max(changes, default=0.0) < least:
            allowed = f"must change the law by more than {least:g} between its bounds, for axes up to 1e9"
            raise InvalidInput(f"parameters.{name}", None, allowed)


def _change(law: Expression, name: str, axes: tuple[str, ...], parameters: Mapping[str, Parameter]) -> float:
    """The largest change of a law by one parameter, relative where it is large, with the others at some quantile.

    Axes take values near and far, and between the values of parameters, which may be edges.
    """
    samples = {
        other: [parameter.from_fit(parameter.quantile(probability)) for probability in _QUANTILES]
        for other, parameter in parameters.items()
    }
    values = np.array(list(samples.values()))
    positions = np.concatenate([_FAR_VALUES, values.ravel(), (values[:, 1:] + values[:, :-1]).ravel() / 2])
    # Axes differ, since a law may depend on their ratio
    arguments = np.array([np.roll(positions, _AXIS_SHIFT * number) for number in range(len(axes))])
    largest = 0.0
    for number in range(len(_QUANTILES)):
        others = {other: quantiles[number] for other, quantiles in samples.items()}
        results = np.array([_evaluated(law, axes, {**others, name: value}, arguments) for value in samples[name]])
        with np.errstate(all="ignore"):
            change = np.abs(results[1:] - results[:-1]) / np.maximum(np.abs(results[1:]), 1.0)
        largest = max(largest, float(np.max(change, initial=0.0, where=np.isfinite(change))))
    return largest


def _evaluated(
    law: Expression,
    axes: tuple[str, ...],
    values: Mapping[str, float],
    positions: Sequence[float] | Floats = _AXIS_VALUES,
) -> Array:
    """The law where all axes have these values (values,), or each axis its own (axes, values)."""
    numbers = {name: np.float64(value) for name, value in values.items()}  # which may be divided by 0
    columns = np.broadcast_to(positions, (len(axes), np.shape(positions)[-1]))
    with np.errstate(all="ignore"):
        result = np.asarray(value_of(law, {**numbers, **dict(zip(axes, columns, strict=True))}))
    return np.asarray(result + np.zeros(columns.shape[1]))


def _used(laws: tuple[Expression, ...], axes: tuple[str, ...], parameters: Mapping[str, Parameter]) -> None:
    names = {name for law in laws for name in law.names} - set(CONSTANTS)
    for name in (*axes, *parameters):
        if name not in names:
            field = "axes" if name in axes else f"parameters.{name}"
            raise InvalidInput(field, name, "is not in the law")


FOLDER = "UNDERSKIN_MECHANISMS"  # the setting


@dataclass(frozen=True)
class LabFolder:
    """Usable mechanisms, each with its file and the beginning of its SHA-256, and the errors of unusable files."""

    mechanisms: tuple[tuple[DeclaredMechanism, str], ...]
    refused: tuple[FileError, ...]


def in_folder() -> LabFolder:
    """The contents of the folder, by file name; empty where the setting is not set."""
    usable: list[tuple[DeclaredMechanism, str]] = []
    refused = []
    for file in _files():
        try:
            content = _content(file)
            usable.append((checked(content, _printable(file)), f"{file.name} {sha256(content).hexdigest()[:12]}"))
        except FileError as error:
            refused.append(error)
    return LabFolder(tuple(usable), tuple(refused))


def checked(content: bytes, file: str, *, in_sandbox: bool = False) -> DeclaredMechanism:
    """The mechanism of a document (see `parse`), whose law gives finite numbers; raises FileError."""
    mechanism = parse(content, file, in_sandbox=in_sandbox)
    try:
        check_numbers(mechanism)
    except InvalidInput as error:
        raise FileError(file, "law", f"{error.field}: {error.allowed}") from None
    return mechanism


def digest() -> str:
    """SHA-256 of the folder's files and their names; empty where there are none."""
    total, count = sha256(), 0
    for file in _files():
        try:
            content = _content(file)
        except FileError as error:
            content = error.reason.encode()
        total.update(os.fsencode(file.name) + b"\0" + sha256(content).digest())
        count += 1
    return total.hexdigest() if count else ""


def _files() -> Iterator[Path]:
    """The YAML files of the folder, by name."""
    path = os.environ.get(FOLDER)
    if path:
        yield from sorted(Path(path).glob("*.yaml"))


def _content(file: Path) -> bytes:
    """At most one byte more than a document may have; raises FileError where the file cannot be read."""
    if _printable(file) != str(file):
        raise FileError(_printable(file), "", "its name must be UTF-8")
    if not file.is_file():  # a pipe would be waited for
        raise FileError(str(file), "", "is no file")
    try:
        with file.open("rb") as stream:
            return stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise FileError(str(file), "", f"cannot be read: {error.strerror}") from None


def _printable(file: Path) -> str:
    return os.fsencode(file).decode("utf-8", "replace")
