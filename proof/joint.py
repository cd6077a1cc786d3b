"""Several kinds of recordings, several dates, several skins: what is told together, and what from the parts alone.

Joint campaigns of the virtual rig (`rig.joint`), each diagnosed together and from its parts: FRFs without the curves
beside them, the last date alone, each skin alone.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import underskin
from proof.ideal_fleet import departures
from proof.judge import answer
from proof.stored import Work, diagnosed, diagnosed_by, diagnosing, digest_of, of_each, sources, stored
from rig.joint import WHAT, drawn_joint, joint_campaigns

SEED, COUNT = 10610, 150
_VISIBLE = 20.0  # in χ²
_SURE = 0.8
_STATED = 0.5  # probability of a departure that is stated
_ERRORS = ("modulus_error", "thickness_error", "strain_stiffening")

Report = Mapping[str, Any]


def judge_joint(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Of each joint campaign what was hidden, and what is told together and apart."""
    cases = [(number, WHAT[number % len(WHAT)]) for number in range(min(work.count or COUNT, COUNT))]
    version = f"{diagnosing()} {sources('rig')}"
    return {"seed": SEED, "judged": of_each(work, cases, partial(_judged, work, version), progress)}


def _judged(work: Work, version: str, case: tuple[int, str]) -> dict[str, Any]:
    number, what = case
    key = digest_of(["joint", SEED, number, what, version])
    return stored(work.folder / "joint", key, partial(_one, number, what))


def _one(number: int, what: str) -> dict[str, Any]:
    documents, truth = drawn_joint(SEED, number, what)
    hidden = [entry for entry in truth["hidden"] if entry["identifiable"]]
    head = {"name": truth["name"], "what": what, "hidden": [entry["effect"] for entry in truth["hidden"]]}
    told = {"dates": _dates, "skins": _skins}.get(what, _kinds)(documents, truth, hidden)
    if what == "skins":
        ideal = departures(joint_campaigns(SEED, number, what))
        told["ideal"] = sorted(skin for skin, probability in ideal.items() if probability > _STATED)
    return {**head, **told}


def _kinds(documents: Sequence[dict[str, Any]], truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    (document,) = documents
    alone = {**document, "recordings": [one for one in document["recordings"] if one.get("kind", "frf") == "frf"]}
    both = {"together": diagnosed(document), "alone": diagnosed(alone)}
    expected = {entry["effect"] for entry in hidden}
    told_apart = {entry["effect"] for entry in hidden if (entry["chi2_gain_modulus_free"] or 0.0) > _VISIBLE} & set(
        _ERRORS
    )
    told_apart |= {entry["effect"] for entry in hidden if entry["effect"] == "modulus_error"}
    modulus = truth["documents"][0]["youngs_modulus_mpa"]
    kind = next(one["kind"] for one in document["recordings"] if one.get("kind", "frf") != "frf")
    stated = [
        entry
        for entry in both["together"].get("by_kind", ())
        if (entry["kind"], entry["parameter"]) == (kind, "youngs_modulus")
    ]
    return {
        "identifiable": bool(truth["skins"][0]["modulus_identifiable"]),
        "apart": sorted(told_apart),
        "right": {name: set(answer(report)) == expected for name, report in both.items()},
        "named": {name: sorted(told_apart & _present(report)) for name, report in both.items()},
        "answers": {name: [report["verdict"], list(answer(report))] for name, report in both.items()},
        "modulus_held": [bool(entry["low"] <= modulus <= entry["high"]) for entry in stated],
        "contradicted": bool(both["together"].get("contradictions")),
    }


def _present(report: Report) -> set[str]:
    """What is in every surviving set."""
    return {entry["mechanisms"][0] for entry in report.get("presence", ())
            if len(entry["mechanisms"]) == 1 and entry["probability"] >= _SURE}  # fmt: skip


def _together(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose_together(readings, "drawn joint")


def _fleet(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose_fleet({str(one.campaign.skin.id): [one] for one in readings}, "drawn joint")


def _campaign(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose(readings[0])


# How each kind of joint campaigns is diagnosed
DIAGNOSED = {"compression": _campaign, "indentation": _campaign, "dates": _together, "skins": _fleet}


def _dates(documents: Sequence[dict[str, Any]], _truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    together = diagnosed_by(_together, documents)
    changed = [entry for entry in hidden if entry["since"]]
    scopes = {entry["name"]: entry["scope"] for entry in together["mechanisms"]}
    expected = {entry["effect"] for entry in hidden}
    since = [entry["since"] in _dates_of(entry["effect"], together) for entry in changed]
    return {
        "right": {"together": set(scopes) == expected, "alone": set(answer(diagnosed(documents[-1]))) == expected},
        "since": since,
        "false": not changed and any("since" in scope for scope in scopes.values()),
        "answers": {"together": [together["verdict"], {name: scope.get("since") for name, scope in scopes.items()}]},
    }


def _dates_of(effect: str, together: Report) -> set[str | None]:
    """The dates since which it is said to be there, by itself or as one of the group that a change of level may be."""
    groups = [set(entry["mechanisms"]) for entry in together["presence"]]
    dates = set()
    for entry in together["mechanisms"]:
        stated = {entry["name"]}
        if "statement" in entry:
            stated = stated.union(
                *(group for group in groups if entry["name"] in group and "sensors" not in entry["scope"])
            )
        if effect in stated:
            dates.add(entry["scope"].get("since"))
    return dates


def _skins(documents: Sequence[dict[str, Any]], truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    fleet = diagnosed_by(_fleet, documents)
    hidden_in = {entry["departs"] for entry in truth["hidden"] if entry["departs"]}
    d33 = {entry["skin"]: entry for entry in next(
        (one["skins"] for one in fleet.get("population") or () if one["parameter"] == "d33"), [])}  # fmt: skip
    known = {entry["skin"]: next(iter(entry["d33_pc_per_n"].values())) for entry in truth["documents"]}
    return {
        "departs": sorted(hidden_in),
        "identifiable": sorted(entry["departs"] for entry in hidden if entry["departs"]),
        "stated": sorted(departing(fleet)),
        "d33_held": [d33[skin]["low"] <= value <= d33[skin]["high"] for skin, value in known.items() if skin in d33],
    }


def departing(fleet: Report) -> set[str]:
    """Skins, of one campaign each, that depart by the report: in a quantity, or by a mechanism that others lack."""
    stated = {one["skin"] for entry in fleet.get("population") or () for one in entry["departures"]}
    for entry in fleet["mechanisms"]:
        skins = entry.get("scope", {}).get("skins", ())
        if len(skins) < len(fleet.get("campaigns", ())):
            stated.update(skins)
    return stated
