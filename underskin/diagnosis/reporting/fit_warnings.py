"""Findings on the stated explanation itself: what in its fit should not be taken at face value."""

import numpy as np

from underskin.diagnosis.data.names import SIMPLEST, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.reporting.at_bounds import at_bounds
from underskin.diagnosis.validation.residual_noise import NOISY
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.unnamed.curve_laws import CurveLaw
from underskin.mechanisms.unnamed.laws import in_plain_words

# With depth, as a layer on a stiff base does
_STIFFENS = ("strain_stiffening", "compressible_layer", "layered_contact")


def fit_warnings(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """Parameters at their bounds, recordings beyond the tables as found or as declared, noise that is larger than the
    lines' own, and a thickness that only the curves tell."""
    found = [
        *(one.finding for one in at_bounds(explanation)),
        *_beyond_tables(problem, explanation),
        *_noisy(problem, explanation),
    ]
    return [*found, *_kept(problem, explanation), *_of_unknown_thickness(problem, explanation)]


def _beyond_tables(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    best = explanation.best
    outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
    known = [in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names]
    answer = in_words(known) or SIMPLEST[problem.kind]
    entries = problem.lines.campaign.recordings
    return [
        Finding(Reason.OUT_OF_TABLES_FITTED, entries[number].id, "preload_n", {"answer": answer})
        for number in outside.tolist()
    ]


def _kept(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """On contacts that lie within the tables as found, and beyond them as declared."""
    if problem.kind != "frf":
        return []
    best, skin = explanation.best, problem.lines.campaign.skin
    kept = np.unique(best.hypothesis.lines.recording[best.prediction.inside & ~explanation.model.valid])
    if not len(kept):
        return []
    assert skin.youngs_modulus_mpa is not None
    fit = dict(zip([entry.name for entry in explanation.model.parameters], explanation.point.fit, strict=True))
    found_mpa = None
    if "modulus_factor" in fit:
        found_mpa = skin.youngs_modulus_mpa * float(np.exp(fit["modulus_factor"] + fit["youngs_modulus"]))
    arguments = {
        "contacts": len(kept),
        "recordings": problem.lines.recordings,
        "declared_mpa": skin.youngs_modulus_mpa,
        "found_mpa": found_mpa,
        "answer": in_words([in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names]),
    }
    return [Finding(Reason.CONTACTS_KEPT, "", "skin.youngs_modulus_mpa", arguments)]


def _noisy(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    level = explanation.best.levels.level
    if problem.lines.curves or level < NOISY:
        return []
    return [Finding(Reason.LINE_NOISE_LEVEL, "", "frf_re_pc_per_n", {"level": level})]


def _of_unknown_thickness(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    if problem.kind != "indentation" or problem.lines.campaign.skin.thickness_mm is not None:
        return []
    mechanisms = [problem.lines.mechanisms[name] for name in explanation.names]
    alike = [one for one in mechanisms if one.name in _STIFFENS or _of_depth(one)]
    if not alike:
        return []
    answer = in_words([in_plain_words(one) for one in alike])
    is_tried = "layered_contact" in problem.lines.mechanisms.named
    return [Finding(Reason.THICKNESS_UNKNOWN, "", "thickness_mm", {"answer": answer, "is_tried": is_tried})]


def _of_depth(mechanism: Mechanism) -> bool:
    return isinstance(mechanism, CurveLaw) and mechanism.spoken.axis in ("displacement_mm", "force_n")
