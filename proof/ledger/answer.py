"""The answer of a report in the ledger's form, and its grade: `right`, `open` or `wrong`."""

from collections.abc import Collection, Mapping
from typing import Any

from proof.judge import UNKNOWN
from proof.names import distinct_names
from rig.identifiable import THRESHOLD

Report = Mapping[str, Any]
RIGHT, OPEN, WRONG = "right", "open", "wrong"
GRADES = (WRONG, OPEN, RIGHT)  # from bad to good

_DIGITS = 4


def named(report: Report) -> list[str]:
    """The leading set of mechanisms; of `unexplained` the unlisted law and its companions; slips by their codes."""
    if "slips" in report:
        return sorted([*report["false"], *(slip for slip, of_slip in report["slips"].items() if of_slip["named"])])
    names = sorted(mechanism["name"] for mechanism in report["mechanisms"])
    law = report.get("unnamed")
    if report["verdict"] == "unexplained":
        names.append("unlisted" if law is None else f"unlisted: {law['acts_on']} over {law['axis']}, {law['form']}")
    return names


def answer(report: Report) -> dict[str, Any]:
    """Verdict, set, probability, the d33 or modulus that is stated, and the set's parameters, with 95 % intervals."""
    stated = {"verdict": report.get("verdict", "slips"), "names": named(report)}
    if "slips" in report:
        return {**stated, "slips": distinguishable_slips(report)}
    fit = report.get("fit") or {}
    quantity, value = "d33", report.get("d33")
    if not value or value.get("value") is None:
        quantity, value = "youngs_modulus", (fit.get("after") or {}).get("youngs_modulus")
    stated["probability"] = report["probability"]
    if value and value.get("value") is not None:
        stated[quantity] = [_rounded(value.get(end)) for end in ("value", "low", "high")]
        stated["quotable"] = bool(value.get("quotable", report["verdict"] in ("explained", "no_mismatch")))
    parameters = {
        f"{mechanism['name']}.{entry['name']}": [_rounded(entry[end]) for end in ("value", "low", "high")]
        for mechanism in report["mechanisms"]
        for entry in mechanism.get("parameters", ())
    }
    return {**stated, "parameters": parameters} if parameters else stated


def distinguishable_slips(report: Report) -> list[int]:
    """Of the slips that can be distinguished from other causes, how many are named, and how many there are."""
    identifiable = [of_slip["named"] for of_slip in report["slips"].values() if of_slip["over_rivals"] > THRESHOLD]
    return [sum(identifiable), len(identifiable)]


def graded(report: Report, effects: Collection[str], shows: Collection[str]) -> str:
    """Right: a set with all visible effects and none that is not hidden. Open: an `ambiguous` answer with a right
    set among its alternatives, or no conclusion although something is visible."""
    hidden, seen = _merged(effects), _merged(shows)

    def is_right(names: Collection[str]) -> bool:
        return seen <= _merged(names) <= hidden

    verdict = report["verdict"]
    if verdict == "unexplained":
        return RIGHT if UNKNOWN in hidden else WRONG
    stated = [mechanism["name"] for mechanism in report["mechanisms"]]
    if is_right(stated):
        return OPEN if verdict == "insufficient_data" and hidden else RIGHT
    rivals = [_of_rival(alternative["mechanisms"]) for alternative in report.get("alternatives", ())]
    is_ambiguous = verdict == "ambiguous" and any(is_right(names) for names in rivals)
    return OPEN if is_ambiguous or verdict == "insufficient_data" else WRONG


def _of_rival(names: Collection[str]) -> list[str]:
    """A rival set: `nothing_missing` is the empty one, `none_of_these` is what is in no catalogue."""
    effects_of = {"nothing_missing": [], "none_of_these": [UNKNOWN]}
    return [effect for name in names for effect in effects_of.get(name, [name])]


def _merged(names: Collection[str]) -> set[str]:
    return set(distinct_names(names))


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")
