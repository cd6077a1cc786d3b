"""Force-displacement curves prepared for fits: signs, exchanged columns, row order, saturation, other errors.

Compression and depth are positive. The signs of a sphere's channels follow from two properties of contact, wherever the
recording begins and in whatever order its rows stand: force grows with depth except at jumps, and its slope grows with
depth, so the stiffest of all turning points and ends of the travel is the deepest. A pull-off, a lift before loading or
the first row give no information. A block may be compressed or pulled: its curve shows only that force and displacement
have one sign; the sign of the force shows which. One that is pulled and compressed is stiffer in compression over equal
strains of both, as incompressible solids are, which shows the signs of both columns.

Columns are taken for exchanged where the "force" moves steadily like a stage while the "displacement" first stands
still or lags like a force (a block needs both, since its displacement may begin late by play of the extensometer). No
material does that: by Hertz depth grows as F^(2/3), never with an exponent above 1.

`prepared` applies all corrections and reports each as a finding. A block with negative force and displacement is left
as it is: it may be in tension.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from underskin.errors import InvalidInput, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.block_modulus import is_neo_hookean
from underskin.recordings.campaign import Campaign, CompressionRecording, CurveRecording
from underskin.recordings.curve_course import (
    PACE,
    RETURN,
    finite_rows,
    is_one_sided,
    roughness,
    samples_of,
    turning_points,
)
from underskin.recordings.damaged_readings import force_step, marks, reading_steps, spikes, without_damaged
from underskin.recordings.periodic_error import periodic_error
from underskin.units import Floats, Indices, Mask
from underskin.weak_cache import cached_while_alive

FORCE, TRAVEL = "force_n", "displacement_mm"
_LEAST_TELLING = 8  # samples needed to determine signs
_COMPARED_BLOCKS = 200  # of a curve, whose means are compared
_CHANGE, _BEYOND_NOISE = 2e-3, 4.0  # least change that counts: of the range of force, and in standard deviations
_AGREE = 0.2  # majority of one sign among the changes, as a share of all
_NEAR = 0.15  # of the range of travel, over which the stiffness at a turn is computed
_HELD = 0.02  # of that distance from the turn: samples within it are a hold, of which one counts
_STIFFER = 1.15  # least ratio of stiffness of the deep end to the other
_LONGEST = 0.9  # of a block's height: a larger displacement is no compression
_BOW = 0.02  # of the range of force, by which a softening curve lies above its chord on average


@dataclass(frozen=True)
class Orientation:
    """The signs of a curve's columns: `negative` ones fall as it is pressed.

    `turns` are the samples at which the travel turns, with the first and the last. `is_deep_end_known` is whether the
    deep end follows from the stiffness, rather than being assumed from the direction of the first movement.
    `may_be_pulled`: both columns of a block are negative, which is right for tension. `bends_as_other`: a block has the
    signs of one load, and its curve bends as under the other: a solid softens as it is pulled and stiffens as it is
    pressed, a foam the other way round. `must_be_pulled`: it bends so, moves farther than its height allows, and is
    within noise that of a neo-Hookean strip.
    """

    negative: tuple[str, ...]
    turns: Indices
    is_deep_end_known: bool
    may_be_pulled: bool = False
    bends_as_other: bool = False
    must_be_pulled: bool = False


_UNKNOWN = Orientation((), np.zeros(0, dtype=np.intp), is_deep_end_known=False)


def orientation(recording: CurveRecording) -> Orientation:
    """The signs of a recording by its finite samples; `turns` are indices among these. Signs that are checked hold."""
    force, travel = np.asarray(recording.force_n), np.asarray(recording.displacement_mm)
    oriented = _oriented(force, travel, sphere=recording.has_sphere)
    if recording.signs_checked:
        return replace(oriented, negative=(), may_be_pulled=False, bends_as_other=False)
    if not oriented.bends_as_other or not np.nanmax(np.abs(travel)) > _LONGEST * recording.height_mm:
        return oriented
    if oriented.may_be_pulled:
        return replace(oriented, negative=(), may_be_pulled=False)
    if not _is_strip(with_turned(recording, (FORCE, TRAVEL))):
        return oriented  # its height may be wrong: what is pressed or pulled so far is refused
    return replace(oriented, negative=(FORCE, TRAVEL), bends_as_other=False, must_be_pulled=True)


def _is_strip(recording: CurveRecording) -> bool:
    """Whether a curve is, within noise, that of a neo-Hookean strip of the stated height."""
    try:
        return isinstance(recording, CompressionRecording) and is_neo_hookean(recording)
    except InvalidInput:
        return False


def falling(force: Floats, travel: Floats, *, sphere: bool) -> tuple[str, ...]:
    """The columns that fall during loading, for force and travel of a sphere or a block, (samples,) in any unit."""
    rows = ~(marks(force) | spikes(force))
    return _oriented(force[rows], travel[rows], sphere=sphere).negative


def _oriented(force: Floats, travel: Floats, *, sphere: bool) -> Orientation:
    if len(force) != len(travel):
        return _UNKNOWN
    finite = np.isfinite(force) & np.isfinite(travel)
    force, travel = force[finite], travel[finite]
    if len(force) < _LEAST_TELLING or not np.ptp(force) or not np.ptp(travel):
        return _UNKNOWN
    relative_sign = _relative_sign(force, travel)
    turns = turning_points(travel)
    if not relative_sign:
        return Orientation((), turns, is_deep_end_known=False)
    if not sphere:
        reversed_columns = _of_block(force, travel, relative_sign)
        one_sided = is_one_sided(force)
        may_be_pulled = len(reversed_columns) > 1 and one_sided
        bends_as_other = may_be_pulled or (not reversed_columns and one_sided and _softens(force, travel))
        return Orientation(
            reversed_columns, turns, is_deep_end_known=True, may_be_pulled=may_be_pulled, bends_as_other=bends_as_other
        )
    deep = _deep_side(force, travel, turns, relative_sign)
    moved = travel - travel[0]
    side = deep or (1 if moved[np.argmax(np.abs(moved) > RETURN * np.ptp(moved))] > 0 else -1)  # as it first moves
    negative = ((FORCE, relative_sign * side < 0), (TRAVEL, side < 0))
    return Orientation(tuple(name for name, falls in negative if falls), turns, is_deep_end_known=deep != 0)


def _of_block(force: Floats, travel: Floats, relative_sign: int) -> tuple[str, ...]:
    """The negative columns of a block: the force where it is only pulled, the displacement where it opposes the force.

    Both may be right for a sample in tension, and are where it softens with strain, as rubber in tension does. A block
    of both signs of strain is compressed where it is stiffer.
    """
    if not is_one_sided(force):
        softens = _softens_across(force, relative_sign * travel)
        return tuple(name for name, falls in ((FORCE, softens), (TRAVEL, softens == (relative_sign > 0))) if falls)
    pulled = -float(force.min()) > float(force.max())
    if relative_sign > 0:
        return (FORCE, TRAVEL) if pulled and not _softens(-force, -travel) else ()
    return (FORCE,) if pulled else (TRAVEL,)


def _softens_across(force: Floats, strain: Floats) -> bool:
    """Whether a block of both signs of strain softens as these grow, over equal strains of both signs."""
    strain = strain - strain[np.abs(force).argmin()]
    both = np.abs(strain) <= min(float(strain.max()), -float(strain.min()))
    return int(both.sum()) >= _LEAST_TELLING and _softens(force[both], strain[both])


def _softens(force: Floats, strain: Floats) -> bool:
    """Whether the curve softens with strain: on average the force lies above the chord."""
    order = np.argsort(strain, kind="stable")
    strain, force = strain[order], force[order]
    tail = max(1, len(force) // 20)
    low, high = float(np.mean(force[:tail])), float(np.mean(force[-tail:]))
    area = float(np.trapezoid(force - low, strain)) / max(float(np.ptp(strain)), 1e-300)
    return area > (0.5 + _BOW) * (high - low)


def _relative_sign(force: Floats, travel: Floats) -> int:
    """1 where the force mostly grows with the travel, -1 where it falls, 0 where undecided.

    Changes of block means are counted, so that a jump counts once; where fewer than `_LEAST_TELLING` exceed the noise,
    those of longer blocks are, lest a single jump decide.
    """
    blocks = min(len(force), _COMPARED_BLOCKS)
    while (len(votes := _votes(force, travel, blocks))) < _LEAST_TELLING < blocks // 2:
        blocks //= 2
    return int(np.sign(votes.sum())) if abs(votes.sum()) > _AGREE * len(votes) else 0


def _votes(force: Floats, travel: Floats, blocks: int) -> Floats:
    """The signs of force over travel of the changes between block means that exceed the noise."""
    starts = np.linspace(0, len(force), blocks, endpoint=False).astype(np.intp)
    counts = np.diff(np.append(starts, len(force)))
    change, moved = (np.diff(np.add.reduceat(column, starts) / counts) for column in (force, travel))
    noise = roughness(force) * np.sqrt(2 / counts.min())
    counted = np.abs(change) > max(_BEYOND_NOISE * min(noise, float(np.ptp(force)) / 20), _CHANGE * np.ptp(force))
    votes: Floats = np.sign(change * moved)[counted]
    return votes


def _deep_side(force: Floats, travel: Floats, turns: Indices, relative_sign: int) -> int:
    """1 where the travel is largest at the deep end, -1 where it is least there, 0 where neither end is stiffer.

    Nor where the force reads 0 at the stiffer end alone: at the other one it is then held, or beyond the cell's range.
    """
    stiffest = {1: (0.0, 0.0), -1: (0.0, 0.0)}
    largest = {1: 0.0, -1: 0.0}
    legs = list(zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True))
    near = _NEAR * float(np.ptp(travel))
    for index, turn in enumerate(turns.tolist()):
        adjacent = legs[max(index - 1, 0) : index + 1]
        first, last = next((leg for leg in adjacent if leg[0] != leg[1]), (turn, turn))
        other = last if turn == first else first
        side = 1 if travel[turn] > travel[other] else -1
        largest[side] = max(largest[side], abs(float(force[turn])))
        slopes = np.array([_stiffness(force, travel, turn, leg, near) for leg in adjacent])
        error = float(np.linalg.norm(slopes[:, 1])) / len(slopes)
        stiffest[side] = max(stiffest[side], (float(slopes[:, 0].mean()) * relative_sign, error))
    (low, _), (high, error) = sorted(stiffest.values())
    error = max(error, roughness(force) / np.sqrt(_NEAR * len(force)) / near)
    if high < _BEYOND_NOISE * error or high < _STIFFER * low:
        return 0
    deep = max(stiffest, key=lambda side: stiffest[side])
    return deep if largest[-deep] <= (zero := _BEYOND_NOISE * roughness(force)) or largest[deep] > zero else 0


def _stiffness(force: Floats, travel: Floats, turn: int, leg: tuple[int, int], near: float) -> tuple[float, float]:
    """The slope of force over travel on one leg near the turn at one of its ends, and its standard error.

    Of a hold at the turn, during which the force relaxes, only the sample nearest to the rest of the leg counts.
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


def findings(campaign: Campaign) -> list[Finding]:
    """One finding for the first curve of each kind and set of negative columns, with the number of further ones."""
    return _counted((curve, orientation(curve)) for curve in campaign.curves)


def _counted(curves: Iterable[tuple[CurveRecording, Orientation]]) -> list[Finding]:
    alike: dict[tuple[str, tuple[str, ...], bool], list[str]] = {}
    pulled = []
    for curve, oriented in curves:
        if oriented.must_be_pulled:
            why = f"no block of {curve.height_mm:.4g} mm is pressed {np.nanmax(np.abs(curve.displacement_mm)):.4g} mm"
            pulled.append(Finding(Reason.COUNTED_AS_OTHER_LOAD, curve.id, FORCE, {"pulled": True, "why": why}))
            continue
        alike.setdefault((curve.kind, oriented.negative, oriented.may_be_pulled), []).append(curve.id)
    return [
        Finding(
            Reason.CURVE_COUNTED_NEGATIVE,
            ids[0],
            fields[0],
            {"fields": list(fields), "more": len(ids) - 1, "may_be_pulled": may_be_pulled},
        )
        for (_, fields, may_be_pulled), ids in alike.items()
        if fields
    ] + pulled


def turned(campaign: Campaign) -> tuple[Campaign, int]:
    """The campaign with negative columns of its curves sign-reversed, and the number of curves changed."""
    negative = {curve.id: orientation(curve).negative for curve in campaign.curves}
    return campaign.with_curves(lambda curve: with_turned(curve, negative[curve.id])), sum(map(bool, negative.values()))


def as_other_load(campaign: Campaign) -> Campaign | None:
    """The campaign with the signs of both columns reversed of all its blocks whose curves bend as under the other load;
    None without one."""
    blocks = {curve.id for curve in campaign.curves if not curve.has_sphere and orientation(curve).bends_as_other}
    if not blocks:
        return None
    return campaign.with_curves(lambda curve: with_turned(curve, (FORCE, TRAVEL)) if curve.id in blocks else curve)


def with_turned(recording: CurveRecording, fields: tuple[str, ...]) -> CurveRecording:
    """A curve with the signs of these columns reversed."""
    columns = {name: -np.asarray(getattr(recording, name)) for name in fields}
    return replace(recording, **columns) if columns else recording  # type: ignore[arg-type]


_LEAST_IN = 32  # samples of the approach
_WAY_IN = 0.99  # of the largest excursion: end of the approach, without a hold
_STILL = 6.0  # times the noise of one sample: a block mean within it has not moved
_LEAST_STILL = 0.02  # of its range
_STAYS = 0.8  # of the blocks after the first that moved: a force that snaps in passes its zero once more
_STANDS = 0.15  # least share of the approach during which a column stands still
_STEADY = 3.0  # largest ratio of two mean speeds of a steady stage
_BLOCKS_IN = 40  # blocks of the approach
_UNIFORM = 0.03  # of its range: largest departure of a steady travel from a straight line
_FOLLOWS = 0.4  # share of its range at half of the other's: (1/2)^(3/2) = 0.35 for a force, (1/2)^(2/3) = 0.63 inverse
_LAGS = 0.49  # the same for a block: 0.488 for a neo-Hookean one at 5 % strain, 1/2 for a straight line


def reject_exchanged_columns(recording: CurveRecording) -> None:
    """Raise InvalidInput where force and displacement of a curve look exchanged."""
    if are_exchanged(recording):
        seen = "moves as a force does, and force_n as a stage"
        raise unusable("displacement_mm", seen, "the two columns look exchanged: exchange their names or channels")


def are_exchanged(recording: CurveRecording) -> bool:
    """Whether the force of a curve moves like a stage, and its displacement like a force; without samples in the air
    this can be decided for a sphere only."""
    displacement, force = recording.displacement_mm, recording.force_n
    if not np.ptp(displacement) or not np.ptp(force):
        return False
    excursion = np.abs(force - force[0])
    end = int(np.argmax(excursion >= _WAY_IN * excursion.max())) + 1
    if end < _LEAST_IN:
        return False
    travel, load = force[:end], displacement[:end]
    stands = _stands_first(load, travel)
    if recording.has_sphere and stands > 0 and _is_uniform(travel) and _lags(load[stands:], travel[stands:]):
        return True  # whichever of the two is noisier
    if roughness(travel) / np.ptp(travel) > roughness(load) / max(np.ptp(load), 1e-300):
        return False
    if recording.has_sphere:
        return stands > 0 or _follows(load, travel)
    return stands > 0 and _lags(load[stands:], travel[stands:])


def _stands_first(load: Floats, travel: Floats) -> int:
    """The number of initial samples over which `load` stands still while `travel` moves steadily; 0 without any."""
    parts = np.array_split(load, min(_BLOCKS_IN, len(load) // 2))
    means, places = np.array([part.mean() for part in parts]), np.cumsum([len(part) for part in parts])
    still = max(_STILL * roughness(load) / np.sqrt(len(parts[0])), _LEAST_STILL * float(np.ptp(load)))
    moved = np.abs(means - means[0]) > still
    if not moved.any():
        return 0
    stands = int(places[np.argmax(moved) - 1])
    if stands < _STANDS * len(load) or moved[np.argmax(moved) :].mean() < _STAYS:
        return 0
    first, middle, last, end = travel[[0, stands // 2, stands - 1, -1]].tolist()
    is_steady = _are_alike(middle - first, last - middle)
    goes_on = _are_alike((last - first) / stands, (end - last) / (len(travel) - stands + 1))
    return stands if is_steady and goes_on else 0


def _lags(load: Floats, travel: Floats) -> bool:
    """Whether `load` is below half of its range where `travel` is at half, as the force on a block that stiffens in
    compression; a displacement that begins late by play is above half."""
    few = max(len(load) // _BLOCKS_IN, 1)
    gone = np.abs(travel - travel[0])
    at = max(int(np.argmax(gone >= gone[-1] / 2)), few)
    start, half, end = (float(part.mean()) for part in (load[:few], load[at - few : at + few], load[-few:]))
    return end != start and (half - start) / (end - start) < _LAGS


def _are_alike(first: float, second: float) -> bool:
    """Whether two speeds of a stage have one direction and about one size."""
    return bool(first * second > 0 and 1 / _STEADY < first / second < _STEADY)


def _is_uniform(travel: Floats) -> bool:
    """Whether `travel` has constant speed."""
    samples = np.arange(len(travel))
    line = np.polyval(np.polyfit(samples, travel, 1), samples)
    return bool(np.abs(travel - line).max() <= _UNIFORM * np.ptp(travel))


def _follows(load: Floats, travel: Floats) -> bool:
    """Whether `travel` has constant speed and `load` lags behind it like the force on a sphere."""
    if not _is_uniform(travel):
        return False
    few = max(len(load) // _BLOCKS_IN, 1)
    start, half, end = (
        float(load[first : first + few].mean()) for first in (0, (len(load) - few) // 2, len(load) - few)
    )
    return end != start and (half - start) / (end - start) < _FOLLOWS


_EQUAL = 5  # least number of consecutive equal samples of a saturated force
_MOVED = 0.02  # of the range of travel: least travel during them
_LONGER = 4.0  # times the longest run of any other value: steps of a converter are equally long everywhere
_MOST_OF_WAY = 0.75  # of the travel at the limit
_DEEP = 0.8  # share of the other samples that lie less deep than the saturated ones
_NOISE_BAND = 7.0  # standard deviations that hold a thousand samples of one value
_DIGITS, _ROUNDED = 9, 1e-6  # of the range of force, and of a width at its edge: below are errors of rounding
_LEAST_BANDS = 10.0  # such bands between air and limit: in fewer a contact may look as constant
_NEARLY_ALL = 0.9  # of the samples within the widest of these bands: a narrower one holds the same
_SHALLOW_SHARE = 0.05  # share of shallowest samples, whose median is the reading in air


def saturated(travel: Floats, force: Floats, *, sphere: bool) -> tuple[Mask, list[float]]:
    """Which samples (samples,) are saturated, and the largest or smallest force that they read while the travel goes
    on: one value, two of a converter whose last bit flickers, or what the noise in air makes of one.

    They must lie deeper than the others: a force in air, or one held while the sample creeps, is constant as well.
    """
    at_limits, limits = np.zeros(len(force), dtype=bool), list[float]()
    if not np.ptp(force) or not np.ptp(travel):
        return at_limits, limits
    extremes = float(force.max()), float(force.min())
    between = ~np.isin(force, extremes)
    sign = -1.0 if TRAVEL in falling(force[between], travel[between], sphere=sphere) else 1.0
    depth = sign * travel
    shallow = force[depth <= np.quantile(depth, _SHALLOW_SHARE)]
    air = float(np.quantile(shallow, 0.5, method="nearest"))
    step = float(np.diff(np.unique(np.round(force / np.ptp(force), _DIGITS))).min()) * float(np.ptp(force))
    noise = float(np.sqrt(np.pi / 2) * np.mean(np.abs(shallow - air)))  # the median is 0 where a converter is coarse
    pressed = max(extremes, key=lambda extreme: (extreme - air) * (force[np.argmax(depth)] - air))
    for extreme in extremes:
        widths = [0.0]  # adhesion makes a least force, and foam a plateau, that lie within noise as well
        if extreme == pressed:
            band = max(_NOISE_BAND * noise, 2 * step)
            widths += [2 * step, band] if sphere and _LEAST_BANDS * band < abs(extreme - air) else [2 * step]
        found = [
            mask
            for width in widths
            if (mask := _at_limit(travel, depth, np.abs(force - extreme), abs(air - extreme), width)).any()
        ]
        if found:
            most = max(int(mask.sum()) for mask in found)
            at_limits |= next(mask for mask in found if mask.sum() >= _NEARLY_ALL * most)
            limits.append(extreme)
    return at_limits, limits


def _at_limit(travel: Floats, depth: Floats, below: Floats, air: float, width: float) -> Mask:
    """Which samples lie within `width` of an extreme force where it is a limit, by their distances `below` it and that
    of the reading in air; none where it is not."""
    level, of_air = (np.floor(part / width + _ROUNDED) if width else part for part in (below, np.array([air])))
    runs = _runs(travel, level)
    others = (moved for rows, moved in runs if level[rows[0]] and abs(level[rows[0]] - of_air[0]) > (width > 0))
    at_limit = np.asarray(level == 0)
    runs_at_limit = [run for run in runs if level[run[0][0]] == 0]
    longest, moved = max(runs_at_limit, key=lambda run: run[1], default=(np.zeros(0, dtype=np.intp), 0.0))
    by_slope = width / max(air, width) * np.ptp(travel) if width else 0.0  # the travel through a band, as on average
    is_long = moved >= max(_MOVED * np.ptp(travel), _LONGER * max(others, default=0.0), _LONGER * by_slope)
    is_deep = (
        is_long and (~at_limit).sum() >= _EQUAL and np.median(depth[at_limit]) > np.quantile(depth[~at_limit], _DEEP)
    )
    return at_limit if is_deep and _goes_on(travel, longest) else np.zeros_like(at_limit)


def _goes_on(travel: Floats, rows: Indices) -> bool:
    """Whether the travel keeps its speed at the first or the last of these samples at the limit."""
    first, last = int(rows[0]), int(rows[-1])
    return _keeps_pace(travel[rows], travel[first::-1]) or _keeps_pace(travel[rows[::-1]], travel[last:])


def _keeps_pace(inside: Floats, outside: Floats) -> bool:
    """Whether the travel `inside` the limit, from its edge on, is as fast as `outside`, away from the edge.

    Evaluated over the samples of most of the travel at the limit, so that a hold at its end does not count.
    """
    moved = np.abs(inside - inside[0])
    count = int(np.argmax(moved >= _MOST_OF_WAY * moved.max()))
    outside_count = min(count, len(outside) - 1)
    return outside_count > 0 and bool(
        moved[count] / count > PACE * abs(outside[outside_count] - outside[0]) / outside_count
    )


def _runs(travel: Floats, level: Floats) -> list[tuple[Indices, float]]:
    """Runs of consecutive samples of equal level, at least `_EQUAL` long, and the travel during each."""
    starts = np.flatnonzero(np.append(True, np.diff(level) != 0))
    ends = np.append(starts[1:], len(level))
    long = ends - starts >= _EQUAL
    runs = [np.arange(first, end) for first, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True)]
    return [(rows, float(np.ptp(travel[rows]))) for rows in runs]


_LEAST = 16  # samples needed to detect a defect
_TURNS_OF_ONE_WAY = 2  # turning points of a monotonic curve: its first and its last sample
_STICKS = 0.05  # of the range of force below the shallow end: adhesion, so that the rows are a withdrawal
_UNLOADED = 0.1  # largest final force of a reversed block, of its first force
_SHALLOW = 20  # one in so many samples, the shallowest: air, where any was recorded


@dataclass(frozen=True)
class PreparedCurves:
    """A campaign with prepared curves, and the findings on the changes."""

    campaign: Campaign
    findings: tuple[Finding, ...]


@cached_while_alive
def prepared(campaign: Campaign) -> PreparedCurves:
    """The campaign with its curves prepared; other recordings are unchanged."""
    findings: list[Finding] = []
    oriented_curves: list[tuple[CurveRecording, Orientation]] = []

    def changed(curve: CurveRecording) -> CurveRecording:
        if are_exchanged(curve):
            return curve
        curve, of_damage = without_damaged(curve)
        curve, of_saturation = _corrected(curve, _without_saturation)
        oriented = orientation(curve)
        oriented_curves.append((curve, oriented))
        curve, of_order = _forwards(
            curve if oriented.may_be_pulled else with_turned(curve, oriented.negative), oriented
        )
        findings.extend((*of_damage, *of_saturation, *of_order))
        of_sphere = (_without_steps, _until_force_step, _without_periodic_error)
        for step in of_sphere if curve.has_sphere else (_until_force_step,):
            curve, curve_findings = _corrected(curve, step)
            findings.extend(curve_findings)
        return curve

    changed_campaign = campaign.with_curves(changed)
    return PreparedCurves(changed_campaign, (*_counted(oriented_curves), *findings))


_Step = Callable[[CurveRecording, Indices, Floats, Floats], tuple[CurveRecording, list[Finding]]]


def _corrected(curve: CurveRecording, step: _Step) -> tuple[CurveRecording, list[Finding]]:
    """A curve after a step, which takes its finite samples: their rows, travel and force."""
    rows = finite_rows(curve)
    return (curve, []) if len(rows) < _LEAST else step(curve, rows, curve.displacement_mm[rows], curve.force_n[rows])


def _forwards(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    """A monotonic curve from air to the deepest sample; a reversed one loses its times, since relaxation cannot be
    determined from a withdrawal alone."""
    if not oriented.is_deep_end_known or len(oriented.turns) > _TURNS_OF_ONE_WAY or not _is_backwards(curve):
        return curve, []
    finding = Finding(Reason.ROWS_REVERSED, curve.id, "displacement_mm", {"is_timed": curve.time_s is not None})
    backwards = samples_of(replace(curve, time_s=None), np.arange(len(curve.force_n))[::-1])
    return backwards, [finding]


def _is_backwards(curve: CurveRecording) -> bool:
    """Whether the rows of a monotonic curve begin at the deepest sample, without the adhesive pull of a withdrawal."""
    travel, force = (column[np.isfinite(column)] for column in (curve.displacement_mm, curve.force_n))
    if curve.has_sphere:
        shallow = float(np.median(force[np.argsort(travel, kind="stable")[: max(1, len(force) // _SHALLOW)]]))
        if len(travel) != len(force) or force.min() < shallow - _STICKS * np.ptp(force):
            return False
        return bool(travel[0] > travel[-1])
    return bool(abs(force[-1]) < _UNLOADED * abs(force[0]))


def _without_saturation(
    curve: CurveRecording, finite: Indices, travel: Floats, force: Floats
) -> tuple[CurveRecording, list[Finding]]:
    at_limit, limits = saturated(travel, force, sphere=curve.has_sphere)
    if not at_limit.any():
        return curve, []
    arguments = {
        "percent": 100 * float(at_limit.mean()),
        "samples": int(at_limit.sum()),
        "limits_n": sorted(limits),
    }
    unsaturated = np.setdiff1d(np.arange(len(curve.force_n)), finite[at_limit])
    return samples_of(curve, unsaturated), [Finding(Reason.FORCE_SATURATES, curve.id, "force_n", arguments)]


def _without_steps(
    curve: CurveRecording, finite: Indices, travel: Floats, force: Floats
) -> tuple[CurveRecording, list[Finding]]:
    steps = reading_steps(travel, force)
    if not steps.any():
        return curve, []
    displacement = np.array(curve.displacement_mm, dtype=float)
    displacement[finite] -= np.cumsum(steps)
    largest = int(np.abs(steps).argmax())
    further = int(np.count_nonzero(steps)) - 1
    arguments = {"step_mm": float(steps[largest]), "sample": int(finite[largest]), "further": further}
    corrected = replace(curve, displacement_mm=displacement)
    return corrected, [Finding(Reason.READING_STEPS, curve.id, "displacement_mm", arguments)]


def _until_force_step(
    curve: CurveRecording, finite: Indices, travel: Floats, force: Floats
) -> tuple[CurveRecording, list[Finding]]:
    """The samples before a leap of the force alone: those after it are not of the same contact or grip."""
    sample = force_step(travel, force, sphere=curve.has_sphere)
    if sample is None:
        return curve, []
    arguments = {
        "from_n": float(force[sample - 1]),
        "to_n": float(force[sample]),
        "at_mm": float(travel[sample]),
        "samples": len(finite) - sample,
    }
    return samples_of(curve, finite[:sample]), [Finding(Reason.FORCE_STEPS, curve.id, "force_n", arguments)]


def _without_periodic_error(
    curve: CurveRecording, finite: Indices, travel: Floats, force: Floats
) -> tuple[CurveRecording, list[Finding]]:
    error = periodic_error(travel, force)
    if error is None:
        return curve, []
    corrected = np.array(curve.force_n, dtype=float)
    corrected[finite] = force - error.at(travel)
    force_range = float(np.ptp(corrected[finite]))
    if force_range == 0:  # no contact is left to correct
        return curve, []
    arguments = {
        "period_mm": error.period,
        "amplitude_n": error.amplitude,
        "percent": 100 * error.amplitude / force_range,
    }
    if curve.time_s is not None and len(turning_points(travel)) <= _TURNS_OF_ONE_WAY:
        duration = abs(float(curve.time_s[finite[-1]] - curve.time_s[finite[0]]))
        arguments["frequency_hz"] = float(np.ptp(travel)) / error.period / max(duration, 1e-300)
    return replace(curve, force_n=corrected), [Finding(Reason.PERIODIC_ERROR, curve.id, "force_n", arguments)]
