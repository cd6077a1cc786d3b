"""Two sensors of which each has, from a campaign on, the d33 that the other one had: their labels were exchanged.

Two changes of single sensors at once, which would be this size by chance alone, against an exchange, which fixes both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from underskin.diagnosis.several.dates import Dated
from underskin.diagnosis.several.sensors import USUAL, Change, SensorsOfCampaign
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding

_LEAST_ODDS = float(np.log(0.98 / 0.02))  # of an exchange that is stated, over two changes
_LOG_PRIOR = float(np.log(0.2))  # of an exchange, where two sensors have changed at once, over two changes


def with_exchanges(found: Sequence[Change], each: Sequence[SensorsOfCampaign | None]) -> list[Change]:
    """The changes, two of single sensors marked as an exchange where that is far more probable."""
    changes = list(found)
    single = [place for place, change in enumerate(changes) if change.sensor is not None and change.is_step]
    odds = {
        (one, two): _log_odds(changes[one], changes[two], each)
        for one, two in combinations(single, 2)
        if changes[one].since == changes[two].since
    }
    for one, two in sorted(odds, key=lambda pair: -odds[pair]):
        free = changes[one].exchanged_with is None and changes[two].exchanged_with is None
        if free and odds[one, two] > _LEAST_ODDS:
            changes[one], changes[two] = (
                replace(changes[place], exchanged_with=changes[other].sensor)
                for place, other in ((one, two), (two, one))
            )
    return changes


def _log_odds(one: Change, two: Change, each: Sequence[SensorsOfCampaign | None]) -> float:
    """Of an exchange over two changes of usual size; both changes are beyond that of all sensors."""
    before = each[one.since - 1]
    assert before is not None
    first, second = (float(before.d33[before.ids.index(str(change.sensor))]) for change in (one, two))
    apart = float(np.log(np.abs(second / first)))
    log_odds = _LOG_PRIOR
    for change, expected in ((one, apart), (two, -apart)):
        size, sd = float(np.log1p(change.value)), change.uncertainty
        by_chance = -0.5 * (size**2 / (sd**2 + USUAL**2) + np.log(sd**2 + USUAL**2))
        log_odds += -0.5 * (((size - expected) / sd) ** 2 + np.log(sd**2)) - by_chance
    return log_odds


def changed_once(changes: Sequence[Change]) -> Iterator[Change]:
    """The changes, exchanges first, each of these by one of its two sensors."""
    exchanges = [change for change in changes if change.exchanged_with is not None]
    yield from (change for change in exchanges if str(change.sensor) < str(change.exchanged_with))
    yield from (change for change in changes if change.exchanged_with is None)


def findings(changes: Sequence[Change], dated: Dated) -> list[Finding]:
    """One of each exchange."""
    return [
        Finding(
            Reason.LEVELS_EXCHANGED,
            "",
            "sensor",
            {"since": dated.called(change.since), "first": change.sensor, "second": change.exchanged_with},
        )
        for change in changed_once(changes)
        if change.exchanged_with is not None
    ]
