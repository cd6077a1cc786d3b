"""The table of slips: what may have gone wrong in a laboratory, with what resembles it, under one rule.

A slip of the table gives alternatives to "no slip". Each has a prior, a gain of ln evidence over no slip (its own, or
by what it does to the model of `levels`), and the campaign without it. The alternative with the largest ln prior + gain
is undone where the sum exceeds ln 25 and it is a slip, not what resembles one; then the remaining recordings are looked
at again.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isnan, log

import numpy as np

from underskin.diagnosis.slips.comparison import Comparison, base_model, compared, times
from underskin.diagnosis.slips.levels import (
    LEAST_LEVELS,
    NO_SLIP,
    Alternative,
    Cause,
    Levels,
    Undone,
    causes_of,
    explained,
    levels,
)
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Mask

GAIN = log(25)  # ln odds that a slip must have against none
ASTRAY = 1e-5  # share of recordings that nothing listed explains, which bounds the cost of a wrong label or sign
_MOST_SLIPS = 6  # of one campaign; more are no slips but an unusual rig
_MOST_LEVELS = 300  # recordings: the covariance of more takes minutes


@dataclass(frozen=True, eq=False)
class Screened:
    """The recordings that are looked at, and what is computed of them once. `imported`: the ids of those that came as
    FRFs; those computed here are in the convention."""

    campaign: Campaign
    recordings: list[FrfRecording]
    table: SigmaTable
    imported: frozenset[str] = frozenset()

    @cached_property
    def positions(self) -> dict[str, tuple[float, float]]:
        """The position of each sensor [mm]."""
        return {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in self.campaign.skin.sensors}

    @cached_property
    def comparison(self) -> Comparison:
        """The recordings beside the base model and each other."""
        *_, prediction = base_model(self.campaign, self.recordings, self.table)
        return compared(self.recordings, prediction.value.real)

    @cached_property
    def levels(self) -> Levels | None:
        """The levels of the recordings; None where these are too few, or too many."""
        if len(self.recordings) < LEAST_LEVELS:
            return None
        recorded = levels(self.campaign, self.recordings, self.table)
        return recorded if LEAST_LEVELS <= len(recorded.value) <= _MOST_LEVELS else None

    @cached_property
    def causes(self) -> list[Cause]:
        """What else may change the levels."""
        assert self.levels is not None
        return causes_of(self.campaign, self.recordings, self.levels, self.table)

    def of_sensor(self, name: str) -> Mask:
        """Which recordings are of a sensor."""
        return np.array([recording.sensor == name for recording in self.recordings])

    def scaled(self, factor: Floats, *findings: Finding) -> Undone:
        """The recordings with their FRFs times a factor (recordings,), without those where it is NaN."""
        factors = zip(self.recordings, factor.tolist(), strict=True)
        return [item if size == 1 else times(item, size) for item, size in factors if not isnan(size)], list(findings)

    def without(self, off: Mask, *findings: Finding) -> Undone:
        """The recordings without those that are `off` (recordings,)."""
        return self.scaled(np.where(off, np.nan, 1.0), *findings)

    def relabelled(self, sensors: Mapping[int, str], finding: Finding, *, moved: bool) -> Undone:
        """The recordings with their true sensors by index, the contacts where they are, or `moved` with the sensors."""
        right = list(self.recordings)
        for index, sensor in sensors.items():
            recording = right[index]
            label, contact = self.positions[recording.sensor], recording.position_mm
            if not moved:
                contact = contact or label
            elif contact is not None:
                x, y = (at + new - old for at, new, old in zip(contact, self.positions[sensor], label, strict=True))
                contact = x, y
            right[index] = replace(recording, sensor=sensor, position_mm=contact)
        return right, [finding]


Slip = Callable[[Screened], Iterable[Alternative]]


def of_levels(slip: Callable[[Screened, Levels], Iterable[Alternative]]) -> Slip:
    """A slip that is looked for where there are levels."""
    return lambda screened: () if screened.levels is None else slip(screened, screened.levels)


def without_slips(screened: Screened, slips: Sequence[Slip]) -> Undone:
    """The recordings without the slips that the table shows, corrected or left out, and the findings."""
    findings, asked = list[Finding](), list(slips)
    for _ in range(_MOST_SLIPS):
        undone = _without_likeliest(screened, asked) if screened.recordings else None
        if undone is None:
            break
        slip, (recordings, of_slip) = undone
        findings += of_slip
        if recordings is screened.recordings:  # the finding changes nothing, and would be the same again
            asked.remove(slip)
        screened = replace(screened, recordings=recordings)
    return screened.recordings, findings


def _without_likeliest(screened: Screened, slips: Sequence[Slip]) -> tuple[Slip, Undone] | None:
    """The likeliest slip, and the recordings without it; None where no slip is likely."""
    alternatives = [(slip, alternative) for slip in slips for alternative in slip(screened)]
    gain = np.array([alternative.log_prior + alternative.gain for _, alternative in alternatives])
    amplitude = np.zeros(len(alternatives))
    of_levels = [index for index, (_, alternative) in enumerate(alternatives) if alternative.changes_levels]
    if of_levels:  # they resemble each other: only the likeliest of them counts
        assert screened.levels is not None
        weighed = explained(screened.levels, screened.causes, [NO_SLIP, *(alternatives[i][1] for i in of_levels)])
        of_each = gain[of_levels] + weighed.evidence[1:] - weighed.evidence[0]
        gain[of_levels] = np.where(of_each == of_each.max(), of_each, -np.inf)
        amplitude[of_levels] = weighed.amplitude[1:]
    likely = [index for index in range(len(gain)) if gain[index] > GAIN and alternatives[index][1].undo is not None]
    for index in sorted(likely, key=lambda index: -gain[index]):
        slip, alternative = alternatives[index]
        undone = alternative.undo(float(amplitude[index])) if callable(alternative.undo) else alternative.undo
        if undone is not None:
            return slip, undone
    return None
