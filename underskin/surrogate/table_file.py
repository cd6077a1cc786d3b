"""A table that is read from its file and verified: the common part of the σ, influence and contact tables."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from underskin.errors import TableError
from underskin.surrogate.hdf5_format import read_table
from underskin.units import Floats


class Table(ABC):
    """A verified table: `path`, `sha256` (which names it) and the file's `attributes`."""

    schema: ClassVar[str]

    def __init__(self, path: Path) -> None:
        """Read and verify the table; raises TableError with the reason."""
        file = read_table(path, self.schema)
        self.path = path
        self.sha256 = file.sha256
        self.attributes = file.attributes
        try:
            self._take(file.data)
        except KeyError as error:
            raise TableError(f"table {path} lacks the dataset {error}") from error

    @abstractmethod
    def _take(self, data: Mapping[str, Floats]) -> None:
        """Store the datasets that the table needs, by "group/name"."""
