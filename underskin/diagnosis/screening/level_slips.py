"""Slips that show in the levels of recordings only: a weak sensor, one that stands alone, amplitudes of another kind,
a warm-up, cables exchanged.

The plainest is put right first, since each looks a little like the others.
"""

from collections.abc import Sequence

from underskin.diagnosis.screening.amplitude_factors import Step, amplitude_step, without_step
from underskin.diagnosis.screening.exchanged_cables import exchanged_cables, with_right_sensors
from underskin.diagnosis.screening.level_causes import causes_of
from underskin.diagnosis.screening.levels import levels
from underskin.diagnosis.screening.sensor_alone import Alone, at_the_others, standing_alone
from underskin.diagnosis.screening.warm_up import WarmUp, warming, without_first
from underskin.diagnosis.screening.weak_sensors import weak_sensors
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

_LEAST = 4  # recordings
_MOST = 300  # recordings: the covariance of more costs minutes
_MOST_SLIPS = 3


def without_level_slips(
    campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with such slips put right or left out, and the findings on them."""
    left, findings = list(entries), list[Finding]()
    if len(left) >= _LEAST:
        weak, findings = weak_sensors(left, levels(campaign, left, table))
        left = [entry for entry, off in zip(left, weak, strict=True) if not off]
    for _ in range(_MOST_SLIPS):
        found = _plainest(campaign, left, table)
        if found is None:
            break
        left, finding = found
        findings.append(finding)
    return left, findings


def _plainest(
    campaign: Campaign, entries: list[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], Finding] | None:
    """The recordings without the plainest slip, and the finding on it; None where there is none."""
    if len(entries) < _LEAST:
        return None
    own = levels(campaign, entries, table)
    if not _LEAST <= len(own.value) <= _MOST:
        return None
    slips = (
        amplitude_step(own),
        warming(own, causes_of(campaign, entries, own, table)),
        exchanged_cables(own),
        standing_alone(own),
    )
    found = [one for one in slips if one is not None]
    best = max(found, key=lambda one: one.gain, default=None)
    if isinstance(best, Step):
        return without_step(entries, own, best)
    if isinstance(best, WarmUp):
        return without_first(entries, best)
    if isinstance(best, Alone):
        return at_the_others(entries, own, best)
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return None if best is None else with_right_sensors(entries, own, best, places)
