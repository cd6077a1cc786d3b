"""Sentences of findings and fits as pages show them."""

import re

from underskin.units import readable_unit

_OF_RIG = "; the sign -1 turns a channel round"  # of a rig description: on pages a button does, or a list of signs
_FIELDS = {"N": "force_n", "mm": "displacement_mm"}
_SMALL = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?(?:e-\d+)?) (N|mm)\b")


def without_rig(finding: str) -> str:
    """A finding without how a rig description would put it right."""
    return finding.replace(_OF_RIG, "")


def in_readable_units(sentence: str) -> str:
    """A sentence with each force and length in the unit in which it reads well, as figures have it."""
    return _SMALL.sub(_readable, sentence)


def _readable(found: re.Match[str]) -> str:
    value = float(found[1])
    unit, count = readable_unit(_FIELDS[found[2]], abs(value))
    return f"{count * value:.4g} {unit}" if count != 1 else found[0]
