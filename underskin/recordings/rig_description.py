"""The rig description (`rig/1`): what a lab's instrument files do not say, written once by the user as YAML or JSON.

    schema: rig/1
    kind: indentation
    skin: {thickness_mm: 8.0, poisson_ratio: 0.5}
    recording: {indenter_radius_mm: 2.5, id: {property: Well}}
    channels:
      displacement_mm: {channel: Z_Position(mm), sign: -1}
      force_n: {channel: Corrected_Force(N), sign: -1}

`skin` and `recording` hold campaign fields that are the same for all files; `{property: ...}` takes one from what the
file, or the block, says about itself. `channels` says for each campaign field which channel holds it, `curves` how
several curves in one file are told apart, `estimator` how FRFs are estimated from time series (H1, H2 or Hv).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import yaml

from underskin.errors import FileError, InvalidInput, Mention, Requirement, conflicting, not_one_of, required, too_few
from underskin.recordings import validation as field
from underskin.recordings.campaign import COLUMNS, KINDS
from underskin.recordings.channel_mapping import ChannelMapping, Property, SignalMapping
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.frf.estimators import Estimator, checked_estimator
from underskin.recordings.readers import json_file, text
from underskin.recordings.shown_values import named, shown
from underskin.recordings.validation import mapping

SCHEMA = "rig/1"
LARGEST_BYTES = 1_000_000
BLOCK_NAME = "block"  # a property that every part of a file has: a TDMS group, a MATLAB structure
WHOLE_CURVES = ("file", "groups")  # what a curve may be, but for what a channel tells apart
COMPLEX_FRF = "frf_pc_per_n"  # a channel of complex numbers, both parts of the FRF


@dataclass(frozen=True)
class CurveChannel:
    """A channel that tells the curves of a file apart: each value of `channel` is one, or each new rise of `segments`,
    which counts the segments of a curve (approach 0, hold 1, way back 2)."""

    channel: field.Name | None = None
    segments: field.Name | None = None


@dataclass(frozen=True)
class RigDescription:
    """A rig: the kind of its recordings, fields common to them, which channel is what, and what a curve is in a file:
    `"file"`, `"groups"`, the channel that tells curves apart, or None (each part is one). `document` is as given."""

    kind: str
    skin: Mapping[str, Any]
    recording: Mapping[str, Any | Property]
    channels: Mapping[str, ChannelMapping]
    units_checked: bool
    document: Mapping[str, Any]
    curves: str | CurveChannel | None = None
    estimator: Estimator | None = None


def parse(data: bytes, file: str) -> RigDescription:
    """The rig description in a YAML or JSON file.

    Raises FileError where the text is neither, InvalidInput where a field cannot be used.
    """
    if len(data) > LARGEST_BYTES:
        raise FileError(file, "", f"a rig description may have up to {LARGEST_BYTES} bytes")
    if data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{":
        return from_dict(json_file.document(data, file))
    try:
        return from_dict(yaml.load(text.decode(data, file), Loader=_PlainLoader))  # noqa: S506 (a SafeLoader)
    except yaml.MarkedYAMLError as error:
        place = f"line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FileError(file, place, f"not YAML: {error.problem}") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise FileError(file, "", f"not YAML: {error}") from None


def from_dict(document: Any) -> RigDescription:
    """The rig description of a document; raises InvalidInput that names the field."""
    fields_known = ("schema", "name", "kind", "skin", "recording", "channels", "curves", "estimator", "units_checked")
    document = field.of_schema("rig description", document, SCHEMA, fields_known)
    kind = document.get("kind", "frf")
    if not isinstance(kind, str) or kind not in KINDS:
        raise not_one_of("kind", shown(kind), KINDS)
    field.name("name", document.get("name", SCHEMA), False)
    known = {entry.name for entry in fields(KINDS[kind])} - {"kind", "estimator"}
    recording = mapping("recording", document.get("recording", {}))
    channels = _channels(kind, document.get("channels"))
    return RigDescription(
        kind=kind,
        skin=_known("skin", mapping("skin", document.get("skin")), {entry.name for entry in fields(SkinDescription)}),
        recording={
            name: field.build(Property, f"recording.{name}", value, False) if isinstance(value, Mapping) else value
            for name, value in _known("recording", recording, known).items()
        },
        channels=channels,
        units_checked=field.flag("units_checked", document.get("units_checked", False), False),
        document=document,
        curves=_curves(document.get("curves")),
        estimator=_estimator(document.get("estimator"), channels),
    )


def channel_fields(kind: str) -> set[str]:
    """The fields of a kind that channels may hold; `time_s` of an frf stands for its sample rate."""
    columns = {entry.name for entry in fields(KINDS[kind])} & set(COLUMNS)
    return columns | {COMPLEX_FRF, "time_s"} if kind == "frf" else columns


def _curves(document: Any) -> str | CurveChannel | None:
    if document is None or document in WHOLE_CURVES:
        return document
    if not isinstance(document, Mapping):
        raise not_one_of("curves", shown(document), (*WHOLE_CURVES, "{channel: NAME}", "{segments: NAME}"))
    curves = field.build(CurveChannel, "curves", document, False)
    if (curves.channel is None) == (curves.segments is None):
        raise conflicting("curves", shown(list(document)), "must name either a channel or segments")
    return curves


def _estimator(value: Any, channels: Mapping[str, ChannelMapping]) -> Estimator | None:
    if value is None:
        return None
    if "charge_pc" not in channels:
        raise conflicting("estimator", shown(value), Requirement("is for time series: ", Mention("charge_pc")))
    return checked_estimator("estimator", shown(value))


def _channels(kind: str, document: Any) -> dict[str, ChannelMapping]:
    given = _known("channels", mapping("channels", document), channel_fields(kind))
    channels = {name: field.build(ChannelMapping, f"channels.{name}", value, False) for name, value in given.items()}
    for name, entry in channels.items():
        _require_whole(f"channels.{name}", entry)
        if entry.deflection is not None:
            _require_whole(f"channels.{name}.deflection", entry.deflection)
        _require_of_its_field(name, entry, channels)
    if not channels:
        raise too_few("channels", "none", "must name at least one channel")
    return channels


def _require_whole(place: str, signal: SignalMapping) -> None:
    """Refuses half of what belongs together."""
    if (signal.sensitivity is None) != (signal.sensitivity_unit is None):
        raise conflicting(f"{place}.sensitivity", signal.sensitivity, "needs a sensitivity_unit, and it one")
    if signal.labelled is not None and signal.unit is None:
        raise required(f"{place}.unit", "required where labelled says that the label is wrong")


def _require_of_its_field(name: str, entry: ChannelMapping, channels: Mapping[str, ChannelMapping]) -> None:
    """Refuses on one field what is for another."""
    stiffness, spring = entry.stiffness_n_per_mm, entry.spring_constant_n_per_m
    if stiffness is not None and (name != "displacement_mm" or "force_n" not in channels):
        raise conflicting(f"channels.{name}.stiffness_n_per_mm", stiffness, _is_for("displacement_mm"))
    if entry.deflection is not None and name != "displacement_mm":
        raise conflicting(f"channels.{name}.deflection", entry.deflection.channel, _is_for("displacement_mm"))
    if entry.deflection is not None and stiffness is not None:
        both = "must not stand beside a deflection, which is subtracted already"
        raise conflicting(f"channels.{name}.stiffness_n_per_mm", stiffness, both)
    if spring is not None and name != "force_n":
        value = spring if isinstance(spring, float) else spring.property
        raise conflicting(f"channels.{name}.spring_constant_n_per_m", value, _is_for("force_n"))


def _is_for(name: str) -> Requirement:
    return Requirement("is for ", Mention(name))


def _known(prefix: str, document: Mapping[str, Any], known: set[str]) -> Mapping[str, Any]:
    for name in document:
        if name not in known:
            raise not_one_of(f"{prefix}.{named(name)}", shown(document[name]), sorted(known))
    return document


class _PlainLoader(yaml.SafeLoader):
    """Safe YAML without references, dates and keys that come twice; 1e-3 is a number, as in JSON."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Refuses references: a few lines of them can stand for any amount of data."""
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "references (*name) are not allowed", mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Refuses a key that comes twice: the last one would be taken."""
        mapping = super().construct_mapping(node, deep=deep)
        if len(mapping) == len(node.value):
            return mapping
        seen = set()
        for entry, _ in node.value:
            key = self.construct_object(entry, deep=True)
            if key in seen:
                problem = f"the key {key!r} (column {entry.start_mark.column + 1}) must be given once in its mapping"
                raise yaml.constructor.ConstructorError(None, None, problem, entry.start_mark)
            seen.add(key)
        return mapping


_FLOAT = "tag:yaml.org,2002:float"
_PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in ("tag:yaml.org,2002:timestamp", _FLOAT)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_PlainLoader.add_implicit_resolver(
    _FLOAT, re.compile(r"^[-+]?(\d+[.]\d*|[.]\d+|\d+(?=[eE]))([eE][-+]?\d+)?$"), list("-+.0123456789")
)
