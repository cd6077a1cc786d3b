"""Readings that are none: of a force marks that an instrument writes in their place, and spikes; of a travel jumps."""

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import CurveRecording
from underskin.recordings.curve_course import finite_rows, roughness, samples_of
from underskin.units import Floats, Mask

_LEAST = 16  # marks, or samples among which a spike can be told
_FEW_VALUES = 5  # distinct values of a curve
_OFF = 4.0  # times what its neighbours differ by, and their noise: how far a mark stands off the curve
_BEYOND_RANGE = 2.5  # from the middle of a range: twice the range outside it


def without_damaged(curve: CurveRecording) -> tuple[CurveRecording, list[Finding]]:
    """The curve without marks and spikes among its finite forces, and the findings on them."""
    findings = []
    for detect, reason in ((marks, Reason.READINGS_MARKED), (spikes, Reason.READINGS_BEYOND)):
        finite = finite_rows(curve)
        force = curve.force_n[finite]
        bad = detect(force)
        if bad.any():
            farthest = float(force[bad][np.abs(force[bad]).argmax()])
            arguments = {"samples": int(bad.sum()), "percent": 100 * float(bad.mean()), "value_n": farthest}
            findings.append(Finding(reason, curve.id, "force_n", arguments))
            curve = samples_of(curve, np.setdiff1d(np.arange(len(curve.force_n)), finite[bad]))
    return curve, findings


def marks(force: Floats) -> Mask:
    """The samples (samples,) at which an instrument wrote a mark, such as -1, where it had no reading: one number that
    comes again, one or two samples each time, far off the samples on both sides, which agree."""
    values, counts = np.unique(force, return_counts=True)
    marked = np.zeros(len(force), dtype=bool) if len(values) < _FEW_VALUES else force == values[counts.argmax()]
    others, first = np.flatnonzero(~marked), np.flatnonzero(np.diff(marked.astype(int), prepend=0) > 0)
    beside = np.searchsorted(others, first)
    first, beside = (rows[(beside > 0) & (beside < len(others))] for rows in (first, beside))
    if len(first) < _LEAST or marked.sum() > 2 * len(first) + 2:
        return np.zeros(len(force), dtype=bool)
    before, after = force[others[beside - 1]], force[others[beside]]
    off = np.abs(force[first] - (before + after) / 2)
    least = np.maximum(np.abs(after - before), max(roughness(force[others]), float(np.diff(values).min())))
    return marked if np.mean(off > _OFF * least) > 0.5 else np.zeros(len(force), dtype=bool)


def spikes(force: Floats) -> Mask:
    """The samples (samples,), one or two at a time and a hundredth of all at most, that lie farther outside the range
    of all others than twice that range, between samples within it."""
    none = np.zeros(len(force), dtype=bool)
    trimmed = max(1, len(force) // 100)
    if len(force) < _LEAST:
        return none
    low, high = np.sort(force)[[trimmed, -trimmed - 1]].tolist()
    beyond = np.abs(force - (low + high) / 2) > _BEYOND_RANGE * (high - low)
    inside = np.flatnonzero(~beyond)
    lasting = np.diff(inside).max(initial=1) > 3 or beyond[0] or beyond[-1]
    return none if lasting or not high > low else beyond


_BESIDE = 5  # samples on either side of a step, whose steps are compared with it
_SUDDEN = 6.0  # least ratio of a step of the reading to these, and to noise


def reading_steps(travel: Floats, force: Floats) -> Floats:
    """The jump of the travel's reading before each sample (samples,), 0 where there is none.

    A sphere that moves so fast takes the force with it, at least by the secant stiffness of the curve (which a foam
    between platens does not): at a step of the reading alone, as between the segments of a file, the force stays. In
    the air nothing shows, and the last sample is no segment.
    """
    moved, changed = np.diff(travel, prepend=travel[0]), np.diff(force, prepend=force[0])
    steps, noise = np.zeros(len(travel)), roughness(force)
    least = _SUDDEN * max(roughness(travel), 1e-3 * float(np.ptp(travel)))
    loaded = np.abs(force - force[0])
    stiffness = loaded.max() / max(float(np.ptp(travel)), 1e-300)
    for sample in np.flatnonzero(np.abs(moved[:-1]) > least).tolist():
        beside = np.abs(np.delete(moved[max(sample - _BESIDE, 1) : sample + _BESIDE + 1], min(sample - 1, _BESIDE)))
        expected = stiffness * abs(moved[sample])
        is_loaded = loaded[sample] > _SUDDEN * noise and expected > _SUDDEN * max(noise, abs(changed[sample]))
        if is_loaded and len(beside) and abs(moved[sample]) > _SUDDEN * beside.max():
            steps[sample] = _step(travel, force, sample)
    return steps


_AROUND = 20  # samples on either side of a step of the force: more than a slow channel holds a value
_APART = 3.0  # times the largest of these changes: of Gaussian noise one sample in 7 million
_ONE_WAY = 0.9  # least travel over its range where it does not turn: with noise, or at a turn far from the step


def force_step(travel: Floats, force: Floats, *, sphere: bool) -> int | None:
    """The first sample before which the force of a loaded sample leaps to another course while the travel goes on
    evenly, or None: the sample tears or slips, or the range of the cell is switched.

    The change of the force there stands off those around it, as no law makes it. At a hold or a turn friction may
    reverse: there none is looked for. Of a `sphere` snap-in and pull-off are leaps to or from the air, or of a force of
    the other sign; a block or strip that bears nothing any more is broken.
    """
    changed, moved = np.diff(force, prepend=force[0]), np.abs(np.diff(travel, prepend=travel[0]))
    away = force - force[0]
    pressed = away * np.sign(away[np.abs(away).argmax()])
    digit = float(np.diff(np.unique(force)).min(initial=np.inf))  # of a smooth curve, steps differ by one
    noise = max(roughness(force), digit)
    for sample in np.flatnonzero(np.abs(changed) > _SUDDEN * noise).tolist():
        first, end = sample - _AROUND, sample + _AROUND + 1
        before, after = pressed[sample - 1 : sample + 1] >= _SUDDEN * noise
        # Where a strip breaks a machine may stop: what follows may be short
        if first < 1 or not before or (end > len(force) if after else sphere):
            continue
        around, steps = (np.delete(column[first:end], _AROUND) for column in (changed, moved))
        usual = float(np.median(around))
        if abs(changed[sample] - usual) <= _APART * max(float(np.abs(around - usual).max()), noise):
            continue
        way_in, way_on = (np.median(np.diff(travel[part])) for part in (slice(first, sample), slice(sample - 1, end)))
        one_way = abs(travel[first:end][-1] - travel[first]) > _ONE_WAY * np.ptp(travel[first:end])
        if one_way and way_in * way_on > 0 and moved[sample] <= 2 * np.median(steps):
            return sample
    return None


def _step(travel: Floats, force: Floats, sample: int) -> float:
    """The jump of the reading before a sample: what it moved beyond the steps that follow.

    Where the travel turns there, these tell nothing of the step between: the force does, by the straight line over the
    travel through the samples on either side, of one slope for both.
    """
    parts = [slice(max(sample - _BESIDE, 0), sample), slice(sample, sample + _BESIDE)]
    before, after = (np.diff(travel[part]) for part in parts)
    usual = [float(np.median(steps)) for steps in (before, after)]
    # A held sphere does not move beyond the scatter of its own steps, and its force relaxes over no travel
    moves = all(abs(step) > np.median(np.abs(steps - step)) for step, steps in zip(usual, (before, after), strict=True))
    if not moves or usual[0] * usual[1] > 0:
        return float(travel[sample] - travel[sample - 1]) - usual[1]
    at, load = (np.array([column[part].mean() for part in parts]) for column in (travel, force))
    away, rest = (
        np.concatenate([column[part] - mean for part, mean in zip(parts, means, strict=True)])
        for column, means in ((travel, at), (force, load))
    )
    slope = float(away @ rest) / float(away @ away)
    return float(at[1] - at[0] - ((load[1] - load[0]) / slope if slope else 0.0))
