"""Contradictions between the force of a time series and what is declared: slips of units, and exchanged channels.

The mean of the force is the preload, unless an AC coupling removed it. Its oscillation is the dynamic force, about: the
peak for sines and blows, √2 times the standard deviation for sines and noise. Drift (a preload that relaxes) is not
oscillation: the straight line through each eighth of the record is removed.

Recordings given as time series, as the lines that a diagnosis uses.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import exchanged_channels, lines_of, oscillation_of
from underskin.recordings.frf.line_choice import Usable, noise_findings, usable_lines
from underskin.recordings.frf.spectra import Frf, mean_of
from underskin.units import Floats, to_lab

_SLIP, _WITHIN = 1000.0, 30.0


def contradiction_of(entry: FrfRecording) -> Finding | None:
    """What the force of a recording contradicts, if anything."""
    if entry.force_n is None or entry.charge_pc is None:
        return None
    mean = float(np.mean(entry.force_n))
    preload = mean_of(entry.force_n)
    if (exchanged := exchanged_channels(entry)) is not None:
        return exchanged
    oscillation = oscillation_of(entry.force_n) / entry.dynamic_force_n
    agrees = any(_near(one, 1.0) for one in oscillation)
    nearest = oscillation[int(np.argmin(np.abs(np.log(np.maximum(oscillation, 1e-300)))))] * entry.dynamic_force_n
    pressed = None if preload is None else abs(preload) / entry.preload_n
    for factor, own, other in ((_SLIP, "mN", "kN"), (1 / _SLIP, "kN", "mN")):
        off = any(_near(one, factor) for one in oscillation)
        dynamic_force = {"dynamic_force_n": entry.dynamic_force_n}
        if off and (not agrees if pressed is None else _near(pressed, factor)):
            arguments = {"oscillation_n": float(nearest), **dynamic_force, "too_large": factor > 1, "given_in": own}
            return Finding(Reason.SERIES_FORCE, entry.id, "force_n", arguments)
        if off and not agrees and pressed is not None and _near(pressed, 1.0):
            arguments = {**dynamic_force, "too_large": factor < 1, "given_in": other}
            return Finding(Reason.SERIES_DYNAMIC_FORCE, entry.id, "dynamic_force_n", arguments)
        if agrees and pressed is not None and _near(pressed, factor):
            arguments = {"preload_n": entry.preload_n, "mean_n": mean, "too_large": factor < 1, "given_in": other}
            return Finding(Reason.SERIES_PRELOAD, entry.id, "preload_n", arguments)
    return None


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN


_ALONE = 0.25  # of the recordings at most
_MANY = 0.1  # of the lines
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


@dataclass(frozen=True)
class Estimated:
    """The recordings as FRFs, and the findings on their time series.

    `doubtful`: the findings where the forces of many recordings contradict what is declared; then there are no
    entries. `uneven`: how uneven the noise of the lines is, by the recording's id. `unsure`: the relative
    uncertainty of all levels that noise in the channels leaves.
    """

    entries: list[FrfRecording]
    findings: list[Finding]
    doubtful: Sequence[Finding] = ()
    uneven: Mapping[str, Floats] = field(default_factory=dict)
    unsure: float = 0.0


def as_lines(entries: Sequence[FrfRecording], *, units_checked: bool) -> Estimated:
    """The recordings with the lines that say something, without single ones whose force contradicts what is declared.

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
    measured, of_estimates = _measured(entries)
    findings += of_estimates
    chosen = dict(zip(measured, usable_lines(list(measured.values())), strict=True))
    usable, series = list[FrfRecording](), dict[str, Usable]()
    for entry in [entry for entry in entries if entry.id in chosen]:
        own = chosen[entry.id]
        if entry.sample_rate_hz is not None and not len(own.choice.lines):
            findings.append(_unusable(entry, own))
            continue
        usable.append(_with_lines(entry, own))
        if entry.sample_rate_hz is not None:
            series[entry.id] = own
    frfs = [own.frf for own in series.values()]
    findings += [*_left_out(list(chosen.values())), *_once(series), *_mains(series), *noise_findings(frfs)]
    uneven = {
        name: own.choice.uneven[own.choice.apart] for name, own in series.items() if own.choice.uneven is not None
    }
    unsure = float(np.median([frf.bias_unsure for frf in frfs])) if frfs else 0.0
    return Estimated(usable, findings, uneven=uneven, unsure=unsure)


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


def _measured(entries: Sequence[FrfRecording]) -> tuple[dict[str, Frf], list[Finding]]:
    """The FRFs of the recordings that have one, by their ids, and findings on their time series."""
    measured, findings = dict[str, Frf](), list[Finding]()
    for entry in entries:
        try:
            frf = lines_of(entry)
        except InvalidInput as refusal:
            findings.append(Finding(Reason.SERIES_NOT_USABLE, entry.id, refusal.field, {"refusal": refusal}))
            continue
        measured[entry.id] = frf
        if frf.defects:
            first, *others = frf.defects
            arguments = {**asdict(first), "more": len(others)}
            findings.append(Finding(Reason.DEFECTS_LEFT_OUT, entry.id, first.channel, arguments))
    return measured, findings


def _unusable(entry: FrfRecording, own: Usable) -> Finding:
    """Why no line of a time series can be used."""
    if own.choice.mains is None:
        return Finding(Reason.INCOHERENT, entry.id, "charge_pc")
    return Finding(Reason.MAINS_SPOIL_ALL, entry.id, "charge_pc", {"mains_hz": own.choice.mains.mains_hz})


def _with_lines(entry: FrfRecording, own: Usable) -> FrfRecording:
    """The recording with the lines that are used, of a time series those whose noise is independent."""
    if entry.sample_rate_hz is None and own.frf.used_or_all.all():
        return entry
    frf = own.frf.at(np.flatnonzero(own.frf.used_or_all)[own.choice.apart])
    return replace(
        entry,
        frequency_hz=frf.frequency,
        frf_re_pc_per_n=to_lab("frf_pc_per_n", frf.values.real),
        frf_im_pc_per_n=to_lab("frf_pc_per_n", frf.values.imag),
        coherence=frf.coherence,
        sample_rate_hz=None,
        force_n=None,
        charge_pc=None,
        estimator=None,
    )


def _left_out(chosen: Sequence[Usable]) -> list[Finding]:
    """How many lines are left out because the force has little power there, or none that the charge follows, where they
    are many."""
    choices = [own.choice for own in chosen]
    faint, used = (sum(len(getattr(choice, name)) for choice in choices) for name in ("idle", "lines"))
    beside = used - sum(len(choice.apart) for choice in choices)
    measured = sum(len(own.choice.lines) + len(own.choice.idle) for own in chosen)
    if faint <= _MANY * measured:
        return []
    counts = {"measured": measured, "faint": faint, "beside": beside}
    return [Finding(Reason.LINES_LEFT_OUT, "", "force_n", {**counts, "recordings": len(choices)})]


def _once(series: Mapping[str, Usable]) -> list[Finding]:
    """Where the force passes through its band once."""
    names = [name for name, own in series.items() if own.choice.once]
    if not names:
        return []
    arguments = {"affected": len(names), "recordings": len(series)}
    return [Finding(Reason.FORCE_ACTS_ONCE, names[0] if len(names) == 1 else "", "force_n", arguments)]


def _mains(series: Mapping[str, Usable]) -> list[Finding]:
    """Where charge stands out at the mains' multiples and force does not, within the band or beside it."""
    pickups = {name: own.choice.mains for name, own in series.items() if own.choice.mains is not None}
    findings = []
    for mains in sorted({entry.mains_hz for entry in pickups.values()}):
        own = {name: entry.charge for name, entry in pickups.items() if entry.mains_hz == mains}
        arguments = {
            "affected": len(own),
            "recordings": len(series),
            "mains_hz": mains,
            "charge_pc": float(to_lab("charge_pc", np.median(list(own.values())))),
        }
        recording = next(iter(own)) if len(own) == 1 else ""
        findings.append(Finding(Reason.MAINS_IN_CHARGE, recording, "charge_pc", arguments))
    return findings
