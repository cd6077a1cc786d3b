"""Signs and units of numbers in sentences: names and dates keep their hyphens."""

import pytest

from underskin.diagnosis.reporting.typeset import in_readable_units, with_minus, without_powers


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("by -0.43 (-0.5 to -1.2e-06)", "by −0.43 (−0.5 to −1.2e-06)"),
        ("s-1 on 2026-05-03, 2-3 N", "s-1 on 2026-05-03, 2-3 N"),
    ],
)
def test_a_negative_number_has_a_minus_sign(text: str, shown: str) -> None:
    assert with_minus(text) == shown


def test_small_forces_and_lengths_are_in_units_that_read_well() -> None:
    sentence = "a force of +1.5e-06 N (+1.2e-06 to +1.8e-06) at 0.005 N over 3 mm"
    assert without_powers(sentence) == "a force of +1.5 µN (+1.2 to +1.8) at 0.005 N over 3 mm"
    assert in_readable_units("0.005 N over 3 mm, -2e-05 mm") == "5 mN over 3 mm, −20 nm"
