"""Numbers on pages are compared as numbers."""

import pytest

from tests.support.shown import is_as_shown


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("1,0.75,ok", "1.0,0.7499999999999999,ok"),
        ('{"sigma": [0.97827…]}', '{"sigma":[0.97827364]}'),
        ("14.007…,ok", "14.0070000000001,ok"),
        ("14.008…", "14.0079999999999"),
        ("-0.… times it", "-0.31 times it"),
        ("rel …e-7", "rel 4.1e-7"),
        ("before 2…% off", "before 221.7 % off"),
        ("s01,-8.0,2017-05-03", "s01,-8.0,2017-05-03"),
        ("a  b\n 1 2", "a b 1 2"),
    ],
)
def test_what_is_the_same_agrees(shown: str, printed: str) -> None:
    assert is_as_shown(shown, printed)


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("0.75", "0.756"),
        ("14.007…", "14.0082"),
        ("14.007…", "-14.007"),
        ("16 recordings", "15 recordings"),
        ("s01,1", "s02,1"),
        ("0.75,ok", "0.75,out_of_domain"),
        ("7.3957", "7.3958"),
        (
            3 * "0.5 0.41274 0.16510 0.0019531 … 0.037511 7.4243 ok\n" + "1 s",  # a table is told apart at once
            3 * "0.5 0.41274 0.16510 0.0019531 8.1e-07 0.037511 7.4243 ok\n" + "1 t",
        ),
    ],
)
def test_what_differs_does_not(shown: str, printed: str) -> None:
    assert not is_as_shown(shown, printed)
