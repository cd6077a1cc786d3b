"""YAML of user documents: no references, dates or repeated keys; 1e-3 is a number, as in JSON.

`document` is for `sandbox.call_apart`, since a few kilobytes of YAML can take a parser long.
"""

import math
import re
from collections.abc import Iterator
from typing import Any, BinaryIO

import yaml

from underskin.errors import FileError
from underskin.recordings.readers import text

_MOST_NESTED = 100  # LibYAML's composer has no limit but the stack
_LONGEST_INTEGER = 1 << 63
_FLOAT = "tag:yaml.org,2002:float"
_HALF = re.compile(r"\\[uU](?:0000)?([dD][89a-fA-F][0-9a-fA-F]{2})")
_ESCAPE = 10  # characters of the longest escape
_KEY = re.compile(r"\s*([A-Za-z_]\w*)\s*:")
_Base: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


class _PlainLoader(_Base):  # type: ignore[misc]
    """A safe loader that rejects repeated keys."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Reject a repeated key, of which the last value would be used."""
        mapping = super().construct_mapping(node, deep=deep)
        if len(mapping) == len(node.value):
            return mapping
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                problem = f"the key {key!r} (column {key_node.start_mark.column + 1}) must be given once in its mapping"
                raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
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
    """`document`: the content of an open YAML file as JSON types; `lines`: the line of each field by its path
    (`parameters.loss.low`). Raises FileError that names the line."""
    written = text.decode(stream.read(), "")
    try:
        _require_plain(written)
        loader = _PlainLoader(written)
        try:
            tree = loader.get_single_node()
            lines = dict(_lines(tree, ""))
            content = None if tree is None else _as_json(loader.construct_document(tree), "", lines)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        raise _not_yaml(error, written) from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise FileError("", "", f"not YAML: {error}") from None
    except (LookupError, AttributeError, TypeError, ArithmeticError):  # a tag, such as !!bool, of what is none
        raise FileError("", "", "not YAML: a value is not of the type that its tag states") from None
    return {"document": content, "lines": lines}


def _require_plain(written: str) -> None:
    """Reject references, which can expand to any amount of data, and deep nesting."""
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


def _not_yaml(error: yaml.MarkedYAMLError, written: str) -> FileError:
    """The error at a mark; with the field where it is half of a surrogate pair, which LibYAML rejects."""
    mark = error.problem_mark
    if mark is None:
        return FileError("", "", f"not YAML: {error.problem}")
    lines, place = written.split("\n"), f"line {mark.line + 1}"
    half = _HALF.search(lines[min(mark.line, len(lines) - 1)], max(0, mark.column - _ESCAPE))
    if half is None:
        return FileError("", place, f"not YAML: {error.problem}")
    keys = (_KEY.match(line) for line in lines[mark.line :: -1])
    return _no_text(next((key[1] for key in keys if key), "a key"), int(half[1], 16), place)


def _no_text(field: str, character: int, place: str) -> FileError:
    return FileError("", place, f"{field}: the character U+{character:04X}, half of a surrogate pair, is no text")


def _lines(node: Any, path: str) -> Iterator[tuple[str, int]]:
    """The line of each key of a mapping, and of those within it."""
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        field_path = _below(path, str(key.value)) if isinstance(key, yaml.ScalarNode) else path
        yield field_path.encode("utf-8", "replace").decode(), key.start_mark.line + 1
        yield from _lines(value, field_path)


def _as_json(value: Any, path: str, lines: dict[str, int]) -> Any:
    """A value as JSON types; others as text, which no field accepts."""
    if isinstance(value, dict):
        return {
            _as_text(name, path, lines): _as_json(item, _below(path, str(name)), lines) for name, item in value.items()
        }
    if isinstance(value, list):
        return [_as_json(item, path, lines) for item in value]
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return value if abs(value) < _LONGEST_INTEGER else str(value)
    if isinstance(value, float) and math.isfinite(value):
        return value
    return _as_text(value, path, lines)


def _below(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _as_text(value: Any, path: str, lines: dict[str, int]) -> str:
    """Raises FileError that names line, field and character, where a text has half of a surrogate pair."""
    written = str(value)
    try:
        written.encode()
    except UnicodeEncodeError as error:
        field = path.encode("utf-8", "replace").decode() or "a key"
        place = f"line {lines[field]}" if field in lines else ""
        raise _no_text(field, ord(written[error.start]), place) from None
    return written
