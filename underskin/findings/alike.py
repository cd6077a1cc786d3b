"""What is wrong with recordings, in words: alike with many, in one line instead of one each."""

from collections.abc import Iterable, Mapping
from typing import Any

_FEWEST = 3  # that are told together
_NAMED = 3


def told_together(problems: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Pairs of recordings and what is wrong with them; of three and more that have the same, one pair that names the
    first of them and says how many they are."""
    by_reason: dict[str, list[str]] = {}
    for recording, reason in problems:
        by_reason.setdefault(reason, []).append(recording)
    told = []
    for reason, recordings in by_reason.items():
        if len(recordings) < _FEWEST:
            told += [(recording, reason) for recording in recordings]
        else:
            more = f" and {len(recordings) - _NAMED} more" if len(recordings) > _NAMED else ""
            told.append((f"{', '.join(recordings[:_NAMED])}{more}", reason))
    return told


def recordings_called(names: str) -> str:
    """Names as `told_together` gives them, with the noun before them."""
    return f"recording{'s' if ', ' in names else ''} {names}"


def why_refused(error: Mapping[str, Any]) -> str:
    """An entry of the service's `errors`: the value where one was sent, and of a file only what is wrong."""
    if error["field"] == "file":
        return str(error["allowed"])
    value = "" if error["value"] is None else f" = {error['value']!r}"
    return f"{error['field']}{value}: {error['allowed']}"
