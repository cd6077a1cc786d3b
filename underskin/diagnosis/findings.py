"""What is wrong with a campaign's recordings themselves, by name, before any physics is blamed for it.

Recordings that cannot belong with the others (copies, reversed signs, units off by 1000, no finite line) are reported,
and left out of the diagnosis, or put right where that is plain (a sensor whose sign is reversed).
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.mechanisms.differentiated import Array
from underskin.mechanisms.frf_design import frf_recordings
from underskin.mechanisms.model import compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf_estimation import lines_of
from underskin.surrogate import SigmaTable
from underskin.units import Floats

_SLIPS = {1e3: "1000 × too large: pC taken for nC, or N for mN?", 1e-3: "1000 × too small: nC taken for pC?"}
_SLIP_WIDTH = np.log(12.0)
_LIKELY_D33 = (0.3, 3000.0)  # pC/N
_LEAST_RESPONSE = 0.2  # of the campaign's largest prediction: below it, near a crossing of zero, a sign says nothing
_AXES = ("preload_n", "indenter_radius_mm", "dynamic_force_n")


@dataclass(frozen=True)
class Finding:
    """`recording` and `field` name the place (recording empty: the whole campaign)."""

    code: str
    recording: str
    field: str
    statement: str


def inspect(campaign: Campaign, table: SigmaTable) -> tuple[Campaign, list[Finding]]:
    """The campaign without what cannot be used, reversed sensors put right, and what was found."""
    found: list[Finding] = []
    entries: list[FrfRecording] = []
    for entry in frf_recordings(campaign):
        values = lines_of(entry).values
        if not np.isfinite(values).any():
            found.append(Finding("no_finite_line", entry.id, "frf_re_pc_per_n", "no line is finite: left out"))
        elif not np.isfinite(values).all():
            count = int((~np.isfinite(values)).sum())
            found.append(Finding("lines_not_finite", entry.id, "frf_re_pc_per_n", f"{count} lines left out"))
            entries.append(entry)
        elif not np.abs(values).any():
            found.append(Finding("no_response", entry.id, "frf_re_pc_per_n", "every line is 0: left out"))
        else:
            entries.append(entry)
    entries = _without_copies(entries, found)
    found += _constant_axes(entries)
    if not entries:
        return replace(campaign, recordings=()), found
    usable = replace(campaign, recordings=tuple(entries))
    return _against_model(usable, table, found)


def _without_copies(entries: list[FrfRecording], found: list[Finding]) -> list[FrfRecording]:
    seen: dict[bytes, str] = {}
    kept = []
    for entry in entries:
        key = np.nan_to_num(lines_of(entry).values).tobytes()
        if key in seen:
            text = f"the same numbers as recording {seen[key]!r}: left out"
            found.append(Finding("duplicated_recording", entry.id, "frf_re_pc_per_n", text))
            continue
        seen[key] = entry.id
        kept.append(entry)
    return kept


def _constant_axes(entries: list[FrfRecording]) -> list[Finding]:
    found = []
    if len(entries) > 1:
        constant = [name for name in _AXES if len({getattr(entry, name) for entry in entries}) == 1]
        found += [Finding("constant_axis", "", name, f"{name} is the same in all recordings") for name in constant]
    if entries and max(len(lines_of(entry).values) for entry in entries) < 2:
        text = "one line a recording: nothing can be said about frequency"
        found.append(Finding("one_line", "", "frequency_hz", text))
    return found


def _against_model(campaign: Campaign, table: SigmaTable, found: list[Finding]) -> tuple[Campaign, list[Finding]]:
    """Signs, magnitudes and reach against the base model."""
    model = compose((), campaign, table, "frf")
    predicted = model.predict(np.array([parameter.start for parameter in model.parameters])).value
    first = np.searchsorted(model.recording, np.arange(len(campaign.recordings)))
    beyond = ~model.valid[first]
    level = _levels(campaign)
    shape = predicted[first].real
    plain = np.abs(shape) > _LEAST_RESPONSE * np.abs(shape).max()
    ratio = np.where(plain, level / np.where(shape == 0, 1.0, shape), np.nan)
    entries = list(frf_recordings(campaign))
    kept = np.ones(len(entries), dtype=bool)
    for number in np.flatnonzero(beyond):
        text = "its contact lies beyond the tables: left out"
        found.append(Finding("out_of_domain", entries[number].id, "preload_n", text))
        kept[number] = False
    usual = float(np.nanmedian(np.abs(ratio))) if np.isfinite(ratio).any() else np.nan
    slip = np.log(np.abs(ratio) / usual) if usual > 0 else np.full(len(ratio), np.nan)
    for number in np.flatnonzero(np.isfinite(slip)):
        for factor, guess in _SLIPS.items():
            if len(entries) > 2 and abs(slip[number] - np.log(factor)) < _SLIP_WIDTH:
                text = f"the response looks {guess} Left out"
                found.append(Finding("units_off_by_1000", entries[number].id, "frf_re_pc_per_n", text))
                kept[number] = False
    d33 = usual * 15.0  # the prior's centre is what the prediction was made with
    if usual > 0 and not _LIKELY_D33[0] <= d33 <= _LIKELY_D33[1]:
        guess = _SLIPS[1e3] if d33 > _LIKELY_D33[1] else _SLIPS[1e-3]
        text = f"charge over force would need a d33 of {d33:.3g} pC/N; it looks {guess}"
        found.append(Finding("units_off_by_1000", "", "frf_re_pc_per_n", text))
    signs = _signs(campaign, ratio, kept, found)
    entries = [entry if sign > 0 else _reversed(entry) for entry, sign in zip(entries, signs, strict=True)]
    return replace(campaign, recordings=tuple(np.array(entries, dtype=object)[kept])), found


def _signs(campaign: Campaign, ratio: Floats, kept: Array, found: list[Finding]) -> Floats:
    """Of each recording: −1 where its sensor's polarity is reversed, or its own alone."""
    entries = frf_recordings(campaign)
    negative = np.isfinite(ratio) & (ratio < 0) & kept
    positive = np.isfinite(ratio) & (ratio > 0) & kept
    signs = np.ones(len(entries))
    if negative.sum() > positive.sum():
        text = "charge is negative in compression: all signs were reversed (a negative d33, or the amplifier inverts)"
        found.append(Finding("sign_flipped", "", "frf_re_pc_per_n", text))
        signs[:] = -1.0
        negative, positive = positive, negative
    sensors = np.array([entry.sensor for entry in entries])
    for name in dict.fromkeys(sensors.tolist()):
        own = sensors == name
        if (negative & own).sum() > max(1, (positive & own).sum()):
            text = f"sensor {name!r} answers with the opposite sign of the others: reversed"
            found.append(Finding("sign_flipped", entries[int(np.flatnonzero(own)[0])].id, "frf_re_pc_per_n", text))
            signs[own] *= -1.0
            negative = negative & ~own
    if negative.sum() <= 0.2 * max(positive.sum(), 1):
        for number in np.flatnonzero(negative):
            text = "its sign is the opposite of the others of its sensor: reversed"
            found.append(Finding("sign_flipped", entries[number].id, "frf_re_pc_per_n", text))
            signs[number] *= -1.0
    return signs


def _levels(campaign: Campaign) -> Floats:
    return np.array([float(np.nanmedian(lines_of(entry).values.real)) for entry in frf_recordings(campaign)])


def _reversed(entry: FrfRecording) -> FrfRecording:
    if entry.charge_pc is not None:
        return replace(entry, charge_pc=-entry.charge_pc)
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    return replace(entry, frf_re_pc_per_n=-entry.frf_re_pc_per_n, frf_im_pc_per_n=-entry.frf_im_pc_per_n)
