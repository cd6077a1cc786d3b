"""Differences between stored and new answers, and whether right answers were won or lost beyond chance."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import binomtest

from proof.ledger.answer import GRADES, OPEN, RIGHT, WRONG
from proof.markdown import table
from proof.phrases import percent
from proof.statistics import Share, calibration, share

Line = Mapping[str, Any]  # name, documents (their digest), truth, answer, grade

_PROBABILITY = 0.05
_OF_INTERVAL = 0.1
_QUANTITIES = ("d33", "youngs_modulus")
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Compared:
    """A part's stored and new lines, in pairs of one campaign."""

    part: str
    pairs: Sequence[tuple[Line, Line]]
    seconds: tuple[float, float]  # processor time of the diagnoses, stored and new; nan if unknown

    def changed(self) -> list[tuple[Line, Line]]:
        """Pairs of different answers."""
        return [(stored, new) for stored, new in self.pairs if next(differences(stored, new), None)]

    @property
    def better(self) -> int:
        """Answers that were graded higher: from wrong to open or right, from open to right."""
        return sum(GRADES.index(new["grade"]) > GRADES.index(stored["grade"]) for stored, new in self.pairs)

    @property
    def worse(self) -> int:
        """Answers that were graded lower."""
        return sum(GRADES.index(new["grade"]) < GRADES.index(stored["grade"]) for stored, new in self.pairs)

    @property
    def p_value(self) -> float:
        """Two-sided sign test of better against worse: the probability of so uneven a split of equal chances."""
        return float(binomtest(self.better, self.better + self.worse).pvalue) if self.better + self.worse else 1.0

    @property
    def is_worse(self) -> bool:
        """Whether more answers were lost than chance allows."""
        return self.worse > self.better and self.p_value < SIGNIFICANT


def differences(stored: Line, new: Line) -> Iterator[str]:
    """The differences of one answer in words: set, verdict, probability by more than 0.05, a number or its interval
    by more than a tenth of the stored interval (also of each parameter of an unchanged set)."""
    if stored["documents"] != new["documents"]:
        yield "the campaign itself"
    before, after = stored["answer"], new["answer"]
    for name in ("verdict", "names"):
        if before[name] != after[name]:
            yield f"{_in_words(before[name])} → {_in_words(after[name])}"
    if abs(before.get("probability", 0.0) - after.get("probability", 0.0)) > _PROBABILITY:
        yield f"probability {before['probability']:.2f} → {after['probability']:.2f}"
    for quantity in _QUANTITIES:
        if _moved(before.get(quantity), after.get(quantity)):
            yield f"{quantity} {_interval(before.get(quantity))} → {_interval(after.get(quantity))}"
    earlier, later = before.get("parameters", {}), after.get("parameters", {})
    for name in [common for common in earlier if common in later]:
        if _moved(earlier[name], later[name]):
            yield f"{name} {_interval(earlier[name])} → {_interval(later[name])}"
    if before.get("quotable", False) != after.get("quotable", False):
        yield "quotable now" if after.get("quotable") else "no longer quotable"


def _moved(before: Sequence[float | None] | None, after: Sequence[float | None] | None) -> bool:
    if before is None or after is None:
        return before is not after
    _, low, high = before
    if low is None or high is None:
        return before != after
    allowed = _OF_INTERVAL * (high - low)
    pairs = zip(before, after, strict=True)
    return any(earlier is None or later is None or abs(earlier - later) > allowed for earlier, later in pairs)


def _interval(stated: Sequence[float | None] | None) -> str:
    if stated is None:
        return "not stated"
    value, low, high = stated
    return f"{value:g}" if low is None or high is None else f"{value:g} ({low:g} to {high:g})"


def _in_words(value: Any) -> str:
    return value if isinstance(value, str) else " + ".join(value) or "nothing"


def text(compared: Sequence[Compared]) -> str:
    """All changes by part, and a table of the parts in Markdown."""
    lines: list[str] = []
    for part in compared:
        changed = part.changed()
        if changed:
            lines.append(f"{part.part}: {len(changed)} of {len(part.pairs)} answers changed{_by_effect(changed)}")
        for stored, new in changed:
            hidden = _in_words(stored["truth"].get("effects", ()))
            graded = new["grade"] if stored["grade"] == new["grade"] else f"{stored['grade']} → {new['grade']}"
            lines.append(f"  {new['name']} ({hidden}; {graded}): {'; '.join(differences(stored, new))}")
    header = [
        *("part", "changed", "right", "open", "wrong", "better", "worse", "p"),
        *("error of probabilities (by chance)", "interval holds the truth", "processor time, s"),
    ]
    parts = table(header, [_row(part) for part in compared])
    slips = [f"\nSlips: {_slips(part)}." for part in compared if any("slips" in new["answer"] for _, new in part.pairs)]
    return "\n".join([*lines, *([""] if lines else []), parts, *slips])


def _slips(part: Compared) -> str:
    """The share of distinguishable slips that are named; and campaigns in which one is named without a slip."""
    stored, new = ([pair[index] for pair in part.pairs] for index in (0, 1))
    slip_counts = [
        [sum(line["answer"]["slips"][index] for line in lines) for index in (0, 1)] for lines in (stored, new)
    ]
    false = [_count(lines, WRONG) for lines in (stored, new)]
    named = " → ".join(percent(Share(*counts)) for counts in slip_counts)
    return f"named {named}; one named without a slip in {false[0]} → {false[1]} of {len(new)} campaigns"


def _by_effect(changed: Sequence[tuple[Line, Line]]) -> str:
    """Number of changes by hidden effect, the most frequent first."""
    counts = Counter(effect for stored, _ in changed for effect in stored["truth"].get("effects", ()))
    return f", by what is hidden: {', '.join(f'{name} {count}' for name, count in counts.most_common(6))}" * bool(
        counts
    )


def _row(part: Compared) -> list[str]:
    stored, new = ([pair[index] for pair in part.pairs] for index in (0, 1))
    grades = [[f"{_count(stored, grade)} → {_count(new, grade)}"] for grade in (RIGHT, OPEN, WRONG)]
    before, after = part.seconds
    return [
        part.part,
        f"{len(part.changed())} of {len(part.pairs)}",
        *(cell for cells in grades for cell in cells),
        str(part.better),
        f"{part.worse}{' (significant)' if part.is_worse else ''}",
        f"{part.p_value:.2g}",
        f"{_calibration(stored)} → {_calibration(new)}",
        f"{_held(stored)} → {_held(new)}",
        f"{before:.0f} → {after:.0f}",
    ]


def _count(lines: Sequence[Line], grade: str) -> int:
    return sum(line["grade"] == grade for line in lines)


def _calibration(lines: Sequence[Line]) -> str:
    """Expected calibration error of the stated probabilities, and the range that chance gives a calibrated tool."""
    stated = [line for line in lines if "probability" in line["answer"] and line["answer"]["verdict"] != "refused"]
    if not stated:
        return "–"
    calibrated = calibration(
        [line["answer"]["probability"] for line in stated], [line["grade"] == RIGHT for line in stated]
    )
    low, high = calibrated.chance_range
    return f"{calibrated.error:.3f} ({low:.3f}–{high:.3f})"


def _held(lines: Sequence[Line]) -> str:
    """How many of the stated intervals of d33 or E hold the true value, and of those that may be quoted."""
    held: list[bool] = []
    quoted: list[bool] = []
    for line in lines:
        for quantity in _QUANTITIES:
            true, stated = line["truth"].get(quantity), line["answer"].get(quantity)
            if true is None or stated is None or stated[1] is None or stated[2] is None:
                continue
            held.append(stated[1] <= true <= stated[2])
            quoted += [held[-1]] if line["answer"].get("quotable") else []
    return f"{percent(share(held))}; quotable {percent(share(quoted))}" if held else "–"
