"""Documents of declared mechanisms that are refused."""

import pytest

from underskin.errors import FileError
from underskin.mechanisms.declared.document import parse


def refusal(text: str) -> FileError:
    """What reading a document raises."""
    with pytest.raises(FileError) as refused:
        parse(text.encode(), "lab.yaml")
    return refused.value
