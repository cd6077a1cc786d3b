"""The page's section on raw indentation curves of this project's rig."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proof import own_curves
from proof.concealed import judged_of
from proof.judge import QUIET, Judged
from proof.markdown import table
from proof.phrases import median_of, misses, percent, right
from proof.statistics import Share, calibration, chance_of_so_few, share

Result = Mapping[str, Any]
_SURE = 0.9
_FAR = 3.0  # times the noise: an error held out
_KINDS = ("single", "pair", "unknown")


def curves(result: Result) -> str:
    """Of the campaigns that hide something."""
    judged = judged_of(result)
    visible = [judgement for judgement in judged if judgement.one_visible]
    both = [judgement for judgement in judged if judgement.visible]
    rows = [
        [
            kind,
            str(sum(judgement.kind == kind for judgement in judged)),
            *(_right(part, kind) for part in (visible, both)),
        ]
        for kind in _KINDS
    ]
    rows.append(["all", str(len(judged)), right(visible), right(both)])
    header = ["hidden", "drawn", "right, of the identifiable", "right, where each member is"]
    return f"""\
## Raw curves of our own rig

{len(judged)} of {own_curves.MIXTURE} campaigns of raw indentation curves (seed {own_curves.SEED}): air, snap-in, hold,
way back and pull-off, on the µm and the mm scale, with strengths, noise and laws of the rig's own (docs/rig.md).
*Identifiable* is what gains more than the rig's threshold in χ² over Hertz' law, both fitted by plain least squares
under the rig's noise, with the modulus free and a contact point, a force zero and a drift for each curve; beside it, a
pair of which each member does.

{table(header, rows)}
{_sure({"identifiable": visible, "all": judged})}

{_calibration(visible)}

{_values(result, judged)}
{_over_the_floor(judged)}

### Every miss on raw curves

{misses(judged)}"""


def quiet_curves(result: Result) -> str:
    """Of the campaigns that hide nothing."""
    judged = judged_of(result)
    alarms = [judgement for judgement in judged if judgement.verdict not in QUIET]
    return f"""\
### False alarms on raw curves

{len(judged)} of {own_curves.QUIET} campaigns of raw curves with nothing missing (seed {own_curves.SEED + 1}): a
verdict other than `no_mismatch` or `insufficient_data` in {percent(Share(len(alarms), len(judged)))}.

{_sure({"nothing missing": judged})}

{misses(alarms) if alarms else ""}"""


def _right(judged: Sequence[Judged], kind: str) -> str:
    return right([judgement for judgement in judged if judgement.kind == kind])


def _sure(parts: Mapping[str, Sequence[Judged]]) -> str:
    """How often answers stated with more than 0.9 are right, and how probable it is that so few are."""
    rows = []
    for words, judged in parts.items():
        sure = [judgement for judgement in judged if judgement.probability > _SURE]
        if sure:
            stated = [judgement.probability for judgement in sure]
            chance = chance_of_so_few(stated, sum(judgement.right for judgement in sure))
            rows.append([words, f"{np.mean(stated):.3f}", right(sure), f"{chance:.3f}"])
    header = [f"stated with more than {_SURE:g}", "mean stated", "right", "so few or fewer by chance"]
    return table(header, rows) if rows else ""


def _calibration(judged: Sequence[Judged]) -> str:
    if not judged:
        return ""
    result = calibration([judgement.probability for judgement in judged], [judgement.right for judgement in judged])
    low, high = result.chance_range
    return (
        f"Expected calibration error of the identifiable: {result.error:.3f}; a perfectly calibrated tool would have "
        f"{low:.3f} to {high:.3f}."
    )


def _over_the_floor(judged: Sequence[Judged]) -> str:
    """How errors held out compare with noise where a law is named rightly."""
    named = [
        judgement.held_out
        for judgement in judged
        if judgement.right and judgement.kind in ("single", "pair") and judgement.held_out
    ]
    ratios = [error / floor for error, floor in named if floor > 0]
    if not ratios:
        return ""
    far = percent(share([ratio > _FAR for ratio in ratios]))
    return f"Error held out over the noise, of laws named rightly: median {median_of(ratios)}; above {_FAR:g} in {far}."


def _values(result: Result, judged: Sequence[Judged]) -> str:
    """How far modulus and work of adhesion are off where the answer is right, and how often their intervals hold."""
    rows = []
    for words, name, true in (
        ("modulus, adhesion named", "youngs_modulus", _modulus_where_it_sticks),
        ("work of adhesion", "work_of_adhesion", _work),
        ("modulus, all right answers", "youngs_modulus", _modulus),
    ):
        errors, held = [], []
        for judgement, truth, stated in zip(judged, result["truths"], result["stated"], strict=True):
            value, true_value = stated[name], true(truth)
            if judgement.right and value is not None and true_value is not None:
                errors.append(100 * abs(value["value"] / true_value - 1))
                held.append(value["low"] <= true_value <= value["high"])
        if errors:
            rows.append([words, str(len(errors)), median_of(errors), percent(share(held))])
    if not rows:
        return ""
    header = ["value, where the answer is right", "campaigns", "median error, %", "95 % interval holds the truth"]
    return table(header, rows)


def _modulus(truth: Result) -> float | None:
    return float(truth["youngs_modulus_mpa"]) if "unknown" not in truth["effects"] else None


def _modulus_where_it_sticks(truth: Result) -> float | None:
    return _modulus(truth) if "adhesion" in truth["effects"] else None


def _work(truth: Result) -> float | None:
    return float(truth["parameters"]["adhesion"]["work_j_per_m2"]) if "adhesion" in truth["effects"] else None
