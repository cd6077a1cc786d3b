"""Problems of recordings in words: equal problems of many recordings in one line."""

from collections.abc import Iterable, Mapping
from typing import Any

_FEWEST = 3  # recordings with one reason that are grouped
_NAMED = 3


def grouped_by_reason(problems: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Pairs of recording and reason; three or more recordings with one reason become one pair that names the first of
    them and their number."""
    by_reason: dict[str, list[str]] = {}
    for recording, reason in problems:
        by_reason.setdefault(reason, []).append(recording)
    grouped = []
    for reason, recordings in by_reason.items():
        if len(recordings) < _FEWEST:
            grouped += [(recording, reason) for recording in recordings]
        else:
            more = f" and {len(recordings) - _NAMED} more" if len(recordings) > _NAMED else ""
            grouped.append((f"{', '.join(recordings[:_NAMED])}{more}", reason))
    return grouped


def recordings_called(names: str) -> str:
    """Names from `grouped_by_reason`, preceded by the noun."""
    return f"recording{'s' if ', ' in names else ''} {names}"


def why_refused(error: Mapping[str, Any]) -> str:
    """An entry of the service's `errors` in words: with the value if one was sent; of a file only the reason."""
    if error["field"] == "file":
        return str(error["allowed"])
    value = "" if error["value"] is None else f" = {error['value']!r}"
    return f"{error['field']}{value}: {error['allowed']}"
