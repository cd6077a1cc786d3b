"""Tables of what the service answered."""

import pytest

from underskin.cli.documents import write_rows


@pytest.mark.parametrize("row", [("c-1",), ("c-1", "palm", "more")])
def test_a_row_has_as_many_cells_as_there_are_headings(row: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="cells under 2 headings"):
        write_rows(("campaign", "skin"), [row])
