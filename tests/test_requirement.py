"""A requirement is a text, and knows the fields that it mentions."""

import orjson
import pytest

from underskin import InvalidInput
from underskin.errors import UNITS_CHECKED, Mention, Requirement
from underskin.units import checked


def upper(mention: Mention) -> str:
    return mention.field.upper()


def test_mentions_worded_apart_rest_sentence() -> None:
    """Mentions are worded apart from the rest of the sentence."""
    requirement = Requirement("must have 3 rows, as many as ", Mention("preload_n"), "; preload_n is a name")
    assert requirement == "must have 3 rows, as many as preload_n; preload_n is a name"
    assert requirement.worded(upper) == "must have 3 rows, as many as PRELOAD_N; preload_n is a name"
    assert orjson.loads(orjson.dumps({"allowed": requirement})) == {"allowed": str(requirement)}


def test_requirements_joined_mentions() -> None:
    """Requirements are joined with their mentions."""
    inner = Requirement("say a sign for ", Mention("force_n"))
    assert Requirement(Mention("time_s"), ": ", inner).worded(upper) == "TIME_S: say a sign for FORCE_N"


def test_unlikely_known_without_reading_sentence() -> None:
    """What is unlikely is known without reading the sentence."""
    with pytest.raises(InvalidInput) as refused:
        checked("thickness_mm", 2500.0)
    assert isinstance(refused.value.allowed, Requirement)
    assert UNITS_CHECKED in refused.value.allowed.parts
    assert "(or set units_checked to true)" in refused.value.allowed
