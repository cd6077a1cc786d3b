"""Numbers as people read them."""

import pytest

from underskin.findings.formatting import significant


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [(13600.0, 3, "13600"), (570.0, 2, "570"), (-13649.0, 3, "-13600"), (13.0, 4, "13"), (2.5e6, 2, "2.5e+06"),
     (99960.0, 3, "100000"), (1.5e-7, 2, "1.5e-07")],
)  # fmt: skip
def test_number_written_out_no_power_ten(value: float, digits: int, shown: str) -> None:
    """A number that can be written out has no power of ten."""
    assert significant(value, digits) == shown


def test_trailing_zeros_say_how_many_digits() -> None:
    """Trailing zeros say how many digits are known."""
    assert significant(13.0, 4, trailing_zeros=True) == "13.00"
    assert significant(1100.0, 3, trailing_zeros=True) == "1100"
