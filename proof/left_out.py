"""Every mechanism excluded from the catalogue in turn: what the grammar of unlisted laws finds in campaigns that
hide it.

Campaigns of the virtual rig with one effect are diagnosed twice, with the complete catalogue and without the hidden
mechanism. A law has the right axis if the mechanism's effect depends on it, and the right quantity if it is one of the
mechanism's stage.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from proof.cases import DrawnCase
from proof.judge import unnamed_over_noise
from proof.names import distinct_names
from proof.own_rig import truth
from proof.stored import Work, diagnosed, diagnosing, digest_of, of_each, reports, sources, stored
from underskin.mechanisms.base import Stage
from underskin.mechanisms.registry import CATALOGUE

SEED, COUNT = 99092, 150
_ENTRIES: Mapping[Stage, tuple[str, ...]] = {
    Stage.DECLARED: ("modulus", "thickness"),
    Stage.MATERIAL: ("modulus",),
    Stage.POSITION: ("position",),
    Stage.CONTACT: ("contact_radius", "modulus"),
    Stage.LOAD_INCREMENT: ("gain",),
    Stage.SENSOR: ("gain",),
    Stage.NEIGHBOURS: ("gain",),
    Stage.RECORDING: ("gain",),
    Stage.LINES: ("frequency_response",),
}
_AXES: Mapping[str, tuple[str, ...]] = {  # of the grammar, that say the same as an axis of a mechanism
    "position_mm": ("x_mm", "y_mm", "sensor"),
    "phase": ("frequency_hz",),
    "load_cycles": ("load_cycles", "order", "recorded_at"),
}


def judge_left_out(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """For each campaign what was hidden, whether it is visible, and both diagnoses."""
    cases = [DrawnCase(SEED, number, "single") for number in range(min(work.count or COUNT, COUNT))]
    truths = of_each(work, cases, partial(truth, work, sources("rig")), _silent)
    shown = [
        (case, effect)
        for case, case_truth in zip(cases, truths, strict=True)
        for effect in distinct_names(case_truth["effects"])
        if case_truth["identifiable"] and effect in CATALOGUE
    ]
    full_reports = reports(work, [case for case, _ in shown], _silent)
    without = of_each(work, shown, partial(_without, work, diagnosing()), progress)
    return {
        "drawn": len(cases),
        "judged": [
            {"name": case.name, "hidden": hidden, **compared(hidden, named, unnamed)}
            for (case, hidden), named, unnamed in zip(shown, full_reports, without, strict=True)
        ],
    }


def _silent(done: int, total: int) -> None:
    """The bar is that of the diagnoses without a mechanism."""


def _without(work: Work, version: str, case: tuple[DrawnCase, str]) -> dict[str, Any]:
    drawn, hidden = case
    document = drawn.document()
    key = digest_of([document, version, "without", hidden])
    return stored(work.folder / "reports", key, partial(diagnosed, document, (hidden,)))


def compared(hidden: str, named: Mapping[str, Any], unnamed: Mapping[str, Any]) -> dict[str, Any]:
    """The quantity and the axis of the law; and held-out errors over the noise of the held-out data.

    Laws are held out in thirds along their axis, mechanisms by the largest groups, so only multiples of the noise can
    be compared.
    """
    law = unnamed.get("unnamed")
    mechanism = CATALOGUE[hidden]
    follows = {axis for axis_name in mechanism.axes for axis in _AXES.get(axis_name, (axis_name,))}
    return {
        "verdict": unnamed["verdict"],
        "named_instead": [mechanism_named["name"] for mechanism_named in unnamed["mechanisms"]],
        "law": None if law is None else {key: law[key] for key in ("acts_on", "axis", "form")},
        "axis_right": law is not None and law["axis"] in follows,
        "entry_right": law is not None and law["acts_on"] in _ENTRIES.get(mechanism.stage, ()),
        "unnamed_over_noise": unnamed_over_noise(unnamed),
        "instead_over_noise": _over_noise(unnamed["fit"]) if law is None and unnamed["mechanisms"] else None,
        "named_over_noise": _over_noise(named["fit"]),
        "before_over_noise": _over_noise(unnamed["fit"], "before"),
    }


def _over_noise(fit: Mapping[str, Any] | None, when: str = "after") -> float | None:
    if not fit or not fit["noise_floor_percent"] or fit[when]["heldout_rmse_percent"] is None:
        return None
    return float(fit[when]["heldout_rmse_percent"] / fit["noise_floor_percent"])
