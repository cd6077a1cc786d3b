"""Why a diagnosis cannot be adopted, in words of a page: no name of a field."""

from underskin.prediction.adopted_model import NOT_ADOPTED


def test_no_reason_names_a_field() -> None:
    assert not [reason for reason in NOT_ADOPTED.values() if "_" in reason]
