"""The result of a diagnosis in the few words of a list: verdict, probability, alternatives. Also the adopted model
in page headers: what it adds, since when, and d33 by it next to the paper's; and what is wrong with an array."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import Connection

from service.problems import Refusal
from service.schemas.diagnoses import ModelVersion
from service.store import AnyRow, Conflict, Database, diagnoses
from service.usecases import adopted_models, d33_cache
from underskin import InvalidInput
from underskin.diagnosis.data.names import EXPLAINED, in_words
from underskin.diagnosis.reporting.headline import first_and_rest
from underskin.diagnosis.reporting.numbers import is_known
from underskin.diagnosis.reporting.wording import not_quoted, number
from underskin.findings.formatting import in_percent
from underskin.surrogate.sigma_table import SigmaTable

_WORDS_OF_VERDICT = {
    "explained": "mismatch explained",
    "ambiguous": "mismatch with several explanations",
    "unexplained": "mismatch without explanation",
    "no_mismatch": "no mismatch found",
    "insufficient_data": "nothing can be concluded",
}
_BY_A_LAW = "mismatch by a law that nobody listed"
_MOST_NAMED = 6  # sensors


@dataclass(frozen=True)
class VerdictSummary:
    """The diagnosis, the words and the mood of its tag, and the text next to the tag."""

    id: str
    tag: str
    mood: Literal["good", "look", "quiet"]
    addition: str
    at: str  # when it ended, or was asked for
    name: str | None  # of one of several campaigns
    modulus: str | None = None  # of curves, under an answer that is settled
    outdated: bool = False  # not of its campaigns as they are now
    not_quoted: str | None = None  # why its d33 may not be quoted, where there is one that may not


def of_rows(connection: Connection, rows: Sequence[AnyRow], adopted: Sequence[str] = ()) -> dict[str, VerdictSummary]:
    """By the diagnosis' id; `adopted`: ids of those whose model is in force."""
    reports = diagnoses.reports_of(connection, [row.number for row in rows if row.state == "done"])
    return {row.id: _verdict(row, reports.get(row.number, {}), row.id in adopted) for row in rows}


def mechanisms_of(report: Mapping[str, Any]) -> list[str]:
    """Names of the mechanisms that a report states."""
    return [mechanism["name"] for mechanism in report["mechanisms"]]


def _verdict(row: AnyRow, report: Mapping[str, Any], adopted: bool) -> VerdictSummary:
    at = row.ended_at or row.asked_at
    outdated = diagnoses.outdated(row) is not None
    if not report:
        addition = "open it to see why and what to do" if row.state == "failed" else ""
        return VerdictSummary(row.id, f"diagnosis {row.state}", "quiet", addition, at, row.name, outdated=outdated)
    law = report["verdict"] == "unexplained" and report.get("unnamed")
    tag = _BY_A_LAW if law else _WORDS_OF_VERDICT[report["verdict"]]
    if report["verdict"] == "insufficient_data":
        return VerdictSummary(row.id, tag, "quiet", "", at, row.name, outdated=outdated)
    probability = report["probability"]
    if report["verdict"] in ("no_mismatch", "unexplained"):
        tag = f"{tag}, {in_percent(probability)}"
    sure = report["verdict"] == "no_mismatch" and probability >= EXPLAINED
    mood: Literal["good", "look"] = "good" if sure or adopted else "look"
    tag = f"{tag}, adopted" if adopted else tag
    d33 = report["d33"]
    unsettled = d33 is not None and "low" in d33 and not d33.get("quotable", True)
    not_quoted = _quoted(report) if unsettled else None
    return VerdictSummary(
        row.id, tag, mood, first_and_rest(report)[0], at, row.name, _modulus(report), outdated, not_quoted
    )


def _modulus(report: Mapping[str, Any]) -> str | None:
    """Young's modulus of curves under the answer, in words."""
    after = (report["fit"] or {}).get("after", {}).get("youngs_modulus")
    if after is None or report["verdict"] not in ("explained", "no_mismatch") or not is_known(after):
        return None
    value, low, high = (f"{after[name]:.3g}" for name in ("value", "low", "high"))
    return f"{value} {after['unit']} (95 %: {low} to {high})"


class AdoptedVersion(ModelVersion):
    """A model that was adopted; `quotable`: whether its report's d33 may be quoted, `quoted`: that d33, or in words
    where it lies and why it may not; `outdated`: why it serves no figures, None where it does."""

    mechanisms: str
    quotable: bool
    quoted: str
    outdated: str | None


def adopted_versions(connection: Connection, rows: Sequence[AnyRow]) -> list[AdoptedVersion]:
    """Of rows of models."""
    reports = diagnoses.reports_of(connection, [row.number for row in rows])
    return [
        AdoptedVersion(
            **adopted_models.version(row).model_dump(),
            mechanisms=in_words(mechanisms_of(reports[row.number])),
            quotable=reports[row.number]["d33"].get("quotable", True),
            quoted=_quoted(reports[row.number]),
            outdated=diagnoses.outdated(row),
        )
        for row in rows
    ]


def _quoted(report: Mapping[str, Any]) -> str:
    """The d33 of a report in words; if it may not be quoted, with the report's reason."""
    d33 = report["d33"]
    low, high = number(d33["low"], 3), number(d33["high"], 3)
    if d33.get("quotable", True):
        return f"{number(d33['value'], 3)} {d33['unit']} (95 %: {low} to {high})"
    return not_quoted(report) or f"it lies from {low} to {high} {d33['unit']}"


def answer_by_it(store: Database, table: SigmaTable, row: AnyRow) -> tuple[Mapping[str, Any] | None, str | None]:
    """d33 of a campaign by the model in force, or why there is none."""
    try:
        return d33_cache.by_model(store, table, row, "adopted"), None
    except (InvalidInput, Conflict, Refusal) as error:
        return None, str(error)


def change_percent(by_paper: float | None, by_model: float | None) -> float | None:
    """How far d33 by the adopted model lies above the paper's [%]."""
    return None if not by_paper or by_model is None else 100 * (by_model / by_paper - 1)


def attention(answer: Mapping[str, Any] | None, campaign: Any | None, dead: Sequence[str] = ()) -> list[str]:
    """Each problem in a few words, from an answer that is kept and its campaign, if any; `dead`: sensors that are named
    elsewhere."""
    sensors = [] if answer is None else [sensor for sensor in answer["sensors"] if sensor["sensor"] not in dead]
    marked = [f"{sensor['sensor'][:24]} {flag['reason']}" for sensor in sensors for flag in sensor["flags"]]
    problems = marked[:_MOST_NAMED]
    if len(marked) > _MOST_NAMED:
        problems.append(f"and {len(marked) - _MOST_NAMED} more of {len(sensors)} sensors")
    if campaign is not None and (refused := len(campaign.refused)):
        problems.append(f"{refused} recording{'s' if refused > 1 else ''} refused")
    return problems
