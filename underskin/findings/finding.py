"""A finding: something suspicious in data, or a limit of an answer, as a reason with arguments."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from underskin.findings import english
from underskin.findings.codes import FindingCode, Reason


@dataclass(frozen=True)
class Finding:
    """A reason, its subject, and the values of its sentence.

    `recording` is an id, empty for the whole campaign; `field` is the name in the user's document; `index` is the row
    of a column, from 0. The sentences of `english` define the names of the `arguments`.
    """

    reason: Reason
    recording: str = ""
    field: str = ""
    arguments: Mapping[str, Any] = dataclasses.field(default_factory=dict, hash=False)
    index: int | None = None

    @property
    def code(self) -> FindingCode:
        """The kind of finding, as users filter by it."""
        return self.reason.code

    @property
    def statement(self) -> str:
        """The finding in words, without the recording."""
        return english.statement(self.reason, self.arguments)

    def in_columns(self) -> dict[str, Any]:
        """The finding as answers in columns hold it, for JSON."""
        return {"code": str(self.code), "field": self.field, "index": self.index, "statement": self.statement}

    def in_report(self) -> dict[str, str]:
        """The finding as a diagnosis report holds it, for JSON."""
        return {"code": str(self.code), "recording": self.recording, "field": self.field, "statement": self.statement}

    @property
    def sentence(self) -> str:
        """The finding in words, preceded by the recording where it is about one."""
        return f"recording {self.recording}: {self.statement}" if self.recording else self.statement
