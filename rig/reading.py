"""Reads a description: JSON, or YAML in which dates stay text and 1e-3 is a number, as in JSON."""

import json
import re
from pathlib import Path
from typing import Any

import yaml


class _PlainLoader(yaml.SafeLoader):
    """Safe YAML without dates."""


_FLOAT = "tag:yaml.org,2002:float"
_PlainLoader.yaml_implicit_resolvers = {
    first: [resolver for resolver in resolvers if resolver[0] not in ("tag:yaml.org,2002:timestamp", _FLOAT)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_PlainLoader.add_implicit_resolver(
    _FLOAT, re.compile(r"^[-+]?(\d+[.]\d*|[.]\d+|\d+(?=[eE]))([eE][-+]?\d+)?$"), list("-+.0123456789")
)


def document(path: Path) -> Any:
    """The file's content; raises ValueError or yaml.YAMLError if it is neither."""
    text = path.read_text(encoding="utf-8")
    if text.lstrip().startswith("{"):
        return json.loads(text)
    return yaml.load(text, Loader=_PlainLoader)  # noqa: S506 (a SafeLoader)
