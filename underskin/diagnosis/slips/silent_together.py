"""Two sensors that stop responding together while others respond.

Either their cables are exchanged, so that each was recorded while the other was pressed, or a connector or amplifier
that they share has failed. As neither gives a response, the recordings cannot tell which.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.levels import aligned_lines
from underskin.diagnosis.slips.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.axes import recording_order
from underskin.recordings.campaign import FrfRecording

_FEWEST = 2  # silent recordings of each of the two sensors


def without_silent_pair(recordings: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings without those of two sensors since they show no response, and the finding."""
    since = _silent_since(recordings)
    if not since:
        return list(recordings), []
    first, second = sorted({recordings[index].sensor for index in since})
    arguments = {"first": first, "second": second, "since": recordings[since[0]].id, "recordings": len(since)}
    remaining = [recording for index, recording in enumerate(recordings) if index not in since]
    return remaining, [Finding(Reason.SILENT_TOGETHER, "", "sensor", arguments)]


def _silent_since(recordings: Sequence[FrfRecording]) -> list[int]:
    """The recordings, in time, of two sensors since both stopped responding while others respond; empty where these
    are not exactly two."""
    silent, _ = no_response(aligned_lines(recordings))
    order = np.argsort(recording_order(recordings), kind="stable").tolist()
    falling = set[str]()
    for name in {recording.sensor for recording in recordings}:
        answers = [bool(~silent[index]) for index in order if recordings[index].sensor == name]
        if answers[0] and not any(answers[-_FEWEST:]) and answers == sorted(answers, reverse=True):
            falling.add(name)
    if len(falling) != 2:
        return []
    of_pair = [index for index in order if recordings[index].sensor in falling]
    since = of_pair[int((~silent[of_pair]).sum()) :]
    others = [index for index in order[order.index(since[0]) :] if index not in of_pair]
    return since if silent[since].all() and others and not silent[others].any() else []
