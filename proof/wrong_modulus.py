"""A declared Young's modulus that is wrong by a factor of 2 to 4: whether it is named, and how well it is found.

Campaigns of the virtual rig (`rig.wrong_modulus`). The error is *named or grouped* where `modulus_error` is in the
leading set, or in a group of `presence` that holds at least 80 %. Its factor is to be found within 10 % where the
design determines E: where the standard deviation of ln E by the rig's equations is below 5 %, on the FRFs alone, or
where a block or indentations are beside them.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from proof.judge import answer
from proof.stored import Work, diagnosed, diagnosing, digest_of, of_each, sources, stored
from rig.effects import FRF
from rig.wrong_modulus import drawn_wrong_modulus

SEED, COUNT = 29736, 80
_ERROR = "modulus_error"
_VISIBLE = 20.0  # in χ²
_SURE = 0.8
_DETERMINED = 0.05  # standard deviation of ln E
_OUT_OF_DOMAIN, _CONTACTS_KEPT = "out_of_domain", "contacts_kept"

Report = Mapping[str, Any]


def judge_wrong_modulus(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """For each campaign the declared modulus, the answer, and its error."""
    numbers = range(min(work.count or COUNT, COUNT))
    version = f"{diagnosing()} {sources('rig')}"
    return {"seed": SEED, "judged": of_each(work, list(numbers), partial(_judged, work, version), progress)}


def _judged(work: Work, version: str, number: int) -> dict[str, Any]:
    key = digest_of(["wrong modulus", SEED, number, version])
    return stored(work.folder / "wrong_modulus", key, partial(judged_campaign, SEED, number))


def judged_campaign(seed: int, number: int) -> dict[str, Any]:
    """One campaign, diagnosed and judged."""
    document, truth = drawn_wrong_modulus(seed, number)
    return {"name": truth["name"], **compared(diagnosed(document), truth)}


def compared(report: Report, truth: Report) -> dict[str, Any]:
    """A report beside the truth of a campaign whose declared modulus is wrong."""
    (gain,) = (
        hidden_effect["chi2_gain_joint"] for hidden_effect in truth["hidden"] if hidden_effect["effect"] == _ERROR
    )
    sd = truth["documents"][0]["sd_ln_modulus_frf"]
    found = _reported_error(report)
    d33, beyond = report["d33"], _beyond(truth["as_declared"])
    return {
        "what": truth["what"],
        "factor": truth["factor"],
        "companions": [
            hidden_effect["effect"] for hidden_effect in truth["hidden"] if hidden_effect["effect"] != _ERROR
        ],
        "visible": gain is None or gain > _VISIBLE,  # None: the rig cannot calculate contacts as declared
        "determined": sd < _DETERMINED or truth["what"] != FRF,
        "sd_ln_modulus": truth["skins"][0]["sd_ln_modulus_joint"],
        "answer": [report["verdict"], list(answer(report))],
        "named": found is not None,
        "grouped": any(_ERROR in group["mechanisms"] and group["probability"] >= _SURE for group in report["presence"]),
        "found": found,
        "held": found is not None and found["low"] <= truth["factor"] <= found["high"],
        "off": None if found is None else abs(math.log(found["value"] / truth["factor"])),
        "beyond": beyond,
        "left_out": _contacts_excluded(report, beyond),
        "recordings": len(truth["as_declared"]["a_over_h"]),
        "d33_off": None if d33 is None else abs(math.log(d33["value"] / _d33(truth))),
        "d33_quotable": d33 is not None and d33["quotable"],
    }


def _contacts_excluded(report: Report, beyond: int) -> int:
    """How many of the contacts `beyond` the tables as declared were excluded: all, if the report does not say that
    some were kept; else those that it names."""
    findings = report["findings"]
    named = sum(finding["code"] == _OUT_OF_DOMAIN and "left out" in finding["statement"] for finding in findings)
    return min(beyond, named) if any(finding["code"] == _CONTACTS_KEPT for finding in findings) else beyond


def _reported_error(report: Report) -> dict[str, Any] | None:
    """The factor as a report states it."""
    parameters = [
        parameter
        for mechanism in report["mechanisms"]
        if mechanism["name"] == _ERROR
        for parameter in mechanism["parameters"]
    ]
    return dict(parameters[0]) if parameters else None


def _beyond(contacts: Mapping[str, list[float]]) -> int:
    """How many contacts are beyond the tables by the declared modulus."""
    from underskin.surrogate.sigma_table import load_table

    domain = load_table().domain
    largest = [domain[name][1] for name in ("a_over_h", "load_parameter")]
    contact_values = zip(contacts["a_over_h"], contacts["load_parameter"], strict=True)
    return sum(radius > largest[0] or load > largest[1] for radius, load in contact_values)


def _d33(truth: Report) -> float:
    """The geometric mean of the sensors'."""
    values = list(truth["documents"][0]["d33_pc_per_n"].values())
    return math.exp(math.fsum(map(math.log, values)) / len(values))
