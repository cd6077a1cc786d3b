"""The page's section on several kinds, dates and skins."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share

Result = Mapping[str, Any]


WITH_CURVES = ("compression", "indentation")


def distinguished(entries: Sequence[Result], how: str) -> list[bool]:
    """Of campaigns that hide an error of E, of h or stiffening, identifiable, whether each is told apart `how`: from
    the FRFs `alone`, or `together` with curves."""
    return [
        judgement["named"][how] == judgement["apart"]
        for judgement in entries
        if judgement["apart"] and judgement["identifiable"]
    ]


def joint(result: Result) -> str:
    """Of joint campaigns what is told together and apart."""
    judged = result["judged"]
    kinds = [judgement for judgement in judged if judgement["what"] in WITH_CURVES]
    dates = [judgement for judgement in judged if judgement["what"] == "dates"]
    skins = [judgement for judgement in judged if judgement["what"] == "skins"]
    return f"""\
## Kinds, dates and skins together

{len(judged)} joint campaigns of the virtual rig (`proof/joint.py`, seed {result["seed"]}), with wider tails than its
other campaigns: scatter of gain 0.5 to 8 %, of places 0 to 0.5 mm, a declared modulus off by factors of 0.25 to 4.
*Hidden* is what gains more than 20 in χ² together. E, h and stiffening are *told apart* where the error or the
stiffening itself is present with at least 80 % in no group with another mechanism; those that hide one which the rig's
own equations tell from an error of E are counted.

{_of_kinds(kinds)}
{_of_dates(dates)}
{_of_skins(skins)}"""


def _of_kinds(entries: Sequence[Result]) -> str:
    rows = []
    for what, called in zip(
        (WITH_CURVES[:1], WITH_CURVES[1:], WITH_CURVES),
        ("FRFs and a block", "FRFs and indentations", "both"),
        strict=True,
    ):
        of_these = [judgement for judgement in entries if judgement["what"] in what]
        row = [called, str(len(of_these))]
        for how in ("alone", "together"):
            row += [_of([judgement["right"][how] for judgement in of_these]), _of(distinguished(of_these, how))]
        held = [is_held for judgement in of_these for is_held in judgement["modulus_held"]]
        rows.append([*row, _of(held), str(sum(judgement["contradicted"] for judgement in of_these))])
    heads = ["right, FRFs alone", "told apart, FRFs alone", "right, together", "told apart, together"]
    head = ["kinds", "campaigns", *heads, "E of the curves held by its interval", "said to contradict"]
    return table(head, rows)


def _of_dates(entries: Sequence[Result]) -> str:
    since = [is_right for judgement in entries for is_right in judgement["since"]]
    quiet = [judgement["false"] for judgement in entries if not judgement["since"]]
    return (
        f"Of {len(entries)} pairs of dates the set of mechanisms is right together in "
        f"{_of([judgement['right']['together'] for judgement in entries])}, from the last date alone in "
        f"{_of([judgement['right']['alone'] for judgement in entries])}; what changed is named with its date, a change "
        f"of level as one of the mechanisms that would make it, in {_of(since)}; "
        f"where nothing that shows changed, a change is stated in {_of(quiet)}.\n"
    )


def _of_skins(entries: Sequence[Result]) -> str:
    """An ideal diagnosis that owns the rig's equations names the departing skin too, or not: `ideal`."""
    odd = [judgement for judgement in entries if judgement["departs"]]
    named = [set(judgement["departs"]) <= set(judgement["stated"]) for judgement in odd]
    visible = [is_named for judgement, is_named in zip(odd, named, strict=True) if judgement["identifiable"]]
    decidable = [set(judgement["departs"]) <= set(judgement["ideal"]) for judgement in odd]
    ideal = [is_named for is_named, able in zip(named, decidable, strict=True) if able]
    false = [bool(set(judgement["stated"]) - set(judgement["departs"])) for judgement in entries]
    held = [is_held for judgement in entries for is_held in judgement["d33_held"]]
    return (
        f"Of {len(entries)} fleets of three to six skins {len(odd)} have one that departs in E, thickness or d33. It "
        f"is named in {_of(visible)} of those in which that shows. An ideal diagnosis, which owns the rig's equations "
        f"and noise but not the make's mean and spread, names {_of(decidable)} of all; of these the departing skin is "
        f"named in {_of(ideal)}. Another skin is said to depart in {_of(false)} of the fleets; the pooled d33 is held "
        f"by its interval in {_of(held)}.\n"
    )


def _of(values: Sequence[bool]) -> str:
    return percent(share(values)) if values else "–"
