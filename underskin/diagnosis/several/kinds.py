"""What recordings of each kind tell of several campaigns or skins, and where kinds contradict each other."""

from collections.abc import Iterable
from typing import Any

from underskin.diagnosis.reporting.report import Reported


def of_kinds(reports: Iterable[tuple[str, Reported]]) -> dict[str, Any]:
    """`by_kind` and `contradictions`, these led by the name of the campaign or skin that the report is of; empty where
    none has several kinds."""
    told = [(name, own.document) for name, own in reports if "by_kind" in own.document]
    if not told:
        return {}
    contradictions = [
        {**entry, "statement": f"{name}: {entry['statement']}"}
        for name, document in told
        for entry in document["contradictions"]
    ]
    return {
        "by_kind": [entry for _, document in told for entry in document["by_kind"]],
        "contradictions": contradictions,
    }
