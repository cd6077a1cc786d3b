"""Imported FRFs whose phase is in the other sign convention, e^(−iωt): conjugated, in some recordings or in all.

Of some: each course of phase over frequency is q_i = ±1 times one smooth course φ. With the signs that explain them
best the evidence must exceed that of one sign for all by what choosing k of n recordings costs, and the sizes of the
phases must be of two signs rather than a channel's own phase in each recording. Of all: the listed mechanisms explain
the conjugated course (`phase_laws`), and neither they nor a vibrating part the course as it is. Where a lag of the
force channel explains the course as well, both readings are stated and nothing is changed.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import product
from math import comb, log

import numpy as np
from scipy.special import log_ndtr
from scipy.stats import norm

from underskin.diagnosis.screening.phase_course import PhaseCourses, phase_courses
from underskin.diagnosis.screening.phase_laws import Course, leading, misfit, unlisted_misfit
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats

_LEAST = 3  # recordings that tell a phase, for some of them to contradict the others
_LARGEST = 0.7  # rad: a sharp resonance, at its own place in each recording, weighs no more
_RELAXATIONS, _COEFFICIENT = 4, 0.1  # of a smooth course, and the prior standard deviation of its terms [rad]
_PLAIN_SIGNS = 9.0  # of ln likelihood: about one campaign in a hundred has conjugated recordings
_OVER_CHANNELS = 6.0  # of ln likelihood: that of channels is ten times as frequent
_CHANNEL = tuple(np.array([0.0, 0.5, 1, 2, 4, 8, 16]) * 1e-3)  # rad, a channel's own phase
_USUAL_CHANNEL = 3e-3
_VARIED = (0.0, 0.2, 0.5, 1.0)  # of the mean course: what contacts differ by
_STRAY, _STRAY_SIZE = 0.05, 3.0  # share of recordings of any phase, and how large, of the mean course
_PLAIN = 14.0  # χ² by which the listed mechanisms explain the one orientation better
_RARER = 10.0  # χ² by which an unlisted part must explain it better, since it is rarer
_STILL = 1.5e-3  # rad
_QUANTILES = np.linspace(0.0625, 0.9375, 8)  # of the contacts' natural frequencies, which go as (force · radius)^(1/6)


def in_one_convention(
    entries: Sequence[FrfRecording], imported: Collection[str]
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with conjugated ones put right, and the finding on them; of those `imported` as FRFs (ids) alone:
    FRFs that were computed here are in the convention."""
    foreign, findings = _in_one_convention([entry for entry in entries if entry.id in imported])
    right = {entry.id: entry for entry in foreign}
    return [right.get(entry.id, entry) for entry in entries], findings


def _in_one_convention(entries: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    if not entries:
        return [], []
    courses = phase_courses(entries)
    if not courses.telling.any():
        return list(entries), []
    signs = _aligned(courses)
    orientation, lag_us = _orientation(entries, courses, signs)
    findings = list[Finding]()
    if orientation == 0:  # both may be: most recordings decide
        orientation = 1 if (signs < 0).sum() <= (signs > 0).sum() else -1
        if lag_us is not None and orientation == 1:
            findings.append(Finding(Reason.ALL_CONJUGATED, "", "frf_im_pc_per_n", {"lag_us": lag_us}))
    turned = orientation * signs < 0
    if not turned.any():
        return list(entries), findings
    ids = [entry.id for entry, wrong in zip(entries, turned, strict=True) if wrong]
    if turned[courses.telling].all():
        turned = np.ones(len(entries), dtype=bool)
        findings.append(Finding(Reason.ALL_CONJUGATED, "", "frf_im_pc_per_n", {"lag_us": None}))
    else:
        arguments = {"conjugated": ids, "recordings": len(entries)}
        about = ids[0] if len(ids) == 1 else ""
        findings.append(Finding(Reason.RECORDINGS_CONJUGATED, about, "frf_im_pc_per_n", arguments))
    return [_conjugated(entry) if wrong else entry for entry, wrong in zip(entries, turned, strict=True)], findings


def _aligned(courses: PhaseCourses) -> Floats:
    """±1 of each recording (recordings,), all 1 where nothing contradicts; 0 where it tells no phase."""
    telling = courses.telling
    same = telling.astype(float)
    if telling.sum() < _LEAST:
        return same
    phase, weight = _phases(courses)
    smooth = _SmoothCourse(courses.frequency, weight)
    signs = _leading_signs(phase, weight) * same
    for _ in range(10):
        better = np.where(_along(phase, weight, smooth.of(phase, signs)) < 0, -1.0, 1.0) * same
        if (better == signs).all():
            break
        signs = better
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    choices = log(comb(int(telling.sum()), fewer)) + log(telling.sum())
    gain = smooth.evidence(phase, signs) - max(smooth.evidence(phase, same), 0.0)
    if fewer == 0 or gain < choices + _PLAIN_SIGNS:
        return same
    return signs if _of_two_signs(phase, weight, signs) > _OVER_CHANNELS else same


class _SmoothCourse:
    """One phase over frequency, times the sign of each recording: a sum of what delay, loss, relaxation and high pass
    do, of normal coefficients."""

    def __init__(self, frequency: Floats, weight: Floats) -> None:
        ratio = frequency[:, None] / np.geomspace(frequency[0], frequency[-1], _RELAXATIONS)
        shapes = [frequency[:, None] / frequency[-1], np.ones((len(frequency), 1)), frequency[0] / frequency[:, None]]
        self.shapes = _COEFFICIENT * np.concatenate([*shapes, ratio / (1 + ratio**2)], axis=1)
        self.weight = weight
        self.information = self.shapes.T @ (weight.sum(axis=0)[:, None] * self.shapes) + np.eye(self.shapes.shape[1])

    def of(self, phase: Floats, signs: Floats) -> Floats:
        """The course (bands,) of phases (recordings, bands) and signs (recordings,)."""
        return np.asarray(self.shapes @ np.linalg.solve(self.information, self._pull(phase, signs)))

    def evidence(self, phase: Floats, signs: Floats) -> float:
        """Its logarithm, over that of no phase."""
        pull = self._pull(phase, signs)
        explained = float(pull @ np.linalg.solve(self.information, pull))
        return 0.5 * (explained - float(np.linalg.slogdet(self.information)[1]))

    def _pull(self, phase: Floats, signs: Floats) -> Floats:
        return np.asarray(self.shapes.T @ (signs @ (self.weight * phase)))


def _of_two_signs(phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln likelihood of courses ±1 times the mean one, over that of one course and a channel's own phase in each
    recording, a few of them stray."""
    course = _mean(phase, weight, signs)
    information = (weight * course**2).sum(axis=1)
    told = (signs != 0) & (information > 0)
    amplitude, variance = _along(phase, weight, course)[told] / information[told], 1 / information[told]
    size = np.sqrt((weight * course**2).sum() / weight.sum())
    share = min((signs[told] < 0).mean(), (signs[told] > 0).mean())
    usual = 1.0 if (signs < 0).sum() < (signs > 0).sum() else -1.0
    stray = np.log(_STRAY) + norm.logpdf(amplitude, 0.0, _STRAY_SIZE)
    apart, alike = [], []
    for own, varied in product(_CHANNEL, _VARIED):
        spread = np.sqrt(variance + (own / size) ** 2)
        one, other = (_log_density(sign * usual * amplitude, spread, varied) for sign in (1, -1))
        mean = float(np.average(amplitude, weights=spread**-2))
        shifted = norm.logpdf(amplitude, mean, np.hypot(spread, varied)) if varied < 1 else one
        either = np.logaddexp(np.log1p(-share) + one, np.log(share) + other)
        prior = -0.5 * (own / _USUAL_CHANNEL) ** 2
        apart.append(prior + float(np.logaddexp(either + np.log1p(-_STRAY), stray).sum()))
        alike.append(prior + float(np.logaddexp(shifted + np.log1p(-_STRAY), stray).sum()))
    return max(apart) - max(alike)


def _log_density(amplitude: Floats, spread: Floats, varied: float) -> Floats:
    """Of amplitudes near 1 that contacts vary by `varied`, or if that is 1 by an exponential law, and of noise
    `spread`."""
    if varied < 1:
        return np.asarray(norm.logpdf(amplitude, 1.0, np.hypot(spread, varied)))
    size = float(np.abs(amplitude).mean())
    ratio = spread / size
    return np.asarray(ratio**2 / 2 - amplitude / size - np.log(size) + log_ndtr(amplitude / spread - ratio))


def _orientation(entries: Sequence[FrfRecording], courses: PhaseCourses, signs: Floats) -> tuple[int, float | None]:
    """1 where the listed mechanisms explain the aligned course and not its conjugate, −1 where they explain that and
    neither an unlisted part nor a lag of the force channel explains the course itself, 0 where both may be; and that
    lag [µs] where it is the other explanation."""
    course = _mean_course(entries, courses, signs)
    phase = course.value.imag / np.hypot(course.deviation.imag, _STILL)
    if phase @ phase < len(phase) + _PLAIN:
        return 0, None
    given, turned = misfit(course), misfit(course.conjugated)
    if turned - given > _PLAIN:
        return 1, None
    if given - turned <= _PLAIN or turned - unlisted_misfit(course) >= _RARER:
        return 0, None
    lead = leading(course)
    if turned - lead.misfit > _PLAIN:
        return 1, None
    return (-1, None) if lead.misfit - turned > _PLAIN else (0, lead.lag_us)


def _mean_course(entries: Sequence[FrfRecording], courses: PhaseCourses, signs: Floats) -> Course:
    """The mean of the aligned courses; its deviation is the recordings' own noise, or their scatter if larger."""
    aligned = np.where(signs[:, None] < 0, courses.value.conj(), courses.value)
    known = np.isfinite(aligned) & np.isfinite(courses.deviation) & courses.followed
    weight = np.where(known, courses.deviation, np.inf) ** -2.0
    aligned = np.where(known, aligned, 0.0)
    total = weight.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = total**-0.5
        mean = (weight * aligned).sum(axis=0) / total
        parts = [np.sqrt((weight * part**2).sum(axis=0) / total / known.sum(axis=0)) for part in (
            (aligned - mean).real, (aligned - mean).imag)]  # fmt: skip
    real, imaginary = (np.maximum(own, part) for part in parts)
    used = total > 0
    natural = np.array([(entry.preload_n * entry.indenter_radius_mm) ** (1 / 6) for entry in entries])
    spread = np.quantile(natural / np.median(natural), _QUANTILES)
    return Course(courses.frequency[used], mean[used], (real + 1j * imaginary)[used], spread)


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


def _conjugated(entry: FrfRecording) -> FrfRecording:
    assert entry.frf_im_pc_per_n is not None
    return replace(entry, frf_im_pc_per_n=-entry.frf_im_pc_per_n)
