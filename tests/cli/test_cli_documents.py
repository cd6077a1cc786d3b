"""Tables of what the service answered."""

import pytest

from underskin.cli.stored import write_rows


@pytest.mark.parametrize("row", [("c-1",), ("c-1", "palm", "more")])
def test_row_many_cells_headings(row: tuple[str, ...]) -> None:
    """A row has as many cells as there are headings."""
    with pytest.raises(ValueError, match="cells under 2 headings"):
        write_rows(("campaign", "skin"), [row])
