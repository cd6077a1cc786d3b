"""Sentences of findings as pages show them."""

_OF_RIG = "; the sign -1 turns a channel round"  # of a rig description: on pages a button does, or a list of signs


def without_rig(finding: str) -> str:
    """A finding without how a rig description would put it right."""
    return finding.replace(_OF_RIG, "")
