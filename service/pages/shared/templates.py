"""The templates of the pages."""

from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

_FOLDER = Path(__file__).parents[1] / "templates"


@cache
def environment() -> Environment:
    """All templates; every value that they show is escaped."""
    return Environment(
        loader=FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )


def macro(template: str, name: str, *values: Any) -> Markup:
    """What a macro of a template makes of values."""
    made: Markup = getattr(_module(template), name)(*values)
    return made


@cache
def _module(template: str) -> Any:
    return environment().get_template(template).module
