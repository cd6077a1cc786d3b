"""Recordings given as time series, as the lines that a diagnosis uses."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from underskin.diagnosis.screening.select_lines import Choice, choose_lines
from underskin.diagnosis.screening.time_series_units import contradiction_of
from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Floats, to_lab

_ALONE = 0.25  # of the recordings at most
_MANY = 0.1  # of the lines
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


@dataclass(frozen=True)
class Estimated:
    """The recordings as FRFs, and the findings on their time series.

    `doubtful`: the findings where the forces of many recordings contradict what is declared; then there are no
    entries. `uneven`: how uneven the noise of the lines is, by the recording's id.
    """

    entries: list[FrfRecording]
    findings: list[Finding]
    doubtful: Sequence[Finding] = ()
    uneven: Mapping[str, Floats] = field(default_factory=dict)


def as_lines(entries: Sequence[FrfRecording], *, units_checked: bool) -> Estimated:
    """The recordings as FRFs, without single ones whose force contradicts what is declared.

    With `units_checked` contradictions are findings and nothing is left out.
    """
    contradictions = [finding for entry in entries if (finding := contradiction_of(entry)) is not None]
    many = len(contradictions) > max(1.0, _ALONE * len(entries))
    if many and not units_checked:
        return Estimated([], [], doubtful=_together(contradictions, len(entries)))
    if many or units_checked:
        findings = _together(contradictions, len(entries))
    else:
        findings = [replace(finding, arguments={**finding.arguments, "left_out": True}) for finding in contradictions]
        off = {finding.recording for finding in contradictions}
        entries = [entry for entry in entries if entry.id not in off]
    usable, choices, uneven = [], {}, {}
    for entry in entries:
        if entry.sample_rate_hz is None:
            usable.append(entry)
            continue
        estimated, choice, own_findings = _estimated(entry)
        findings += own_findings
        if estimated is not None and choice is not None:
            usable.append(estimated)
            choices[entry.id] = choice
            if choice.uneven is not None:
                uneven[entry.id] = choice.uneven
    findings += [*_left_out(choices), *_once(choices), *_mains(choices)]
    return Estimated(usable, findings, uneven=uneven)


def as_given(entries: Sequence[FrfRecording], findings: Sequence[Finding]) -> list[Finding]:
    """The findings with the fields that a recording was given by: a time series has no frequencies of its own."""
    series = {entry.id for entry in entries if entry.sample_rate_hz is not None}
    if len(series) == len(entries):
        series.add("")
    return [
        replace(entry, field=_GIVEN_AS.get(entry.field, entry.field)) if entry.recording in series else entry
        for entry in findings
    ]


def _together(contradictions: list[Finding], recordings: int) -> list[Finding]:
    """One finding where it is the same of all recordings, else one of each."""
    kinds = {(entry.reason, entry.field, entry.arguments.get("given_in")) for entry in contradictions}
    if len(contradictions) == recordings > 1 and len(kinds) == 1:
        first = contradictions[0]
        return [replace(first, recording="", arguments={**first.arguments, "example": first.recording})]
    return contradictions


def _estimated(entry: FrfRecording) -> tuple[FrfRecording | None, Choice | None, list[Finding]]:
    """The recording with the usable lines of its time series, None where there are none; their choice; findings."""
    try:
        measured = lines_of(entry)
    except InvalidInput as refusal:
        return None, None, [Finding(Reason.SERIES_NOT_USABLE, entry.id, refusal.field, {"refusal": refusal})]
    findings = []
    if measured.defects:
        first, *others = measured.defects
        arguments = {**asdict(first), "more": len(others)}
        findings.append(Finding(Reason.DEFECTS_LEFT_OUT, entry.id, first.channel, arguments))
    choice = choose_lines(measured)
    chosen = choice.lines
    if not chosen:
        if choice.mains is None:
            unusable = Finding(Reason.INCOHERENT, entry.id, "charge_pc")
        else:
            unusable = Finding(Reason.MAINS_SPOIL_ALL, entry.id, "charge_pc", {"mains_hz": choice.mains.mains_hz})
        return None, None, [*findings, unusable]
    values = to_lab("frf_pc_per_n", measured.values[chosen].real), to_lab("frf_pc_per_n", measured.values[chosen].imag)
    estimated = replace(
        entry,
        frequency_hz=measured.frequency[chosen],
        frf_re_pc_per_n=values[0],
        frf_im_pc_per_n=values[1],
        coherence=None if measured.coherence is None else measured.coherence[chosen],
        sample_rate_hz=None,
        force_n=None,
        charge_pc=None,
    )
    return estimated, choice, findings


def _left_out(choices: Mapping[str, Choice]) -> list[Finding]:
    """How many lines are left out because the force has little power there, where they are many."""
    counts = {
        name: sum(getattr(choice, name) for choice in choices.values()) for name in ("measured", "faint", "beside")
    }
    if counts["faint"] <= _MANY * counts["measured"]:
        return []
    return [Finding(Reason.LINES_LEFT_OUT, "", "force_n", {**counts, "recordings": len(choices)})]


def _once(choices: Mapping[str, Choice]) -> list[Finding]:
    """Where the force passes through its band once."""
    names = [name for name, choice in choices.items() if choice.once]
    if not names:
        return []
    arguments = {"affected": len(names), "recordings": len(choices)}
    return [Finding(Reason.FORCE_ACTS_ONCE, names[0] if len(names) == 1 else "", "force_n", arguments)]


def _mains(choices: Mapping[str, Choice]) -> list[Finding]:
    """Where charge stands out at the mains' multiples and force does not, within the band or beside it."""
    pickups = {name: choice.mains for name, choice in choices.items() if choice.mains is not None}
    findings = []
    for mains in sorted({entry.mains_hz for entry in pickups.values()}):
        own = {name: entry.charge for name, entry in pickups.items() if entry.mains_hz == mains}
        arguments = {
            "affected": len(own),
            "recordings": len(choices),
            "mains_hz": mains,
            "charge_pc": float(to_lab("charge_pc", np.median(list(own.values())))),
        }
        recording = next(iter(own)) if len(own) == 1 else ""
        findings.append(Finding(Reason.MAINS_IN_CHARGE, recording, "charge_pc", arguments))
    return findings
