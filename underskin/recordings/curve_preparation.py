"""Curves prepared for fits.

How a curve counts force and displacement, told from all of its course; turned where asked.

Compression and depth are positive here. Two facts of contact tell how a sphere's channels are counted, wherever the
recording begins and in whatever order its rows stand: the force grows with the depth, but for jumps; and it grows the
faster the deeper the sphere is, so that of all turns and ends of the travel the stiffest is the deepest. What pulls a
sphere on its way out, a lift before it is pressed, or the first of the rows tells nothing. A block may be pressed or
pulled: that force and displacement have one sign is all that its curve tells, and which it was, the sign of the force.

Curves whose columns of force and displacement look exchanged.

A stage travels at the speed that it was told, and the force follows: it stays at its zero as long as the sphere or the
platen is in the air, and rises ever faster in a contact. Where instead the "force" moves steadily while the
"displacement" first stands still, or follows it as a force follows a travel, the two are exchanged; of a block only
where it does both, as a displacement may begin late, by play of the extensometer. No material does
that: what is pressed harder is pressed deeper, by Hertz as F^(2/3), never with an exponent above 1.

Defects of a curve's channels that have nothing to do with the sample: a force that saturates, and one that carries
an error that is periodic in the travel.

Compression and depth are positive here.

Curves as everything that reads them takes them: compression and depth positive, from the air into the sample,
without samples at which the channel saturates and without an error that is periodic in the travel.

What is changed is a finding. A block whose force and displacement are both negative stays so: it may be pulled.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.errors import unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import (
    Campaign,
    CurveRecording,
    FrfRecording,
    IndentationRecording,
    Recording,
    samples_of,
)
from underskin.recordings.curve_course import roughness
from underskin.units import Floats, Indices, Mask

FORCE, TRAVEL = "force_n", "displacement_mm"
_LEAST_TELLING = 8  # samples: fewer tell nothing of how a curve goes
_COMPARED_BLOCKS = 200  # of a curve, whose means are compared
_CHANGE, _BEYOND_NOISE = 2e-3, 4.0  # of the range of force, and standard deviations: a change that counts
_AGREE = 0.2  # of the changes, by which those of one sign must outnumber the others
_RETURN = 0.05  # of the range of travel: smaller returns are noise
_SAMPLED = 20_000  # samples among which turns are sought
_NEAR = 0.15  # of the range of travel, over which the stiffness at a turn is read
_HELD = 0.02  # of that way from the turn: of what is not farther away, a hold, one sample counts
_STIFFER = 1.15  # times as stiff: less does not tell the deep end from the other
_OTHER_SIGN = 0.1  # of the largest force, of the other sign: less is none
_LONGEST = 0.9  # of a block's height: what moves farther is no compression
_BOW = 0.02  # of the range of force, by which a curve lies above its chord on average where it softens plainly


@dataclass(frozen=True)
class Orientation:
    """How a curve's columns are counted: `negative` ones fall as it is pressed.

    `turns` are the samples at which the travel turns, with the first and the last; `is_known` is whether the deep end
    was told from the curve, and not taken for the end to which it first moves.
    """

    negative: tuple[str, ...]
    turns: Indices
    is_known: bool


_UNKNOWN = Orientation((), np.zeros(0, dtype=np.intp), is_known=False)


def counted_negative(recording: CurveRecording) -> tuple[str, ...]:
    """Those of `force_n` and `displacement_mm` that fall while the curve is pressed."""
    return orientation(recording).negative


def orientation(recording: CurveRecording) -> Orientation:
    """How a recording counts, by its finite samples; `turns` are numbered among these."""
    force, travel = np.asarray(recording.force_n), np.asarray(recording.displacement_mm)
    if isinstance(recording, IndentationRecording):
        return _oriented(force, travel, sphere=True)
    oriented = _oriented(force, travel, sphere=False)
    is_pulled = len(oriented.negative) > 1 and np.nanmax(np.abs(travel)) > _LONGEST * recording.sample_height_mm
    return replace(oriented, negative=()) if is_pulled else oriented


def falling(force: Floats, travel: Floats, *, sphere: bool) -> tuple[str, ...]:
    """The same of a sphere's or a block's force and travel, (samples,) in any unit."""
    return _oriented(force, travel, sphere=sphere).negative


def _oriented(force: Floats, travel: Floats, *, sphere: bool) -> Orientation:
    if len(force) != len(travel):
        return _UNKNOWN
    finite = np.isfinite(force) & np.isfinite(travel)
    force, travel = force[finite], travel[finite]
    if len(force) < _LEAST_TELLING or not np.ptp(force) or not np.ptp(travel):
        return _UNKNOWN
    together = _sign_together(force, travel)
    turns = turning_points(travel)
    if not together:
        return Orientation((), turns, is_known=False)
    if not sphere:
        return Orientation(_of_block(force, travel, together), turns, is_known=True)
    deep = _deep_side(force, travel, turns, together)
    side = deep or _first_movement(travel)
    negative = ((FORCE, together * side < 0), (TRAVEL, side < 0))
    return Orientation(tuple(name for name, falls in negative if falls), turns, is_known=deep != 0)


def _of_block(force: Floats, travel: Floats, together: int) -> tuple[str, ...]:
    """Of a block: the force is negative where it is pulled alone, the displacement where it goes against the force.

    Both may be right of a sample that is pulled, and are where it softens as it is strained, as pulled rubber does.
    """
    low, high = float(force.min()), float(force.max())
    pulled = low < 0 and high < _OTHER_SIGN * -low
    if together > 0:
        return (FORCE, TRAVEL) if pulled and not _softens(-force, -travel) else ()
    return (FORCE,) if pulled else (TRAVEL,)


def _softens(force: Floats, strain: Floats) -> bool:
    """Whether the force rises less and less with the strain, plainly: on average it lies above the chord."""
    order = np.argsort(strain, kind="stable")
    strain, force = strain[order], force[order]
    tail = max(1, len(force) // 20)
    low, high = float(np.mean(force[:tail])), float(np.mean(force[-tail:]))
    area = float(np.trapezoid(force - low, strain)) / max(float(np.ptp(strain)), 1e-300)
    return area > (0.5 + _BOW) * (high - low)


def _sign_together(force: Floats, travel: Floats) -> int:
    """1 where the force mostly grows with the travel, -1 where it falls, 0 where neither is plain: changes of means
    over blocks are counted, so that a jump counts once."""
    starts = np.linspace(0, len(force), min(len(force), _COMPARED_BLOCKS), endpoint=False).astype(np.intp)
    counts = np.diff(np.append(starts, len(force)))
    change, moved = (np.diff(np.add.reduceat(column, starts) / counts) for column in (force, travel))
    noise = roughness(force) * np.sqrt(2 / counts.min())
    counted = np.abs(change) > max(_BEYOND_NOISE * min(noise, float(np.ptp(force)) / 20), _CHANGE * np.ptp(force))
    votes = np.sign(change * moved)[counted]
    return int(np.sign(votes.sum())) if abs(votes.sum()) > _AGREE * len(votes) else 0


def turning_points(travel: Floats) -> Indices:
    """The samples between which the travel goes one way, but for returns below a twentieth of its range; the first and
    the last are among them."""
    at = np.unique(np.linspace(0, len(travel) - 1, min(len(travel), _SAMPLED)).round().astype(np.intp))
    values, least = travel[at].tolist(), _RETURN * float(np.ptp(travel))
    turns, extreme, way = [0], 0, 0
    for number, value in enumerate(values):
        if way == 0:
            if abs(value - values[0]) > least:
                way, extreme = (1 if value > values[0] else -1), number
        elif (value - values[extreme]) * way >= 0:
            extreme = number
        elif (values[extreme] - value) * way > least:
            turns.append(extreme)
            way, extreme = -way, number
    return at[np.unique([*turns, len(values) - 1])]


def _deep_side(force: Floats, travel: Floats, turns: Indices, together: int) -> int:
    """1 where the travel is largest at the deep end, -1 where it is least there, 0 where neither turns out stiffer."""
    stiffest = {1: (0.0, 0.0), -1: (0.0, 0.0)}
    legs = list(zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True))
    near = _NEAR * float(np.ptp(travel))
    for number, turn in enumerate(turns.tolist()):
        beside = legs[max(number - 1, 0) : number + 1]
        first, last = next((leg for leg in beside if leg[0] != leg[1]), (turn, turn))
        other = last if turn == first else first
        side = 1 if travel[turn] > travel[other] else -1
        slopes = np.array([_stiffness(force, travel, turn, leg, near) for leg in beside])
        error = float(np.linalg.norm(slopes[:, 1])) / len(slopes)
        stiffest[side] = max(stiffest[side], (float(slopes[:, 0].mean()) * together, error))
    (low, _), (high, error) = sorted(stiffest.values())
    error = max(error, roughness(force) / np.sqrt(_NEAR * len(force)) / near)
    if high < _BEYOND_NOISE * error or high < _STIFFER * low:
        return 0
    return max(stiffest, key=lambda side: stiffest[side])


def _stiffness(force: Floats, travel: Floats, turn: int, leg: tuple[int, int], near: float) -> tuple[float, float]:
    """The slope of the force over the travel on one way, near the turn at one of its ends, and its standard error.

    Of a hold at the turn the sample nearest to the rest of the way counts alone: there the force relaxes.
    """
    rows = np.arange(leg[0], leg[1] + 1)
    away = np.abs(travel[rows] - travel[turn])
    held = np.flatnonzero(away <= _HELD * near)
    dropped = held[1:] if turn == leg[1] else held[:-1]
    rows, away = np.delete(rows, dropped), np.delete(away, dropped)
    chosen = rows[away <= max(near, float(np.sort(away)[: min(3, len(away))].max()))]
    moved = travel[chosen] - travel[chosen].mean()
    square = float(moved @ moved)
    if not square > 0:
        return 0.0, 0.0
    slope = float(moved @ force[chosen]) / square
    rest = force[chosen] - force[chosen].mean() - slope * moved
    return slope, float(rest.std() / np.sqrt(square))


def _first_movement(travel: Floats) -> int:
    """1 where the travel first grows, -1 where it falls."""
    moved = travel - travel[0]
    return 1 if moved[np.argmax(np.abs(moved) > _RETURN * np.ptp(moved))] > 0 else -1


def findings(campaign: Campaign) -> list[Finding]:
    """One for the first curve of each kind and way of counting, with how many more there are."""
    by_fields: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for recording in _curves(campaign).values():
        by_fields.setdefault((recording.kind, counted_negative(recording)), []).append(recording.id)
    return [finding(kind, fields, ids) for (kind, fields), ids in by_fields.items() if fields]


def finding(kind: str, fields: tuple[str, ...], ids: Sequence[str]) -> Finding:
    """On curves of a kind that count these columns negative."""
    arguments = {"fields": list(fields), "more": len(ids) - 1, "may_be_pulled": may_be_pulled(kind, fields)}
    return Finding(Reason.CURVE_COUNTED_NEGATIVE, ids[0], fields[0], arguments)


def may_be_pulled(kind: str, fields: tuple[str, ...]) -> bool:
    """Whether columns that are counted negative may be right: a block's, both of them."""
    return kind == "compression" and len(fields) > 1


def turned(campaign: Campaign) -> tuple[Campaign, int]:
    """The campaign with what its curves count negative turned, and how many curves that changed."""
    changed = 0
    recordings: list[Recording] = []
    for recording in campaign.recordings:
        fields = () if isinstance(recording, FrfRecording) else counted_negative(recording)
        changed += bool(fields)
        recordings.append(recording if isinstance(recording, FrfRecording) else with_turned(recording, fields))
    return replace(campaign, recordings=tuple(recordings)), changed


def with_turned(recording: CurveRecording, fields: tuple[str, ...]) -> CurveRecording:
    """A curve with the signs of these columns turned."""
    columns = {name: -np.asarray(getattr(recording, name)) for name in fields}
    return replace(recording, **columns) if columns else recording  # type: ignore[arg-type]


def _curves(campaign: Campaign) -> Mapping[str, CurveRecording]:
    return {one.id: one for one in campaign.recordings if not isinstance(one, FrfRecording)}


_LEAST_IN = 32  # samples on the way in
_WAY_IN = 0.99  # of the largest excursion: the way in, without a hold
_STILL = 6.0  # times the noise of one sample: a mean over a block that has not moved
_LEAST_STILL = 0.02  # of its range
_STAYS = 0.8  # of the blocks after the first that moved: a force that snaps in passes its zero once more
_STANDS = 0.15  # of the samples on the way in, at the least
_STEADY = 3.0  # ratio of two mean speeds of a stage on its way
_BLOCKS_IN = 40  # of the way in
_UNIFORM = 0.03  # of its range: the departure of a steady travel from a straight line
_FOLLOWS = 0.4  # of its way where the other has gone half of its own: (1/2)^(3/2) is 0.35, (1/2)^(2/3) is 0.63
_LAGS = 0.49  # the same of a block: it is 0.488 of a neo-Hookean one at 5 % strain, and 1/2 of a straight line


def require_own_columns(recording: CurveRecording) -> None:
    """Raises InvalidInput where force and displacement of a curve look exchanged."""
    if are_exchanged(recording):
        seen = "moves as a force does, and force_n as a stage"
        raise unusable("displacement_mm", seen, "the two columns look exchanged: exchange their names or channels")


def are_exchanged(recording: CurveRecording) -> bool:
    """Whether force and displacement of a curve look exchanged."""
    is_sphere = isinstance(recording, IndentationRecording)
    return look_exchanged(recording.displacement_mm, recording.force_n, sphere=is_sphere)


def look_exchanged(displacement: Floats, force: Floats, *, sphere: bool) -> bool:
    """Whether force (samples,) moves as a stage does, and displacement as a force; only a `sphere` tells it without
    samples in the air."""
    if len(displacement) != len(force) or not np.ptp(displacement) or not np.ptp(force):
        return False
    excursion = np.abs(force - force[0])
    end = int(np.argmax(excursion >= _WAY_IN * excursion.max())) + 1
    if end < _LEAST_IN:
        return False
    travel, load = force[:end], displacement[:end]
    if roughness(travel) / np.ptp(travel) > roughness(load) / max(np.ptp(load), 1e-300):
        return False
    stands = _stands_first(load, travel)
    if sphere:
        return stands > 0 or _follows(load, travel)
    return stands > 0 and _lags(load[stands:], travel[stands:])


def _stands_first(load: Floats, travel: Floats) -> int:
    """The samples for which the first column stands still, on the first part of a way that the second goes steadily; 0
    where it does not."""
    parts = np.array_split(load, min(_BLOCKS_IN, len(load) // 2))
    means, places = np.array([part.mean() for part in parts]), np.cumsum([len(part) for part in parts])
    still = max(_STILL * roughness(load) / np.sqrt(len(parts[0])), _LEAST_STILL * float(np.ptp(load)))
    moved = np.abs(means - means[0]) > still
    if not moved.any():
        return 0
    stands = int(places[np.argmax(moved) - 1])
    if stands < _STANDS * len(load) or moved[np.argmax(moved) :].mean() < _STAYS:
        return 0
    return stands if _is_steady(travel[:stands]) and _is_alike(travel, stands) else 0


def _lags(load: Floats, travel: Floats) -> bool:
    """Whether the first column has gone less than half of its way where the second has gone half: so the force on a
    block, that stiffens as it is pressed; a displacement that begins late, by play, is ahead."""
    few = max(len(load) // _BLOCKS_IN, 1)
    gone = np.abs(travel - travel[0])
    at = max(int(np.argmax(gone >= gone[-1] / 2)), few)
    begin, half, end = (float(part.mean()) for part in (load[:few], load[at - few : at + few], load[-few:]))
    return end != begin and (half - begin) / (end - begin) < _LAGS


def _is_steady(way: Floats) -> bool:
    """Whether both halves of a way are gone in one direction, at about the same speed."""
    first, second = way[len(way) // 2] - way[0], way[-1] - way[len(way) // 2]
    return bool(first * second > 0 and 1 / _STEADY < first / second < _STEADY)


def _is_alike(way: Floats, at: int) -> bool:
    """Whether the parts of a way before and after a sample are gone in one direction, at about the same speed."""
    before, after = (way[at - 1] - way[0]) / at, (way[-1] - way[at - 1]) / (len(way) - at + 1)
    return bool(before * after > 0 and 1 / _STEADY < before / after < _STEADY)


def _follows(load: Floats, travel: Floats) -> bool:
    """Whether the second column goes at one speed, and the first lags behind it as the force on a sphere does."""
    samples = np.arange(len(travel))
    line = np.polyval(np.polyfit(samples, travel, 1), samples)
    if np.abs(travel - line).max() > _UNIFORM * np.ptp(travel):
        return False
    few = max(len(load) // _BLOCKS_IN, 1)
    begin, half, end = (
        float(load[place : place + few].mean()) for place in (0, (len(load) - few) // 2, len(load) - few)
    )
    return end != begin and (half - begin) / (end - begin) < _FOLLOWS


_EQUAL = 5  # samples in a row, at least, that read the same where a force saturates
_MOVED = 0.02  # of the range of travel, at least, over which they do
_LONGER = 4.0  # times as far as any other value is read on end: steps of a converter are as long everywhere
_MOST_OF_WAY, _PACE = 0.75, 0.5  # of the way at the limit, and of the stage's pace, at least: creep is slower by then
_DEEP = 0.8  # of the other samples lie less deep than those that saturate
_SHALLOW_SHARE = 0.05  # of the samples, the shallowest, whose median is what the air reads
_AIR, _ABOVE = 0.05, 2.5  # of the range of force, and standard deviations there, up to which means lie in the air
_FEWEST = 24  # samples there at least
_PERIODS = 1.5  # in the air, at least: less is a drift
_SHORTEST = 4.0  # samples in a period, at least
_OVER_RANGE = 6.0  # periods in the range of travel, at least: what is slower may be the contact's own
_SINE = 0.25  # of the squares, at most, that a sine leaves of what else is left
_LARGE, _LEAST_AMPLITUDE = 4.0, 2e-3  # amplitude over the noise beside it, and over the largest force
_AROUND = 0.8, 1.25  # times the period in the air, between which that of the whole curve is sought
_OF_CYCLES, _FINER = 12, 25  # periods tried for each cycle in the range; and between two of them
_IN_AIR = 0.25  # of a cycle in the air, between the frequencies tried there
_MOST_SAMPLES = 1500  # by which a period is told
_KNOTS = 2.0  # periods between the knots of the splines that stand for the contact


@dataclass(frozen=True)
class PeriodicError:
    """A sine over the travel, `cosine` cos(2πz/p) + `sine` sin(2πz/p) [N], of the `period` p [mm]."""

    period: float
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        """In N."""
        return float(np.hypot(self.cosine, self.sine))

    def at(self, travel: Floats) -> Floats:
        """What it adds to the force [N] at a travel [mm]."""
        phase = 2 * np.pi * travel / self.period
        return np.asarray(self.cosine * np.cos(phase) + self.sine * np.sin(phase))


def saturated(travel: Floats, force: Floats, *, sphere: bool) -> Mask:
    """Which samples (samples,) read the largest, or the least, force of all while a sphere or a platen moves on, and
    lie deeper than the others: the air may read one value as well, and a load that is held as the sample creeps."""
    found = np.zeros(len(force), dtype=bool)
    if not np.ptp(force) or not np.ptp(travel):
        return found
    runs = _runs(travel, force)
    extremes = float(force.max()), float(force.min())
    between = ~np.isin(force, extremes)
    sign = -1.0 if TRAVEL in falling(force[between], travel[between], sphere=sphere) else 1.0
    depth = sign * travel
    air = float(np.quantile(force[depth <= np.quantile(depth, _SHALLOW_SHARE)], 0.5, method="nearest"))
    usual = max((moved for rows, moved in runs if force[rows[0]] not in (*extremes, air)), default=0.0)
    for extreme in extremes:
        at_limit = force == extreme
        there = [run for run in runs if force[run[0][0]] == extreme]
        longest, moved = max(there, key=lambda run: run[1], default=(np.zeros(0, dtype=np.intp), 0.0))
        if moved < max(_MOVED * np.ptp(travel), _LONGER * usual) or (~at_limit).sum() < _EQUAL:
            continue
        is_deep = np.median(depth[at_limit]) > np.quantile(depth[~at_limit], _DEEP)
        if is_deep and _goes_on(travel, longest):
            found |= at_limit
    return found


def _goes_on(travel: Floats, rows: Indices) -> bool:
    """Whether the travel keeps its pace where these samples begin to read the limit, or up to where they end."""
    first, last = int(rows[0]), int(rows[-1])
    return _keeps_pace(travel[rows], travel[first::-1]) or _keeps_pace(travel[rows[::-1]], travel[last:])


def _keeps_pace(inside: Floats, outside: Floats) -> bool:
    """Whether the travel at the limit, from its edge on, goes as fast as beside it, away from the edge.

    Over the samples that most of the way at the limit takes, so that a hold of the stage at its end does not count.
    """
    gone = np.abs(inside - inside[0])
    count = int(np.argmax(gone >= _MOST_OF_WAY * gone.max()))
    beside = min(count, len(outside) - 1)
    return beside > 0 and bool(gone[count] / count > _PACE * abs(outside[beside] - outside[0]) / beside)


def _runs(travel: Floats, force: Floats) -> list[tuple[Indices, float]]:
    """The samples in a row that read the same force, where there are enough, and how far they go."""
    starts = np.flatnonzero(np.append(True, np.diff(force) != 0))
    ends = np.append(starts[1:], len(force))
    long = ends - starts >= _EQUAL
    rows = [np.arange(first, end) for first, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True)]
    return [(own, float(np.ptp(travel[own]))) for own in rows]


def periodic_error(travel: Floats, force: Floats) -> PeriodicError | None:
    """A sine over the travel in the force that the air shows as well as the contact; None where there is none.

    Its period is told in the air, and then where it leaves least of the whole curve beside a spline on each way, which
    stands for the contact whatever its law. Of many samples means are taken: single ones would show hum of a frequency
    above half of theirs as a slow change. Means over a part x of a period show sin(πx)/(πx) of the amplitude; and what
    is left in them of hum, the samples do not show at that period.
    """
    samples, is_mean = (travel, force), len(travel) > _MOST_SAMPLES
    travel, force = _means(travel), _means(force)
    air = _in_air(travel, force)
    if air.sum() < _FEWEST:
        return None
    first = _period_in_air(travel[air], force[air])
    if first is None or first * _OVER_RANGE > np.ptp(travel):
        return None
    low, high = first * _AROUND[0], first * _AROUND[1]
    count = int(_OF_CYCLES * (high - low) / first * np.ptp(travel) / first) + 2
    step = (high - low) / (count - 1)
    near = _best_of(travel, force, np.linspace(low, high, count))[0].period
    error, left, without = _best_of(travel, force, np.linspace(near - step, near + step, _FINER))
    noise = float(np.sqrt(left / len(travel)))
    largest = float(np.abs(force - np.median(force[air])).max())
    if left > _SINE * without or error.amplitude < max(_LARGE * noise, _LEAST_AMPLITUDE * largest):
        return None
    shown = float(np.sinc(np.median(np.abs(np.diff(travel))) / error.period)) if is_mean else 1.0
    error = PeriodicError(error.period, error.cosine / shown, error.sine / shown)
    return error if _amplitude(*samples, error.period, travel[air].max()) > error.amplitude / 2 else None


def _amplitude(travel: Floats, force: Floats, period: float, end: float) -> float:
    """Of a sine of this period beside a line in the force of all samples of the air, up to the travel `end`."""
    air = travel <= end
    place, phase = travel[air] - travel[air].mean(), 2 * np.pi * travel[air] / period
    design = np.column_stack([np.ones_like(place), place, np.cos(phase), np.sin(phase)])
    fitted = np.linalg.lstsq(design, force[air], rcond=None)[0]
    return float(np.hypot(fitted[2], fitted[3]))


def _means(column: Floats) -> Floats:
    """Over at most so many blocks of samples."""
    starts = np.unique(np.linspace(0, len(column), min(len(column), _MOST_SAMPLES), endpoint=False).astype(np.intp))
    return np.asarray(np.add.reduceat(column, starts) / np.diff(np.append(starts, len(column))))


def _best_of(travel: Floats, force: Floats, periods: Floats) -> tuple[PeriodicError, float, float]:
    """Of these periods, see _beside_spline."""
    return min((_beside_spline(travel, force, period) for period in periods.tolist()), key=lambda one: one[1])


def _in_air(travel: Floats, force: Floats) -> Mask:
    """The samples at less travel than where means over the travel leave the level of the shallowest."""
    order = np.argsort(travel, kind="stable")
    count = max(len(order) // 40, 1)
    starts = np.arange(0, len(order), count)
    means = np.add.reduceat(force[order], starts) / np.diff(np.append(starts, len(order)))
    first = means[: max(2, len(means) // 10)]
    least = max(_AIR * float(np.ptp(force)), _ABOVE * float(np.std(first)))
    risen = np.flatnonzero(np.abs(means - first.mean()) > least)
    end = starts[risen[0]] if len(risen) else len(order)
    air = np.zeros(len(order), dtype=bool)
    air[order[:end]] = True
    return air


def _period_in_air(travel: Floats, force: Floats) -> float | None:
    """The period of the sine that leaves least of samples in the air beside a straight line, where that is plain."""
    span = float(np.ptp(travel))
    step = span / (len(travel) / max(len(turning_points(travel)) - 1, 1))
    if not step > 0 or span < 2 * _PERIODS * _SHORTEST * step:
        return None
    place = (travel - travel.mean()) / span
    line = np.column_stack([np.ones_like(place), place])
    beside_line = force - line @ np.linalg.lstsq(line, force, rcond=None)[0]
    frequencies = np.arange(_PERIODS, span / (_SHORTEST * step), _IN_AIR)
    left = []
    for frequency in frequencies.tolist():
        phase = 2 * np.pi * frequency * place
        design = np.column_stack([line, np.cos(phase), np.sin(phase)])
        rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
        left.append(float(rest @ rest))
    best = int(np.argmin(left))
    if left[best] > _SINE * float(beside_line @ beside_line):
        return None
    return span / float(frequencies[best])


def _beside_spline(travel: Floats, force: Floats, period: float) -> tuple[PeriodicError, float, float]:
    """The sine of a period beside a cubic spline on each way, and the squares that are left with and without it."""
    turns = turning_points(travel)
    phase = 2 * np.pi * travel / period
    sine = np.column_stack([np.cos(phase), np.sin(phase)])
    rest, force_rest = sine.copy(), force.copy()
    for first, last in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        rows = np.arange(first, last + (last == len(travel) - 1))
        basis = _splines(travel[rows], _KNOTS * period)
        both = np.column_stack([sine[rows], force[rows]])
        left = both - basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
        rest[rows], force_rest[rows] = left[:, :2], left[:, 2]
    amplitudes = np.linalg.lstsq(rest, force_rest, rcond=None)[0]
    left = force_rest - rest @ amplitudes
    found = PeriodicError(period, float(amplitudes[0]), float(amplitudes[1]))
    return found, float(left @ left), float(force_rest @ force_rest)


def _splines(travel: Floats, apart: float) -> Floats:
    """Cubic B-splines over a way, with knots so far apart (samples, splines)."""
    low, high = float(travel.min()), float(travel.max())
    count = max(int(np.ceil((high - low) / apart)), 1)
    inner = np.linspace(low, high, count + 1)
    knots = np.concatenate([np.full(3, low), inner, np.full(3, high)])
    from scipy.interpolate import BSpline  # takes 0.4 s to load, which few need

    return np.asarray(BSpline.design_matrix(travel, knots, 3).toarray())


_LEAST = 16  # samples, with which a defect can be told
_ONE_WAY = 2  # turning points of a curve of one way: its first and its last sample
_STICKS = 0.05  # of the range of force, below what the shallow end shows: a pull, so that this is a way out
_UNLOADED = 0.1  # of a block's first force, at most, with which it ends then
_SHALLOW = 20  # one in so many samples, the shallowest: the air, where any was recorded


@dataclass(frozen=True)
class PreparedCurves:
    """A campaign whose curves were prepared, and the findings on what was changed."""

    campaign: Campaign
    findings: tuple[Finding, ...]


def prepared(campaign: Campaign) -> PreparedCurves:
    """The campaign with its curves prepared; other recordings stay as they are."""
    findings: list[Finding] = []
    negative: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    recordings: list[Recording] = []
    for recording in campaign.recordings:
        if isinstance(recording, FrfRecording) or are_exchanged(recording):
            recordings.append(recording)
            continue
        curve, found = _without_saturation(recording)
        oriented = orientation(curve)
        negative.setdefault((curve.kind, oriented.negative), []).append(curve.id)
        for step in (_turned, _forwards, _without_periodic_error):
            curve, further = step(curve, oriented)
            found += further
        recordings.append(curve)
        findings += found
    counted = [finding(kind, fields, ids) for (kind, fields), ids in negative.items() if fields]
    return PreparedCurves(replace(campaign, recordings=tuple(recordings)), (*counted, *findings))


def _turned(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    if may_be_pulled(curve.kind, oriented.negative):
        return curve, []
    return with_turned(curve, oriented.negative), []


def _forwards(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    """Of one way, from the air to the deepest; what relaxes on a way out alone no law tells, so that its times go."""
    if not oriented.is_known or len(oriented.turns) > _ONE_WAY or not _is_backwards(curve):
        return curve, []
    finding = Finding(Reason.ROWS_REVERSED, curve.id, "displacement_mm", {"is_timed": curve.time_s is not None})
    backwards = samples_of(replace(curve, time_s=None), np.arange(len(curve.force_n))[::-1])
    return backwards, [finding]


def _is_backwards(curve: CurveRecording) -> bool:
    """Whether the rows of a curve of one way begin where it is deepest, and the force is nowhere the pull that tells a
    way out."""
    travel, force = (column[np.isfinite(column)] for column in (curve.displacement_mm, curve.force_n))
    if isinstance(curve, IndentationRecording):
        shallow = float(np.median(force[np.argsort(travel, kind="stable")[: max(1, len(force) // _SHALLOW)]]))
        if len(travel) != len(force) or force.min() < shallow - _STICKS * np.ptp(force):
            return False
        return bool(travel[0] > travel[-1])
    return bool(abs(force[-1]) < _UNLOADED * abs(force[0]))


def _without_saturation(curve: CurveRecording) -> tuple[CurveRecording, list[Finding]]:
    finite = np.flatnonzero(np.isfinite(curve.displacement_mm) & np.isfinite(curve.force_n))
    if len(finite) < _LEAST:
        return curve, []
    travel, force = curve.displacement_mm[finite], curve.force_n[finite]
    at_limit = saturated(travel, force, sphere=isinstance(curve, IndentationRecording))
    if not at_limit.any():
        return curve, []
    limits = np.unique(force[at_limit])
    arguments = {
        "percent": 100 * float(at_limit.mean()),
        "samples": int(at_limit.sum()),
        "limits_n": [float(value) for value in limits],
    }
    kept = np.setdiff1d(np.arange(len(curve.force_n)), finite[at_limit])
    return samples_of(curve, kept), [Finding(Reason.FORCE_SATURATES, curve.id, "force_n", arguments)]


def _without_periodic_error(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    if not isinstance(curve, IndentationRecording):
        return curve, []
    finite = np.flatnonzero(np.isfinite(curve.displacement_mm) & np.isfinite(curve.force_n))
    if len(finite) < _LEAST:
        return curve, []
    travel, force = curve.displacement_mm[finite], curve.force_n[finite]
    error = periodic_error(travel, force)
    if error is None:
        return curve, []
    corrected = np.array(curve.force_n, dtype=float)
    corrected[finite] = force - error.at(travel)
    left = float(np.ptp(corrected[finite]))
    if left == 0:  # no contact is left to correct
        return curve, []
    arguments = {
        "period_mm": error.period,
        "amplitude_n": error.amplitude,
        "percent": 100 * error.amplitude / left,
    }
    if curve.time_s is not None and len(oriented.turns) <= _ONE_WAY:
        lasting = abs(float(curve.time_s[finite[-1]] - curve.time_s[finite[0]]))
        arguments["frequency_hz"] = float(np.ptp(travel)) / error.period / max(lasting, 1e-300)
    return replace(curve, force_n=corrected), [Finding(Reason.PERIODIC_ERROR, curve.id, "force_n", arguments)]
