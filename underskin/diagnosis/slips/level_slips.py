"""Slips that show only in the levels: weak sensors, amplitudes of another kind, a warm-up, exchanged cables.

Each resembles the others, and what physics does. All that may explain the levels (`Alternative`) is therefore compared
in one table, by ln evidence over no slip plus ln prior less ln of the number of choices; the slip at the top is undone
where it exceeds no slip by far, and the rest is compared again.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.amplitude_factors import amplitude_factors
from underskin.diagnosis.slips.exchanged_cables import exchanged_cables
from underskin.diagnosis.slips.levels import GAIN, LEAST_LEVELS, Alternative, Undone, causes_of, explained, levels
from underskin.diagnosis.slips.sensor_gain import sensor_gains
from underskin.diagnosis.slips.warm_up import warm_ups
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

_MOST = 300  # recordings: the covariance of more takes minutes
_MOST_SLIPS = 4  # of one campaign; more are no slips but an unusual rig


def without_level_slips(
    campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings corrected for slips in their levels, or without them, and the findings."""
    remaining, findings = list(recordings), list[Finding]()
    for _ in range(_MOST_SLIPS):
        undone = _without_plainest(campaign, remaining, table)
        if undone is None:
            break
        remaining, finding = undone
        findings.append(finding)
    return remaining, findings


def _without_plainest(campaign: Campaign, recordings: list[FrfRecording], table: SigmaTable) -> Undone | None:
    """The recordings without the likeliest slip, and the finding; None where no slip is likely."""
    if len(recordings) < LEAST_LEVELS:
        return None
    recorded = levels(campaign, recordings, table)
    if not LEAST_LEVELS <= len(recorded.value) <= _MOST:
        return None
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    alternatives = [
        Alternative(0.0),
        *sensor_gains(recorded),
        *amplitude_factors(recorded),
        *exchanged_cables(recorded, positions),
        *warm_ups(recorded),
    ]
    result = explained(recorded, causes_of(campaign, recordings, recorded, table), alternatives)
    gain = result.evidence + [alternative.log_prior for alternative in alternatives] - result.evidence[0]
    best = int(np.argmax(gain))
    undo = alternatives[best].undo
    return None if undo is None or gain[best] < GAIN else undo(recordings, float(result.amplitude[best]))
