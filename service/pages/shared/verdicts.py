"""What a diagnosis came to, in the few words that a list has room for: what it says, how sure it is, what rivals it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import Connection

from service.store import AnyRow, diagnoses
from underskin.diagnosis.data.names import EXPLAINED, in_words
from underskin.findings.formatting import in_percent

_WORTH_NAMING = 0.02  # probability of a rival, as in a report
_MOST_RIVALS = 3
_SAYS = {
    "explained": "mismatch, explained",
    "ambiguous": "mismatch, several explanations",
    "unexplained": "mismatch, no explanation",
    "no_mismatch": "no mismatch found",
    "insufficient_data": "too little data",
}


@dataclass(frozen=True)
class VerdictSummary:
    """The diagnosis, the words of its tag, what they mean for the reader, and what stands beside the tag."""

    id: str
    tag: str
    mood: Literal["good", "look", "quiet"]
    beside: str
    at: str  # when it ended, or was asked for


def of_rows(connection: Connection, rows: Sequence[AnyRow], adopted: Sequence[str] = ()) -> dict[str, VerdictSummary]:
    """By the diagnosis' id; `adopted`: ids of those whose model is in force."""
    reports = diagnoses.reports_of(connection, [row.number for row in rows if row.state == "done"])
    return {row.id: _verdict(row, reports.get(row.number, {}), row.id in adopted) for row in rows}


def mechanisms_of(report: Mapping[str, Any]) -> list[str]:
    """Names of the mechanisms that a report states."""
    return [entry["name"] for entry in report["mechanisms"]]


def _verdict(row: AnyRow, report: Mapping[str, Any], adopted: bool) -> VerdictSummary:
    at = row.ended_at or row.asked_at
    if not report:
        return VerdictSummary(row.id, f"diagnosis {row.state}", "quiet", "", at)
    tag = _SAYS[report["verdict"]]
    if report["verdict"] == "insufficient_data":
        return VerdictSummary(row.id, tag, "quiet", "", at)
    probability = report["probability"]
    if report["verdict"] in ("no_mismatch", "unexplained"):
        tag = f"{tag}, {in_percent(probability)}"
    sure = report["verdict"] == "no_mismatch" and probability >= EXPLAINED
    mood: Literal["good", "look"] = "good" if sure or adopted else "look"
    return VerdictSummary(row.id, f"{tag}, adopted" if adopted else tag, mood, _beside(report), at)


def _beside(report: Mapping[str, Any]) -> str:
    """The explanations with their probabilities; of no mismatch, what is not ruled out."""
    verdict, probability = report["verdict"], report["probability"]
    leader = [f"{in_words(mechanisms_of(report))} {in_percent(probability)}"] if report["mechanisms"] else []
    rivals = [
        f"{in_words(entry['mechanisms'])} {in_percent(entry['probability'])}"
        for entry in report.get("alternatives", ())[:_MOST_RIVALS]
        if entry["probability"] > _WORTH_NAMING
    ]
    if probability >= EXPLAINED or verdict == "unexplained":
        return " ".join(leader)
    if verdict == "no_mismatch":
        return f"not ruled out: {', '.join(rivals)}" if rivals else ""
    return " or ".join([*leader, *rivals])
