"""Several kinds of recordings, several dates, several skins: results from all data together and from the parts.

Joint campaigns of the virtual rig (`rig.joint`), each diagnosed together and from its parts: FRFs without the curves,
the last date only, each skin by itself.
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
    """For each joint campaign what was hidden, and the results from all data and from the parts."""
    cases = [(number, WHAT[number % len(WHAT)]) for number in range(min(work.count or COUNT, COUNT))]
    version = f"{diagnosing()} {sources('rig')}"
    return {"seed": SEED, "judged": of_each(work, cases, partial(_judged, work, version), progress)}


def _judged(work: Work, version: str, case: tuple[int, str]) -> dict[str, Any]:
    number, what = case
    key = digest_of(["joint", SEED, number, what, version])
    return stored(work.folder / "joint", key, partial(_judged_answer, number, what))


def _judged_answer(number: int, what: str) -> dict[str, Any]:
    documents, truth = drawn_joint(SEED, number, what)
    hidden = [effect for effect in truth["hidden"] if effect["identifiable"]]
    head = {"name": truth["name"], "what": what, "hidden": [effect["effect"] for effect in truth["hidden"]]}
    judgement = {"dates": _dates, "skins": _skins}.get(what, _kinds)(documents, truth, hidden)
    if what == "skins":
        ideal = departures(joint_campaigns(SEED, number, what))
        judgement["ideal"] = sorted(skin for skin, probability in ideal.items() if probability > _STATED)
    return {**head, **judgement}


def _kinds(documents: Sequence[dict[str, Any]], truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    (document,) = documents
    frf_document = {
        **document,
        "recordings": [recording for recording in document["recordings"] if recording.get("kind", "frf") == "frf"],
    }
    both = {"together": diagnosed(document), "alone": diagnosed(frf_document)}
    expected = {hidden_effect["effect"] for hidden_effect in hidden}
    distinguishable = {
        hidden_effect["effect"]
        for hidden_effect in hidden
        if (hidden_effect["chi2_gain_modulus_free"] or 0.0) > _VISIBLE
    } & set(_ERRORS)
    distinguishable |= {
        hidden_effect["effect"] for hidden_effect in hidden if hidden_effect["effect"] == "modulus_error"
    }
    modulus = truth["documents"][0]["youngs_modulus_mpa"]
    kind = next(recording["kind"] for recording in document["recordings"] if recording.get("kind", "frf") != "frf")
    stated = [
        of_kind
        for of_kind in both["together"].get("by_kind", ())
        if (of_kind["kind"], of_kind["parameter"]) == (kind, "youngs_modulus")
    ]
    return {
        "identifiable": bool(truth["skins"][0]["modulus_identifiable"]),
        "apart": sorted(distinguishable),
        "right": {name: set(answer(report)) == expected for name, report in both.items()},
        "named": {name: sorted(distinguishable & _present(report)) for name, report in both.items()},
        "answers": {name: [report["verdict"], list(answer(report))] for name, report in both.items()},
        "modulus_held": [bool(interval["low"] <= modulus <= interval["high"]) for interval in stated],
        "contradicted": bool(both["together"].get("contradictions")),
    }


def _present(report: Report) -> set[str]:
    """The mechanisms that are in every surviving set."""
    return {group["mechanisms"][0] for group in report.get("presence", ())
            if len(group["mechanisms"]) == 1 and group["probability"] >= _SURE}  # fmt: skip


def _together(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose_together(readings, "drawn joint")


def _fleet(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose_fleet({str(reading.campaign.skin.id): [reading] for reading in readings}, "drawn joint")


def _campaign(readings: Sequence[underskin.Reading]) -> underskin.Report:
    return underskin.diagnose(readings[0])


# How each kind of joint campaigns is diagnosed
DIAGNOSED = {"compression": _campaign, "indentation": _campaign, "dates": _together, "skins": _fleet}


def _dates(documents: Sequence[dict[str, Any]], _truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    together = diagnosed_by(_together, documents)
    changed = [hidden_effect for hidden_effect in hidden if hidden_effect["since"]]
    scopes = {mechanism["name"]: mechanism["scope"] for mechanism in together["mechanisms"]}
    expected = {hidden_effect["effect"] for hidden_effect in hidden}
    since = [hidden_effect["since"] in _dates_of(hidden_effect["effect"], together) for hidden_effect in changed]
    return {
        "right": {"together": set(scopes) == expected, "alone": set(answer(diagnosed(documents[-1]))) == expected},
        "since": since,
        "false": not changed and any("since" in scope for scope in scopes.values()),
        "answers": {"together": [together["verdict"], {name: scope.get("since") for name, scope in scopes.items()}]},
    }


def _dates_of(effect: str, together: Report) -> set[str | None]:
    """The dates from which the effect is stated to act, by itself or as one of a group that may explain a change of
    level."""
    groups = [set(surviving_group["mechanisms"]) for surviving_group in together["presence"]]
    dates = set()
    for mechanism in together["mechanisms"]:
        stated = {mechanism["name"]}
        if "statement" in mechanism:
            stated = stated.union(
                *(group for group in groups if mechanism["name"] in group and "sensors" not in mechanism["scope"])
            )
        if effect in stated:
            dates.add(mechanism["scope"].get("since"))
    return dates


def _skins(documents: Sequence[dict[str, Any]], truth: Report, hidden: Sequence[Report]) -> dict[str, Any]:
    fleet = diagnosed_by(_fleet, documents)
    hidden_in = {hidden_effect["departs"] for hidden_effect in truth["hidden"] if hidden_effect["departs"]}
    populations = fleet.get("population") or ()
    values: list[Report] = next(
        (population["skins"] for population in populations if population["parameter"] == "d33"), []
    )
    d33 = {value["skin"]: value for value in values}
    true_d33 = {document["skin"]: next(iter(document["d33_pc_per_n"].values())) for document in truth["documents"]}
    return {
        "departs": sorted(hidden_in),
        "identifiable": sorted(hidden_effect["departs"] for hidden_effect in hidden if hidden_effect["departs"]),
        "stated": sorted(departing(fleet)),
        "d33_held": [d33[skin]["low"] <= value <= d33[skin]["high"] for skin, value in true_d33.items() if skin in d33],
    }


def departing(fleet: Report) -> set[str]:
    """Skins, of one campaign each, that depart according to the report: in a quantity, or by a mechanism that others
    lack."""
    stated = {
        departure["skin"] for population in fleet.get("population") or () for departure in population["departures"]
    }
    for mechanism in fleet["mechanisms"]:
        skins = mechanism.get("scope", {}).get("skins", ())
        if len(skins) < len(fleet.get("campaigns", ())):
            stated.update(skins)
    return stated
