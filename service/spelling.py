"""What is said of a name that a request does not have."""

from collections.abc import Collection
from difflib import get_close_matches

from underskin import InvalidInput


def unknown(name: str, value: str, known: Collection[str], noun: str) -> InvalidInput:
    """The error of a name that is none of those `known`; `noun`: what such a name is, such as a query parameter."""
    if not known:
        return InvalidInput(name, value, f"is not a {noun} of this request, which has none")
    alike = get_close_matches(name.lower(), known, n=1)
    guess = f"; did you mean {alike[0]}?" if alike else "."
    return InvalidInput(name, value, f"is not a {noun} of this request{guess} Known: {', '.join(known)}")
