"""What decides a result is in the digest; names of modules, places, docstrings and comments are not."""

import pytest

from underskin.source_digest import source_digest

USER = '''"""A module."""

import numpy as np
from numpy import hypot as distance

from package import first, other
from package.other import scale

# a comment
FACTOR = 2.0


def doubled(x: float) -> float:
    """Twice x."""
    return FACTOR * first.of(np.sin(x)) - other.of(distance(scale(x), 1.0))
'''
FIRST = "def of(x):\n    return x + 1\n"
OTHER = "def of(x):\n    return x - 1\n\n\ndef scale(x):\n    return 3 * x\n"
PACKAGE = {"package.user": USER, "package.first": FIRST, "package.other": OTHER}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# a comment\n", ""),
        ('    """Twice x."""\n', ""),
        ("Twice x.", "Two times x."),
        ("A module.", "Another."),
        ("\n\n\ndef", "\n\ndef"),
        ("import numpy as np", "import numpy as numeric"),
    ],
)
def test_what_does_not_compute_does_not_count(old: str, new: str) -> None:
    assert old in USER
    changed = USER.replace(old, new).replace("np.sin", "numeric.sin" if "numeric" in new else "np.sin")
    assert source_digest({**PACKAGE, "package.user": changed}) == source_digest(PACKAGE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("2.0", "2.1"),
        ("np.sin", "np.cos"),
        ("FACTOR *", "FACTOR /"),
        ("import hypot as distance", "import arctan2 as distance"),
        ("from package import first, other", "from package import other as first, first as other"),
        ("first.of(np.sin(x)) - other", "other.of(np.sin(x)) - first"),
        ("import scale", "import of as scale"),
        ("x: float", "y: float"),
    ],
)
def test_what_computes_counts(old: str, new: str) -> None:
    assert old in USER
    assert source_digest({**PACKAGE, "package.user": USER.replace(old, new)}) != source_digest(PACKAGE)
