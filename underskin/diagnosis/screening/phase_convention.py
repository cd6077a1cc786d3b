"""FRFs whose phase is in the other sign convention, e^(−iωt): conjugated, in some recordings or in all.

Of some: the courses φ_i of phase over frequency are ±1 times one course φ. The signs q_i that align them are those that
maximise T(q) = |Σ q_i w_i φ_i|²/Σ w_i, in units of noise, and are believed where T(q) − T(1) exceeds what choosing k
of n signs costs. Of all: the mean course is far from every causal one (`phase_course`), and conjugated it is not.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import comb, log

import numpy as np

from underskin.diagnosis.screening.phase_course import PhaseCourses, misfit, phase_courses
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Complexes, Floats

_LEAST = 3  # recordings that tell a phase, for some of them to contradict the others
_LARGEST = 0.7  # rad: a sharp resonance, at its own place in each recording, weighs no more
_LEAST_PHASE = 5e-3  # rad, root mean square: a channel's own phase may be as large, and no convention shows
_GAIN, _COST = 20.0, 5.5  # of T, and per ln of the number of choices
_PLAIN, _BETTER = 25.0, 0.5  # χ² by which the conjugated course is nearer to a causal one, and its share of the other


def in_one_convention(entries: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with conjugated ones put right, and the finding on them."""
    courses = phase_courses(entries)
    if not courses.telling.any():
        return list(entries), []
    signs = _aligned(courses)
    orientation = _orientation(courses, signs)
    if orientation == 0:  # both may be: most recordings decide
        orientation = 1 if (signs < 0).sum() <= (signs > 0).sum() else -1
    turned = orientation * signs < 0
    if not turned.any():
        return list(entries), []
    ids = [entry.id for entry, wrong in zip(entries, turned, strict=True) if wrong]
    if turned[courses.telling].all():
        turned = np.ones(len(entries), dtype=bool)
        finding = Finding(Reason.ALL_CONJUGATED, "", "frf_im_pc_per_n")
    else:
        arguments = {"conjugated": ids, "recordings": len(entries)}
        finding = Finding(Reason.RECORDINGS_CONJUGATED, ids[0] if len(ids) == 1 else "", "frf_im_pc_per_n", arguments)
    return [_conjugated(entry) if wrong else entry for entry, wrong in zip(entries, turned, strict=True)], [finding]


def _aligned(courses: PhaseCourses) -> Floats:
    """±1 of each recording (recordings,), all 1 where nothing contradicts; 0 where it tells no phase."""
    telling = courses.telling
    same = telling.astype(float)
    if telling.sum() < _LEAST:
        return same
    phase, weight = _phases(courses)
    signs = _leading_signs(phase, weight) * same
    for _ in range(10):
        better = np.where(_along(phase, weight, _mean(phase, weight, signs)) < 0, -1.0, 1.0) * same
        if (better == signs).all():
            break
        signs = better
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    gain = _explained(phase, weight, signs) - _explained(phase, weight, same)
    if fewer == 0 or gain < _GAIN + _COST * log(comb(int(telling.sum()), fewer)):
        return same
    if _explained(phase, weight, signs) < _LEAST_PHASE**2 * (weight * np.abs(signs)[:, None]).sum():
        return same
    return signs


def _orientation(courses: PhaseCourses, signs: Floats) -> int:
    """1 where the aligned course is causal and its conjugate is not, −1 where the conjugate is, 0 where both may be."""
    value, deviation = _mean_course(courses, signs)
    given = misfit(courses.frequency, value, deviation)
    turned = misfit(courses.frequency, value.conj(), deviation)
    if given - turned > _PLAIN and turned < _BETTER * given:
        return -1
    return 1 if turned - given > _PLAIN and given < _BETTER * turned else 0


def _mean_course(courses: PhaseCourses, signs: Floats) -> tuple[Complexes, Floats]:
    """The mean of the aligned courses, and its deviation: the recordings' own noise, or their scatter if larger."""
    aligned = np.where(signs[:, None] < 0, courses.value.conj(), courses.value)
    known = np.isfinite(aligned) & np.isfinite(courses.deviation)
    weight = np.where(known, courses.deviation, np.inf) ** -2.0
    aligned = np.where(known, aligned, 0.0)
    total = weight.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (weight * aligned).sum(axis=0) / total
        own = total**-0.5
        scatter = np.sqrt((weight * (aligned - mean).imag ** 2).sum(axis=0) / total / known.sum(axis=0))
    return mean, np.maximum(own, scatter)


def _phases(courses: PhaseCourses) -> tuple[Floats, Floats]:
    """Phase and weight (recordings, bands) [rad, rad⁻²], 0 where there is none."""
    known = np.isfinite(courses.value) & np.isfinite(courses.deviation) & courses.followed
    phase = np.clip(np.where(known, courses.value, 0).imag, -_LARGEST, _LARGEST)
    return phase, np.where(known, courses.deviation, np.inf) ** -2.0


def _leading_signs(phase: Floats, weight: Floats) -> Floats:
    left, _, _ = np.linalg.svd(phase * np.sqrt(weight), full_matrices=False)
    return np.where(left[:, 0] * np.sign(left[:, 0].sum() or 1.0) < 0, -1.0, 1.0)


def _mean(phase: Floats, weight: Floats, signs: Floats) -> Floats:
    total = (weight * np.abs(signs)[:, None]).sum(axis=0)
    return np.asarray((signs[:, None] * weight * phase).sum(axis=0) / np.where(total > 0, total, 1.0))


def _along(phase: Floats, weight: Floats, course: Floats) -> Floats:
    return np.asarray((weight * phase * course).sum(axis=1))


def _explained(phase: Floats, weight: Floats, signs: Floats) -> float:
    """T(q)."""
    total = (weight * np.abs(signs)[:, None]).sum(axis=0)
    return float((total * _mean(phase, weight, signs) ** 2).sum())


def _conjugated(entry: FrfRecording) -> FrfRecording:
    assert entry.frf_im_pc_per_n is not None
    return replace(entry, frf_im_pc_per_n=-entry.frf_im_pc_per_n)
