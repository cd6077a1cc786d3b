"""Limits on the reading of one file; each is a setting."""

import math
import os
from dataclasses import dataclass
from typing import Self

from underskin.errors import out_of_range, wrong_type

MEMORY_MB = "UNDERSKIN_READING_MEMORY_MB"
SECONDS = "UNDERSKIN_READING_SECONDS"
EXPANSION = "UNDERSKIN_READING_EXPANSION"
_SHORT_BYTES = 16_000_000  # that the contents of the smallest file may have
_ALLOWED = {MEMORY_MB: (100.0, 1e6), SECONDS: (1.0, 86_400.0), EXPANSION: (1.0, 1e4)}


@dataclass(frozen=True)
class ParsingLimits:
    """`memory_bytes` beyond the interpreter's own, `seconds` of processor time; the contents may be `expansion` times
    as long as the file plus 16 MB."""

    memory_bytes: int = 1_000_000_000
    seconds: float = 60.0
    expansion: float = 16.0

    @classmethod
    def from_environment(cls) -> Self:
        """The limits by the settings; raises InvalidInput that names the setting."""
        memory_mb, seconds, expansion = (
            _setting(name, default)
            for name, default in (
                (MEMORY_MB, cls.memory_bytes / 1e6),
                (SECONDS, cls.seconds),
                (EXPANSION, cls.expansion),
            )
        )
        return cls(int(memory_mb * 1e6), seconds, expansion)

    def content_bytes(self, file_bytes: int) -> int:
        """The largest size of the contents of a file of this size."""
        return min(self.memory_bytes, _SHORT_BYTES + int(self.expansion * file_bytes))


def _setting(name: str, default: float) -> float:
    written = os.environ.get(name, "")
    if not written:
        return default
    low, high = _ALLOWED[name]
    try:
        value = float(written)
    except ValueError:
        raise wrong_type(name, written) from None
    if not (math.isfinite(value) and low <= value <= high):
        raise out_of_range(name, written, f"must be {low:g} to {high:g}")
    return value
