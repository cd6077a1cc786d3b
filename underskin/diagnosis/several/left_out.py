"""Sensors that a campaign's own diagnosis leaves out, as dead or weak: what is left out of one campaign is left out of
what is said of all, and a sensor that died between two of them comes first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.diagnosis.reporting.statements import listed
from underskin.diagnosis.several.dates import Dated
from underskin.diagnosis.several.sensors import SensorsOfCampaign
from underskin.findings.codes import FindingCode
from underskin.recordings.campaign import Campaign, FrfRecording


class Fault(StrEnum):
    """Why a sensor is left out, as a sentence says it of one or of several."""

    DEAD = "dead: no charge above noise"
    WEAK = "nearly dead: a small share of the others' charge"
    OTHER = "without a usable recording: see the findings"


Faults = Mapping[str, Fault | None]  # by recorded sensor, None of one that is used


@dataclass(frozen=True)
class _Run:
    """Campaigns in a row that record a sensor and leave it out: the first, the last one before and the first one after
    that use it."""

    fault: Fault
    first: int
    before: int | None
    after: int | None


def used_recordings(result: DiagnosisResult) -> frozenset[str]:
    """The recordings that a diagnosis used (ids)."""
    return (
        frozenset() if result.problem is None else frozenset(one.id for one in result.problem.lines.campaign.recordings)
    )


def faults(campaign: Campaign, result: DiagnosisResult) -> Faults:
    """Each sensor that was recorded with FRFs, and why none of these was used."""
    used = used_recordings(result)
    owner = {entry.id: entry.sensor for entry in campaign.recordings if isinstance(entry, FrfRecording)}
    usable = {sensor for name, sensor in owner.items() if name in used}
    codes: dict[str, set[FindingCode]] = {}
    for finding in result.findings:
        sensor = finding.arguments.get("sensor", owner.get(finding.recording))
        codes.setdefault(str(sensor), set()).add(finding.code)
    return {
        sensor: None if sensor in usable else _fault(codes.get(sensor, set()))
        for sensor in dict.fromkeys(owner.values())
    }


def _fault(codes: set[FindingCode]) -> Fault:
    if FindingCode.NO_RESPONSE in codes:
        return Fault.DEAD
    return Fault.WEAK if FindingCode.WEAK in codes else Fault.OTHER


def in_words(each: Sequence[Faults], sensors: Sequence[SensorsOfCampaign | None], dated: Dated) -> list[str]:
    """A clause on all sensors that share a fault and its dates, those that came between two campaigns first."""
    runs: dict[_Run, list[str]] = {}
    for sensor in dict.fromkeys(sensor for one in each for sensor in one):
        for run in _runs([one.get(sensor, _NOT_RECORDED) for one in each]):
            runs.setdefault(run, []).append(sensor)
    ordered = sorted(runs.items(), key=lambda entry: (entry[0].before is None, entry[0].first))
    return [_clause(run, own, sensors, dated) for run, own in ordered]


_NOT_RECORDED = "not recorded"


def _runs(states: Sequence[Fault | str | None]) -> list[_Run]:
    found: list[_Run] = []
    before: int | None = None
    current: _Run | None = None
    for number, state in enumerate(states):
        if state == _NOT_RECORDED:
            continue
        if isinstance(state, Fault):
            current = current or _Run(state, number, before, None)
            continue
        if current is not None:
            found.append(_Run(current.fault, current.first, current.before, number))
            current = None
        before = number
    return found if current is None else [*found, current]


def _clause(run: _Run, own: Sequence[str], sensors: Sequence[SensorsOfCampaign | None], dated: Dated) -> str:
    """ "sensor s06 is dead since 2026-09-21: no charge above noise, after 17.1 pC/N on 2026-05-12"."""
    one = len(own) == 1
    who = f"sensor {own[0]}" if one else f"sensors {listed(own)}"
    state, _, why = run.fault.partition(": ")
    begun = dated.called(run.first)
    if run.after is not None:
        again = f"answer{'s' if one else ''} again on {dated.called(run.after)}"
        were = "was" if one else "were"
        return f"{who} {were} {state} on {begun} ({why}) and {again}; left out of what is compared there"
    when = "in all campaigns" if run.before is None else f"since {begun}"
    earlier = (
        "" if run.before is None else f", after {_earlier(own, sensors[run.before])} on {dated.called(run.before)}"
    )
    return f"{who} {'is' if one else 'are'} {state} {when}: {why}{earlier}; left out of all that follows"


def _earlier(own: Sequence[str], before: SensorsOfCampaign | None) -> str:
    """d33 that the sensors had."""
    had = [] if before is None else [f"{before.d33[before.ids.index(one)]:.3g}" for one in own if one in before.ids]
    return f"{listed(had)} pC/N" if had else "a response"
