"""YAML as documents of a user's have it: no references, dates or keys that come twice; 1e-3 is a number, as in JSON.

`document` is for `sandbox.call_apart`: a few kilobytes of YAML can take a parser long.
"""

import math
import re
from typing import Any, BinaryIO

import yaml

from underskin.errors import FileError
from underskin.recordings.readers import text

_MOST_NESTED = 100  # LibYAML's composer has no limit but the stack
_LONGEST_INTEGER = 1 << 63
_FLOAT = "tag:yaml.org,2002:float"
_Base: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


class _PlainLoader(_Base):  # type: ignore[misc]
    """A safe loader that refuses keys that come twice."""

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


_PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in ("tag:yaml.org,2002:timestamp", _FLOAT)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_PlainLoader.add_implicit_resolver(
    _FLOAT, re.compile(r"^[-+]?(\d+[.]\d*|[.]\d+|\d+(?=[eE]))([eE][-+]?\d+)?$"), list("-+.0123456789")
)


def document(stream: BinaryIO) -> dict[str, Any]:
    """`document`: what an open YAML file holds, of what JSON has; raises FileError that names the line."""
    written = text.decode(stream.read(), "")
    try:
        _require_plain(written)
        return {"document": _as_json(yaml.load(written, Loader=_PlainLoader))}  # noqa: S506 (a SafeLoader)
    except yaml.MarkedYAMLError as error:
        place = f"line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FileError("", place, f"not YAML: {error.problem}") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise FileError("", "", f"not YAML: {error}") from None


def _require_plain(written: str) -> None:
    """Refuses references, of which a few lines can stand for any amount of data, and what is nested too deeply."""
    depth = 0
    for event in yaml.parse(written, Loader=_Base):
        if isinstance(event, yaml.AliasEvent):
            raise _refused(event, "references (*name) are not allowed")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _MOST_NESTED:
            raise _refused(event, f"lists and mappings are nested more than {_MOST_NESTED} deep")


def _refused(event: yaml.Event, problem: str) -> FileError:
    place = f"line {event.start_mark.line + 1}" if event.start_mark else ""
    return FileError("", place, f"not YAML: {problem}")


def _as_json(value: Any) -> Any:
    """What YAML has beyond JSON, as text: nothing that a field takes."""
    if isinstance(value, dict):
        return {_as_text(name): _as_json(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_as_json(entry) for entry in value]
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return value if abs(value) < _LONGEST_INTEGER else str(value)
    if isinstance(value, float) and math.isfinite(value):
        return value
    return _as_text(value)


def _as_text(value: Any) -> str:
    return str(value).encode("utf-8", "replace").decode()
