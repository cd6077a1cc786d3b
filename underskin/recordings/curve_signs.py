"""How a curve counts force and displacement, told from all of its course; turned where asked.

Compression and depth are positive here. Two facts of contact tell how a sphere's channels are counted, wherever the
recording begins and in whatever order its rows stand: the force grows with the depth, but for jumps; and it grows the
faster the deeper the sphere is, so that of all turns and ends of the travel the stiffest is the deepest. What pulls a
sphere on its way out, a lift before it is pressed, or the first of the rows tells nothing. A block may be pressed or
pulled: that force and displacement have one sign is all that its curve tells, and which it was, the sign of the force.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, CurveRecording, FrfRecording, IndentationRecording, Recording
from underskin.recordings.curve_jumps import roughness
from underskin.units import Floats, Indices

FORCE, TRAVEL = "force_n", "displacement_mm"
_LEAST = 8  # samples: fewer tell nothing of how a curve goes
_BLOCKS = 200  # of a curve, whose means are compared
_CHANGE, _BEYOND_NOISE = 2e-3, 4.0  # of the range of force, and standard deviations: a change that counts
_AGREE = 0.2  # of the changes, by which those of one sign must outnumber the others
_TURN = 0.05  # of the range of travel: smaller returns are noise
_SAMPLED = 20_000  # samples among which turns are sought
_NEAR = 0.15  # of the range of travel, over which the stiffness at a turn is read
_HELD = 0.02  # of that way from the turn: of what is not farther away, a hold, one sample counts
_STIFFER = 1.15  # times as stiff: less does not tell the deep end from the other
_ONE_WAY = 0.1  # of the largest force, of the other sign: less is none
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
    if len(force) < _LEAST or not np.ptp(force) or not np.ptp(travel):
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
    pulled = low < 0 and high < _ONE_WAY * -low
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
    starts = np.linspace(0, len(force), min(len(force), _BLOCKS), endpoint=False).astype(np.intp)
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
    values, least = travel[at].tolist(), _TURN * float(np.ptp(travel))
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
    return 1 if moved[np.argmax(np.abs(moved) > _TURN * np.ptp(moved))] > 0 else -1


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
