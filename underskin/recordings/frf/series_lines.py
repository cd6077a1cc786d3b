"""Recordings given as time series as FRFs: their lines that can be used, and what is said of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.line_choice import Usable, excited_at_mains, gain_findings, noise_findings, usable_lines
from underskin.recordings.frf.spectra import Frf, left_out_of
from underskin.units import Complexes, Floats, Mask, to_lab

_MANY = 0.1  # of the lines
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


@dataclass(frozen=True)
class Estimated:
    """The recordings as FRFs, and the findings on their time series.

    `uneven`: relative noise of the lines, by the recording's id. `unsure`: relative uncertainty of all levels due to
    noise in the channels.
    """

    recordings: list[FrfRecording]
    findings: list[Finding]
    uneven: Mapping[str, Floats]
    unsure: float


def as_lines(recordings: Sequence[FrfRecording]) -> Estimated:
    """The recordings with their usable lines."""
    chosen, findings = chosen_lines(recordings, Reason.SERIES_NOT_USABLE)
    findings += [finding for name, lines in chosen.items() for finding in left_out_of(name, lines.frf.defects)]
    of_each, of_levels = at_two_levels(chosen)
    findings += [*of_each.values(), *of_levels]
    usable, series = list[FrfRecording](), dict[str, Usable]()
    for recording in [one for one in recordings if one.id in chosen and one.id not in of_each]:
        lines = chosen[recording.id]
        if recording.sample_rate_hz is not None and not len(lines.choice.lines):
            none_follows = Finding(Reason.INCOHERENT, recording.id, "charge_pc")
            findings.append(of_spoilt(recording.id, lines) or none_follows)
            continue
        usable.append(_with_lines(recording, lines))
        if recording.sample_rate_hz is not None:
            series[recording.id] = lines
    frfs = [lines.frf for lines in series.values()]
    findings += [
        *_lines_left_out(list(chosen.values())),
        *_single_passes(series),
        *_mains(series),
        *excited_at_mains({recording.id: chosen[recording.id] for recording in usable}),
        *gain_findings({name: lines.frf for name, lines in series.items()}),
        *noise_findings(frfs),
    ]
    uneven = {
        name: lines.choice.uneven[lines.choice.apart]
        for name, lines in series.items()
        if lines.choice.uneven is not None
    }
    unsure = float(np.median([frf.bias_unsure for frf in frfs])) if frfs else 0.0
    return Estimated(usable, findings, uneven, unsure)


def as_given(recordings: Sequence[FrfRecording], findings: Sequence[Finding]) -> list[Finding]:
    """The findings with the fields as given: a time series has a sample rate and charge instead of an FRF."""
    series = {recording.id for recording in recordings if recording.sample_rate_hz is not None}
    if len(series) == len(recordings):
        series.add("")
    return [
        replace(finding, field=_GIVEN_AS.get(finding.field, finding.field)) if finding.recording in series else finding
        for finding in findings
    ]


def chosen_lines(recordings: Sequence[FrfRecording], refused: Reason) -> tuple[dict[str, Usable], list[Finding]]:
    """The usable lines of the recordings that have an FRF, by their ids, and findings, for this reason, on the
    others."""
    measured, findings = dict[str, Frf](), list[Finding]()
    for recording in recordings:
        try:
            measured[recording.id] = lines_of(recording)
        except InvalidInput as refusal:
            findings.append(Finding(refused, recording.id, refusal.field, {"refusal": refusal}))
    return dict(zip(measured, usable_lines(list(measured.values())), strict=True)), findings


def at_two_levels(chosen: Mapping[str, Usable]) -> tuple[dict[str, Finding], list[Finding]]:
    """Recordings whose lines lie at two levels: by its id a finding on each that is left out for it, which are all
    where most recordings have one level; otherwise the finding on those, which are used."""
    found = {
        name: levels
        for name, lines in chosen.items()
        if (levels := _two_levels(lines.frf.frequency, lines.frf.values, lines.frf.used_or_all)) is not None
    }
    of_each = {
        name: Finding(
            Reason.GAIN_OVER_FREQUENCY, name, "frf_re_pc_per_n", asdict(levels) | {"left_out": True, "more": 0}
        )
        for name, levels in found.items()
    }
    if not found or 2 * len(found) < len(chosen):
        return of_each, []
    first, *others = of_each.values()
    return {}, [replace(first, arguments={**first.arguments, "left_out": False, "more": len(others)})]


_NEIGHBOURS, _FEWEST, _FEWEST_AT_LEVEL = 12, 10, 4  # lines
_FAR, _USUAL = 0.1, 0.05  # of the difference of both levels
_LEAST, _MOST_SCATTER = float(np.log(1.05)), 0.1  # difference of both levels; scatter beyond which neither is one


@dataclass(frozen=True)
class _TwoLevels:
    """The level of the higher lines over that of the lower ones as `factor`; of a step `low_hz` and `high_hz`, between
    which it lies, and whether it `rises`; where the levels alternate the range of the lines in which they do."""

    factor: float
    low_hz: float
    high_hz: float
    is_step: bool
    rises: bool


def _two_levels(frequency: Floats, values: Complexes, used: Mask) -> _TwoLevels | None:
    """The two levels of the used lines (lines,) in order of frequency, as of two ranges of an amplifier during a sweep;
    None where they have no such two.

    Neighbouring lines, twelve or all of at least ten, are split in two at a gap of their sorted ln |FRF|. They are of
    two levels where all but one lie near the median of their half: within a tenth of the difference of the medians, of
    which their usual distance is a twentieth. A law that falls or rises over them, a filter's or a resonance's, spreads
    its lines over the range between; noise made one of 15,000 drawn recordings so. Where lines are many, neighbours are
    also taken at every second, fourth, … line: the spectra of overlapping blocks blend at a step.
    """
    lines = np.flatnonzero(used & np.isfinite(values) & (values != 0) & (frequency > 0))
    size = np.log(np.abs(values[lines])) if len(lines) else np.zeros(0)
    spacing, found = 1, None
    while found is None and len(size[::spacing]) >= _FEWEST:
        found = _at_neighbours(frequency[lines][::spacing], size[::spacing])
        spacing *= 2
    return found


def _at_neighbours(frequency: Floats, size: Floats) -> _TwoLevels | None:
    """Those of the neighbours at which the levels differ most beyond their scatter."""
    windows = sliding_window_view(size, min(_NEIGHBOURS, len(size)))
    ordered = np.sort(windows, axis=1)
    best = (0.0, 0, 0)
    for below in range(_FEWEST_AT_LEVEL, windows.shape[1] - _FEWEST_AT_LEVEL + 1):
        halves = ordered[:, :below], ordered[:, below:]
        low, high = (np.median(half, axis=1) for half in halves)
        step = np.maximum(high - low, 1e-12)
        away = np.abs(np.concatenate([halves[0] - low[:, None], halves[1] - high[:, None]], axis=1))
        scatter = 1.4826 * np.median(away, axis=1)
        alike = (away <= _FAR * step[:, None]).sum(axis=1) >= windows.shape[1] - 1
        alike &= (step >= _LEAST) & (scatter <= np.minimum(_USUAL * step, _MOST_SCATTER))
        quality = np.where(alike, step / np.maximum(scatter, 1e-6), 0.0)
        index = int(np.argmax(quality))
        if quality[index] > best[0]:
            best = float(quality[index]), index, below
    _, first, below = best
    if not below:
        return None
    window, hertz = windows[first], frequency[first : first + windows.shape[1]]
    lower, higher = (float(np.median(half)) for half in np.split(ordered[first], [below]))
    is_high = window > (lower + higher) / 2
    near = np.minimum(np.abs(window - lower), np.abs(window - higher)) <= _FAR * (higher - lower)
    changes = np.flatnonzero(np.diff(is_high[near]))
    is_step = len(changes) == 1
    at = hertz[near][changes[0] : changes[0] + 2] if is_step else hertz[[0, -1]]
    factor = float(np.exp(higher - lower))
    return _TwoLevels(factor, float(at[0]), float(at[1]), is_step, bool(is_high[near][-1]))


def of_spoilt(name: str, lines: Usable) -> Finding | None:
    """Why no line of a recording can be used: an overload, or mains; None otherwise."""
    if lines.overload is not None:
        return Finding(Reason.DEFECT, name, lines.overload.channel, asdict(lines.overload))
    if lines.all_spoilt_by_hz is None:
        return None
    return Finding(Reason.MAINS_SPOIL_ALL, name, "charge_pc", {"mains_hz": lines.all_spoilt_by_hz})


def _with_lines(recording: FrfRecording, lines: Usable) -> FrfRecording:
    """The recording with its usable lines; of a time series those whose noise is independent."""
    if recording.sample_rate_hz is None and lines.frf.used_or_all.all():
        return recording
    frf = lines.frf.at(np.flatnonzero(lines.frf.used_or_all)[lines.choice.apart])
    return replace(
        recording,
        frequency_hz=frf.frequency,
        frf_re_pc_per_n=to_lab("frf_pc_per_n", frf.values.real),
        frf_im_pc_per_n=to_lab("frf_pc_per_n", frf.values.imag),
        coherence=frf.coherence,
        sample_rate_hz=None,
        force_n=None,
        charge_pc=None,
        estimator=None,
    )


def _lines_left_out(chosen: Sequence[Usable]) -> list[Finding]:
    """The finding on lines left out because the force has little power there, or the charge does not follow it, where
    they are many."""
    choices = [lines.choice for lines in chosen]
    faint, used = (sum(len(getattr(choice, name)) for choice in choices) for name in ("idle", "lines"))
    dependent = used - sum(len(choice.apart) for choice in choices)
    measured = sum(len(lines.choice.lines) + len(lines.choice.idle) for lines in chosen)
    if faint <= _MANY * measured:
        return []
    counts = {"measured": measured, "faint": faint, "beside": dependent}
    return [Finding(Reason.LINES_LEFT_OUT, "", "force_n", {**counts, "recordings": len(choices)})]


def _single_passes(series: Mapping[str, Usable]) -> list[Finding]:
    """The finding on recordings whose force passes through its band once."""
    names = [name for name, lines in series.items() if lines.choice.once]
    if not names:
        return []
    arguments = {"affected": len(names), "recordings": len(series)}
    return [Finding(Reason.FORCE_ACTS_ONCE, names[0] if len(names) == 1 else "", "force_n", arguments)]


def _mains(series: Mapping[str, Usable]) -> list[Finding]:
    """Findings on charge that stands out at multiples of the mains frequency where the force does not, within the band
    or near it."""
    pickups = {name: lines.choice.mains for name, lines in series.items() if lines.choice.mains is not None}
    findings = []
    for mains in sorted({pickup.mains_hz for pickup in pickups.values()}):
        charges = {name: pickup.charge for name, pickup in pickups.items() if pickup.mains_hz == mains}
        arguments = {
            "affected": len(charges),
            "recordings": len(series),
            "mains_hz": mains,
            "charge_pc": float(to_lab("charge_pc", np.median(list(charges.values())))),
        }
        recording = next(iter(charges)) if len(charges) == 1 else ""
        findings.append(Finding(Reason.MAINS_IN_CHARGE, recording, "charge_pc", arguments))
    return findings
