"""What single recordings say against the base model before any fit: silent, off by 1000, reversed.

All that is compared is each recording's level over what the base model predicts: its apparent d33. Recordings that are
silent, or where little is predicted (near a crossing of zero), have none.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.screening.no_response import dead, silence
from underskin.diagnosis.screening.table_domain import in_reach
from underskin.mechanisms.models.composed import Model, compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.finding import Finding
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SLIPS = {1e3: "1000 × too large: pC taken for nC, or N for mN?", 1e-3: "1000 × too small: nC taken for pC?"}
_SLIP_WIDTH = np.log(12.0)
_LIKELY_D33 = (0.3, 1000.0)  # pC/N; polymers have 5 to 40, ceramics up to some hundred
_LEAST_RESPONSE = 0.2  # of the campaign's largest prediction: below it, near a crossing of zero, a sign says nothing
_LOWEST = 5  # one line of so many counts as low, and of evenly spaced ones only the lowest third in log frequency
_D33 = 15.0  # pC/N: the prior's centre is what the prediction is made with

Mask = NDArray[np.bool_]


def against_model(
    campaign: Campaign, entries: list[FrfRecording], table: SigmaTable, found: list[Finding]
) -> tuple[list[FrfRecording], str]:
    """The recordings that can be used, reversed ones put right, and what is lacking where none can."""
    silent, variance = silence(entries)
    if silent.all():
        text = f"none of the {len(entries)} recordings shows a response above its noise: is the sensor connected?"
        found.append(Finding("no_response", "", "frf_re_pc_per_n", text))
        return [], "no recording shows a response above its own noise"
    model = compose((), replace(campaign, recordings=tuple(entries)), table, "frf")
    inside = in_reach(campaign, entries, model, table, found)
    ratio, expected = _apparent(entries, model, inside & ~silent)
    kept = inside & ~dead(entries, silent & inside, variance, expected, found)
    turned = np.where(_one_sided(entries), ratio, np.nan)
    if len(entries) == 2 and _contradict(ratio, turned, found):
        return [], "two recordings that contradict each other (see findings); a third would tell which is off"
    ratio, turned = np.where(kept, ratio, np.nan), np.where(kept, turned, np.nan)
    kept &= ~_off_by_1000(entries, ratio, found)
    _of_all(ratio, campaign.skin.d33_pc_per_n, found)
    signs = _signs(entries, turned, kept, found)
    entries = [entry if sign > 0 else _reversed(entry) for entry, sign in zip(entries, signs, strict=True)]
    return [entry for entry, chosen in zip(entries, kept, strict=True) if chosen], ""


def _apparent(entries: list[FrfRecording], model: Model, usable: Mask) -> tuple[Floats, Floats]:
    """Each recording's level over the base model's, NaN where it says nothing; and the level to be expected [C/N]."""
    predicted = model.predict(np.array([parameter.start for parameter in model.parameters])).value
    shape = predicted[np.searchsorted(model.recording, np.arange(len(entries)))].real
    level = np.array([float(np.nanmedian(lines_of(entry).values.real)) for entry in entries])
    telling = usable & (np.abs(shape) > _LEAST_RESPONSE * np.abs(shape[usable]).max(initial=0.0))
    ratio = np.where(telling, level / np.where(shape == 0, 1.0, shape), np.nan)
    usual = float(np.nanmedian(np.abs(ratio))) if telling.any() else 0.0
    return ratio, np.abs(shape) * usual


def _off_by_1000(entries: list[FrfRecording], ratio: Floats, found: list[Finding]) -> Mask:
    """Which recordings' levels are about 1000 × off all others."""
    off = np.zeros(len(entries), dtype=bool)
    if not np.isfinite(ratio).any():
        return off
    usual = float(np.nanmedian(np.abs(ratio)))
    slip = np.log(np.abs(ratio) / usual) if usual > 0 else np.full(len(ratio), np.nan)
    for number in np.flatnonzero(np.isfinite(slip)):
        for factor, guess in _SLIPS.items():
            if abs(slip[number] - np.log(factor)) < _SLIP_WIDTH:
                text = f"the response looks {guess} Left out"
                found.append(Finding("units_off_by_1000", entries[number].id, "frf_re_pc_per_n", text))
                off[number] = True
    return off


def _one_sided(entries: list[FrfRecording]) -> Mask:
    """Whether a recording's lowest lines are on the same side of zero as all of it: above a resonance charge is in
    antiphase, which reverses nothing."""
    sides = []
    for entry in entries:
        measured = lines_of(entry)
        real, frequency = measured.values.real, measured.frequency
        low = int((frequency <= np.cbrt(frequency[0] ** 2 * frequency[-1])).sum())
        lowest = real[: max(1, min(1 + (len(real) - 1) // _LOWEST, low))]
        sides.append(float(np.nanmedian(lowest)) * float(np.nanmedian(real)) > 0)
    return np.array(sides)


def _contradict(ratio: Floats, turned: Floats, found: list[Finding]) -> bool:
    """Whether two recordings' levels are about 1000 × apart, or of opposite signs; which of them is off, they hide."""
    low, high = sorted(np.abs(ratio).tolist())
    if not low > 0:
        return False
    if np.prod(turned) < 0:
        text = "the two recordings answer with opposite signs: one of them is reversed"
        found.append(Finding("sign_flipped", "", "frf_re_pc_per_n", text))
        return True
    if abs(np.log(high / low) - np.log(1e3)) < _SLIP_WIDTH:
        text = f"the two recordings' responses are {high / low:.3g} times as far apart as expected: a slip of units?"
        found.append(Finding("units_off_by_1000", "", "frf_re_pc_per_n", text))
        return True
    return False


def _of_all(ratio: Floats, declared: float | None, found: list[Finding]) -> None:
    """Name a d33 that no sensor has, or that is 1000 × off the declared one."""
    d33 = float(np.nanmedian(np.abs(ratio))) * _D33 if np.isfinite(ratio).any() else 0.0
    if d33 <= 0:
        return
    low, high = _LIKELY_D33
    known = ""
    if declared:
        low, high = (abs(declared) * factor / np.exp(_SLIP_WIDTH) ** side for factor, side in ((1e-3, -1), (1e3, 1)))
        known = f", where {declared:g} is declared"
    if not low <= d33 <= high:
        guess = _SLIPS[1e3] if d33 > high else _SLIPS[1e-3]
        text = f"charge over force would need a d33 of {d33:.3g} pC/N{known}; it looks {guess}"
        found.append(Finding("units_off_by_1000", "", "frf_re_pc_per_n", text))


def _signs(entries: list[FrfRecording], turned: Floats, kept: Mask, found: list[Finding]) -> Floats:
    """Of each recording: −1 where its sensor's polarity is reversed, or its own alone."""
    negative = np.isfinite(turned) & (turned < 0) & kept
    positive = np.isfinite(turned) & (turned > 0) & kept
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
    if negative.sum() <= max(0.2 * positive.sum(), 1) and positive.sum() > 1:
        for number in np.flatnonzero(negative):
            text = "its sign is the opposite of the others': reversed"
            found.append(Finding("sign_flipped", entries[number].id, "frf_re_pc_per_n", text))
            signs[number] *= -1.0
    return signs


def _reversed(entry: FrfRecording) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    return replace(entry, frf_re_pc_per_n=-entry.frf_re_pc_per_n, frf_im_pc_per_n=-entry.frf_im_pc_per_n)
