"""What decides a result is in the digest; names of modules, places, docstrings and comments are not."""

import pytest

from underskin.source_digest import source_digest

SOURCE = '''"""A module."""

import numpy as np

from package import first

# a comment
FACTOR = 2.0


def doubled(x: float) -> float:
    """Twice x."""
    return FACTOR * first.of(np.sin(x))
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# a comment\n", ""),
        ('    """Twice x."""\n', ""),
        ("Twice x.", "Two times x."),
        ("A module.", "Another."),
        ("from package import first", "from package.wing import first"),
        ("from package import first", "from package.wing import second as first"),
        ("\n\n\ndef", "\n\ndef"),
    ],
)
def test_what_does_not_compute_does_not_count(old: str, new: str) -> None:
    assert old in SOURCE
    assert source_digest([SOURCE.replace(old, new)]) == source_digest([SOURCE])


def test_a_renamed_module_is_the_same() -> None:
    renamed = SOURCE.replace("import first", "import second").replace("first.of", "second.of")
    assert source_digest([renamed]) == source_digest([SOURCE])


@pytest.mark.parametrize(
    ("old", "new"), [("2.0", "2.1"), ("sin", "cos"), ("FACTOR *", "FACTOR /"), ("first.of", "np.of")]
)
def test_what_computes_counts(old: str, new: str) -> None:
    assert source_digest([SOURCE.replace(old, new)]) != source_digest([SOURCE])


def test_neither_order_nor_place_counts_but_each_module_does() -> None:
    assert source_digest(["A = 1", "B = 2"]) == source_digest(["B = 2", "A = 1"])
    assert source_digest(["A = 1", "A = 1"]) != source_digest(["A = 1"])
