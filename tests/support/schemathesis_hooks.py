"""Has Schemathesis draw its inputs without leaning towards those that are accepted, on which Hypothesis would spend
nine tenths of a soak. Named by SCHEMATHESIS_HOOKS.
"""

import hypothesis


def _ignore(_observation: float, *, label: str = "") -> None:
    """In the place of `hypothesis.target`."""


hypothesis.target = _ignore  # type: ignore[assignment]
