"""Imported FRFs in the other sign convention, e^(−iωt): conjugated, in some recordings or in all.

In the convention e^(+iωt) the phase of every causal, stable element between force and charge is tied to its magnitude:
a high pass, −ln(1 + f_c/(if)), leads where it attenuates; a low pass, −ln(1 + if/f_c), and a relaxation,
−n ln(if) + ln(1 + s/(1 + if/f_s)), lag where they fall; the resonance of a tip, −ln(1 − r² + 2iζr), lags above it; a
delay of the charge, −iωt0 with t0 ≥ 0, only lags. Elements in series add up with weights that are not negative, which
a conjugated FRF contradicts. Strengths have the catalogue's priors, so that no relaxation far below the band, of an
unphysical size, can stand for a conjugated high pass.

Some recordings: phase i is q_i = ±1 times one smooth phase φ. With the best signs the evidence must exceed that of
equal signs by the cost of choosing k of n recordings, and the sizes of the phases must be of two signs rather than a
channel's own phase in each recording. All recordings: the listed mechanisms explain the conjugate, and neither they
nor a vibrating part explain the phase as it is. Where a lag of the force channel explains it as well, both readings are
stated and nothing is changed.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import comb, log

import numpy as np
from scipy.optimize import nnls
from scipy.stats import norm

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.slips.comparison import LEAST_LINES, LEAST_RECORDINGS, times
from underskin.diagnosis.slips.levels import Alternative, Undone
from underskin.diagnosis.slips.table import GAIN, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Normal, Parameter, Unsupported
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, frf_recordings
from underskin.recordings.frf.line_choice import MAINS_HZ
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Complexes, Floats, Mask

_LOG_PRIOR = -log(45)  # about one campaign in fifty has conjugated recordings
_PLAIN = 2 * (GAIN - _LOG_PRIOR)  # of χ², by which a reading must then exceed another
_FIELD = "frf_im_pc_per_n"


def conjugated(screened: Screened, imported: Collection[str]) -> Iterator[Alternative]:
    """The conjugated ones of the recordings that were `imported` as FRFs (ids): FRFs computed here are in the
    convention."""
    recordings = [recording for recording in screened.recordings if recording.id in imported]
    campaign = replace(screened.campaign, recordings=tuple(recordings))
    bands = _log_frf_bands(campaign) if recordings else None
    if bands is None or not bands.telling.any():
        return
    signs, nats, choices = _aligned(bands)
    orientation, chi2, lag_us = _orientation(_mean_log_frf(bands, signs), partial(_listed, campaign, screened.table))
    findings = list[Finding]()
    if orientation == 0:  # undecided: the majority of recordings decides
        orientation = 1 if (signs < 0).sum() <= (signs > 0).sum() else -1
        if lag_us is not None and orientation == 1:
            findings.append(Finding(Reason.ALL_CONJUGATED, "", _FIELD, {"lag_us": lag_us}))
    turned = orientation * signs < 0
    ids = [recording.id for recording, wrong in zip(recordings, turned, strict=True) if wrong]
    if ids and turned[bands.telling].all():
        ids = [recording.id for recording in recordings]
        findings.append(Finding(Reason.ALL_CONJUGATED, "", _FIELD, {"lag_us": None}))
    elif ids:
        arguments = {"conjugated": ids, "recordings": len(recordings)}
        findings.append(Finding(Reason.RECORDINGS_CONJUGATED, ids[0] if len(ids) == 1 else "", _FIELD, arguments))
    if findings:
        yield Alternative(_LOG_PRIOR - choices, nats + chi2 / 2, undo=partial(_turned, ids=ids, findings=findings))


def _turned(recordings: list[FrfRecording], _: float, *, ids: Collection[str], findings: list[Finding]) -> Undone:
    """The recordings with those of these ids conjugated."""
    if not ids:
        return recordings, findings
    return [times(recording, 1.0, -1.0 if recording.id in ids else 1.0) for recording in recordings], findings


_BANDS = 24  # of equal width in the logarithm of frequency: a fraction of the width of any element
_NEAR_MAINS_HZ = 20.0  # mains pick-up has its own phase, at the odd multiples most
_UNSURE = 6.0  # times a line's noise, which no step of noise exceeds
_WIDEST = 0.3  # rad, noise of a line above which the phase cannot be unwrapped


@dataclass(frozen=True)
class _LogFrfBands:
    """ln FRF in bands of frequency (recordings, bands), without its real mean and the polarity; `weight` is the inverse
    variance of its real and of its imaginary part by the lines' noise, 0 where there is no line, or no phase."""

    frequency: Floats  # (bands,)
    value: Complexes
    weight: Floats

    @property
    def telling(self) -> Mask:
        """Whether a recording has a phase in any band (recordings,)."""
        return np.asarray((self.weight > 0).any(axis=1))


def _log_frf_bands(campaign: Campaign) -> _LogFrfBands:
    """The bands of ln FRF of recordings; none from the first one on where unwrapping is ambiguous, as at a zero of the
    response or a sharp resonance: the phase steps by half a turn within the noise of a line."""
    rows = lines(campaign)
    edges = np.geomspace(rows.frequency.min() * (1 - 1e-9), rows.frequency.max() * (1 + 1e-9), _BANDS + 1)
    band = np.clip(np.searchsorted(edges, rows.frequency) - 1, 0, _BANDS - 1)
    near_mains = (
        np.min(np.abs(np.subtract.outer(rows.frequency, np.outer(MAINS_HZ, (1, 3)).ravel())), axis=1) < _NEAR_MAINS_HZ
    )
    usable = ~near_mains & (np.abs(rows.value) > 0)
    value, weight = np.zeros((len(rows.spans), _BANDS), dtype=complex), np.zeros((len(rows.spans), _BANDS))
    for index, span in enumerate(rows.spans):
        of_recording = np.arange(span.start, span.stop)[usable[span]]
        noise = float(np.median(rows.deviation[of_recording] / np.abs(rows.value[of_recording])))
        if len(of_recording) < LEAST_LINES or not noise < _WIDEST:
            continue
        phase = np.unwrap(np.angle(rows.value[of_recording]))  # near 0 at the lowest lines, but for the polarity
        phase -= np.pi * np.round(np.median(phase[: max(3, len(phase) // 8)]) / np.pi)
        logarithm = np.log(np.abs(rows.value[of_recording])) + 1j * phase
        np.add.at(value[index], band[of_recording], logarithm / noise**2)
        np.add.at(weight[index], band[of_recording], noise**-2)  # the median: resonances between lines look like noise
        value[index, weight[index] > 0] /= weight[index, weight[index] > 0]
        value[index] -= value[index, weight[index] > 0].real.mean()
        steps = np.flatnonzero(np.abs(np.diff(phase)) > np.pi - _UNSURE * noise)
        weight[index, band[of_recording[steps[0]]] if len(steps) else _BANDS :] = 0.0
    return _LogFrfBands(np.sqrt(edges[1:] * edges[:-1]), np.where(weight > 0, value, 0.0), weight)


_LARGEST = 0.7  # rad: limit that reduces the weight of sharp resonances, whose frequency differs between recordings
_RELAXATIONS, _COEFFICIENT = 4, 0.1  # terms of a smooth phase, and the prior standard deviation of each [rad]
_VARIED = (0.0, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4)  # of the mean phase: variation between recordings


def _aligned(bands: _LogFrfBands) -> tuple[Floats, float, float]:
    """The sign ±1 of each recording's phase (recordings,), 0 without a phase: all 1 where none contradicts the others;
    the gain of ln evidence by it, and ln of the number of choices."""
    same = bands.telling.astype(float)
    if bands.telling.sum() < LEAST_RECORDINGS:
        return same, 0.0, 0.0
    phase, weight = np.clip(bands.value.imag, -_LARGEST, _LARGEST), bands.weight
    vectors, _, _ = np.linalg.svd(phase * np.sqrt(weight), full_matrices=False)
    signs = np.where(vectors[:, 0] * np.sign(vectors[:, 0].sum() or 1.0) < 0, -1.0, 1.0) * same
    odds = log(max((signs > 0).sum(), 1) / max((signs < 0).sum(), 1))  # of a recording by the others
    pull = (weight * phase * _mean_phase(phase, weight, signs)).sum(axis=1)
    signs = np.where(2 * pull < -odds, -1.0, 1.0) * same
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    choices = log(comb(int(same.sum()), fewer)) + log(same.sum())
    gain = _of_smooth(bands.frequency, phase, weight, signs)
    gain -= max(_of_smooth(bands.frequency, phase, weight, same), 0.0)
    if fewer == 0 or gain < choices + _PLAIN / 2 or _of_two_signs(phase, weight, signs) <= -_LOG_PRIOR:
        return same, 0.0, 0.0
    return signs, gain, choices


def _of_smooth(frequency: Floats, phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln evidence, relative to no phase, of one smooth phase over frequency, times the sign of each recording: a sum of
    the phases of delay, loss, relaxation and high pass with normal coefficients."""
    ratio = frequency[:, None] / np.geomspace(frequency[0], frequency[-1], _RELAXATIONS)
    shapes = [frequency[:, None] / frequency[-1], np.ones((len(frequency), 1)), frequency[0] / frequency[:, None]]
    columns = _COEFFICIENT * np.concatenate([*shapes, ratio / (1 + ratio**2)], axis=1)
    information = columns.T @ (weight.sum(axis=0)[:, None] * columns) + np.eye(columns.shape[1])
    pull = columns.T @ (signs @ (weight * phase))
    return 0.5 * (float(pull @ np.linalg.solve(information, pull)) - float(np.linalg.slogdet(information)[1]))


def _of_two_signs(phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln likelihood of phases ±1 times the mean, relative to one phase plus a channel's own in each recording; in both
    they vary between recordings."""
    mean_phase = _mean_phase(phase, weight, signs)
    information = (weight * mean_phase**2).sum(axis=1)
    informative = (signs != 0) & (information > 0)
    amplitude = (weight * phase * mean_phase).sum(axis=1)[informative] / information[informative]
    share = float((signs[informative] < 0).mean())
    two_signs, one_sign = [], []
    for varied in _VARIED:
        spread = np.sqrt(1 / information[informative] + varied**2)
        parts = (log(size) + norm.logpdf(amplitude, sign, spread) for size, sign in ((1 - share, 1.0), (share, -1.0)))
        two_signs.append(float(np.logaddexp(*parts).sum()))
        mean = float(np.average(amplitude, weights=spread**-2))
        one_sign.append(float(norm.logpdf(amplitude, mean, spread).sum()))
    return max(two_signs) - max(one_sign)


def _mean_phase(phase: Floats, weight: Floats, signs: Floats) -> Floats:
    total = (weight * np.abs(signs)[:, None]).sum(axis=0)
    return np.asarray((signs[:, None] * weight * phase).sum(axis=0) / np.where(total > 0, total, 1.0))


_CHANNEL_DEVIATION = 1.5e-3  # of ln H: difference between channels
_IDEALISED = 0.08  # relative departure of a real FRF from the elements
_COST = 2.5  # of ½ χ², for each element
_SHAPES = 24  # of each law: a resonance of a usual damping lies within half its width of one
_CONTACTS = 8  # whose mean a law's ln H is: they differ in a resonance's frequency
_DELAY = "timing_delay"
_TILT = 1e-2  # of the row that adds the costs to the squares; small enough that they stay linear

Elements = tuple[Complexes, Floats]  # ln H (bands, elements) at weights 1, which are not negative; their cost in ½ χ²


@dataclass(frozen=True)
class _LogFrf:
    """ln FRF over frequency (bands,), real part and phase each with its deviation."""

    frequency: Floats
    value: Complexes
    deviation: Complexes  # of the real part and of the phase

    def fit(self, *elements: Elements, turned: bool = False) -> tuple[float, Floats]:
        """The least χ² including the costs, and the weights, of this or of its conjugate: of
        ½ |(y − A w)/d|² + cost · w over w ≥ 0."""
        value = self.value.conj() if turned else self.value
        size = np.hypot(_CHANNEL_DEVIATION, _IDEALISED * np.abs(value))
        of_real, of_phase = (1 / np.hypot(part, size) for part in (self.deviation.real, self.deviation.imag))
        cost = np.concatenate([cost for _, cost in elements])
        columns = np.column_stack([value, *(part for part, _ in elements)])
        real = columns.real - of_real**2 / (of_real**2).sum() @ columns.real
        rows = np.vstack([real * of_real[:, None], columns.imag * of_phase[:, None]])
        matrix, target = rows[:, 1:], rows[:, 0]
        weights, _ = nnls(np.vstack([matrix, _TILT * cost]), np.append(target, -1 / _TILT))
        return float(((target - matrix @ weights) ** 2).sum() + 2 * cost @ weights), weights


def _orientation(log_frf: _LogFrf, listed: Callable[[Floats], dict[str, Elements]]) -> tuple[int, float, float | None]:
    """1 where the listed mechanisms explain the aligned phase and not its conjugate; −1 where they explain the
    conjugate, and neither an unlisted part nor a lag of the force channel explains the phase itself; 0 where both are
    possible. Second, by how much χ² the conjugate is better; third, that lag [µs] where it is the alternative."""
    phase = log_frf.value.imag / np.hypot(log_frf.deviation.imag, _CHANNEL_DEVIATION)
    if phase @ phase < len(phase) + _PLAIN:
        return 0, 0.0, None
    kinds = listed(log_frf.frequency)
    if _DELAY not in kinds:
        return 0, 0.0, None
    given, turned = (log_frf.fit(*kinds.values(), turned=turned)[0] for turned in (False, True))
    if min(given, turned) > 4 * len(log_frf.frequency):  # twice the number of values: neither is explained
        return 0, 0.0, None
    if turned - given > _PLAIN:
        return 1, 0.0, None
    if given - turned <= _PLAIN or turned - _unlisted_chi2(log_frf) > _PLAIN:
        return 0, 0.0, None
    delay, cost = kinds.pop(_DELAY)
    plain, *fits = [log_frf.fit((-delay, cost), *kind) for kind in ((), *((kind,) for kind in kinds.values()))]
    best = min(plain, *fits, key=lambda fit: fit[0])
    if turned - best[0] > _PLAIN:
        return 1, 0.0, None
    if best[0] - turned > _PLAIN:
        return -1, min(given, best[0]) - turned, None
    simplest = plain if plain[0] < best[0] + 2 * _PLAIN else best
    return 0, given - turned, _scale(CATALOGUE[_DELAY].parameters_stated[0]) * float(simplest[1][0])


def _listed(campaign: Campaign, table: SigmaTable, frequency: Floats) -> dict[str, Elements]:
    """The laws of the catalogue that turn the phase, by name, at strengths from their priors: of those whose strength
    the base model is at 0 of, one at a time at its scale; of shapes, values over the prior, at the cost of its density.
    """
    order = np.argsort([recording.preload_n * recording.indenter_radius_mm for recording in frf_recordings(campaign)])
    some = order[np.linspace(0, len(order) - 1, _CONTACTS).astype(int)]
    recordings = [frf_recordings(campaign)[index] for index in some.tolist()]
    contacts = [one.without_measurements(frequency_hz=frequency, position_mm=None) for one in recordings]
    conditions = Conditions("contacts", campaign.skin, tuple(contacts))
    base = compose((), conditions, table, "frf")
    start = np.array([parameter.start for parameter in base.parameters])
    listed = {}
    for name, mechanism in CATALOGUE.items():
        if "frf" not in mechanism.kinds or not mechanism.needs_lines or "phase" not in mechanism.axes:
            continue
        try:
            model = compose((name,), conditions, table, "frf")
        except Unsupported:
            continue
        assert isinstance(model, FrfModel)
        points, cost = _over_prior(model.parameters[: len(model.parameters) - len(start)])
        values = np.array(list(model.values(np.hstack([points, np.tile(start, (len(points), 1))]))))
        logarithm = np.log(values / base.predict(start).value).reshape(len(points), _CONTACTS, -1).mean(axis=1)
        if np.isfinite(logarithm).all():  # not beyond the tables
            listed[name] = logarithm.T, cost
    return listed


def _over_prior(parameters: Sequence[Parameter]) -> tuple[Array, Floats]:
    """Points (points, parameters) over the prior of a law, and the cost of each in ½ χ²."""
    strengths = [parameter for parameter in parameters if parameter.fit_limit is not None]
    shapes = [parameter for parameter in parameters if parameter not in strengths]
    scores = product(np.linspace(-3.0, 3.0, _SHAPES), *[(-1.0, 0.0, 1.0)] * (len(shapes) - 1))
    none: list[Parameter | None] = [None]
    points, cost = list[list[float]](), list[float]()
    for score, strength in product(list(scores) if shapes else [()], strengths or none):
        values = {one.name: _scale(one) if one is strength else 0.0 for one in strengths}
        values |= {one.name: one.start + at * _scale(one) for one, at in zip(shapes, score, strict=True)}
        points.append([float(np.clip(values[one.name], *one.bounds)) for one in parameters])
        off = [(one.prior, values[one.name]) for one in shapes]
        cost.append(_COST - sum(prior.log_shape(value) for prior, value in off if isinstance(prior, Normal)))
    return np.array(points), np.array(cost)


def _scale(parameter: Parameter) -> float:
    """The scale of its prior; 0 where that has none, which leaves it at its start."""
    return parameter.prior.sd if isinstance(parameter.prior, Normal) else 0.0


def _unlisted_chi2(log_frf: _LogFrf) -> float:
    """χ² of the best part that vibrates within the band, such as a cable or a loose screw, or a notch:
    (A r² + B r)/(r² + 2ζr + 1), r = if/f1, of either sign and typically 0.3."""
    frequency = log_frf.frequency
    chi2 = []
    for natural, zeta in product(np.geomspace(frequency[0], frequency[-1], _SHAPES), (0.2, 0.4, 0.8)):
        turn = 1j * frequency / natural
        share = 0.3 / (turn**2 + 2 * zeta * turn + 1)
        parts = np.column_stack([share * turn**2, -share * turn**2, share * turn, -share * turn])
        chi2.append(log_frf.fit((parts, np.ones(4)))[0])
    return 2 * _COST + min(chi2)


def _mean_log_frf(bands: _LogFrfBands, signs: Floats) -> _LogFrf:
    """The mean of the aligned ln FRFs; its deviation is from the recordings' noise, or their scatter if larger."""
    aligned = np.where(signs[:, None] < 0, bands.value.conj(), bands.value)
    total, number = bands.weight.sum(axis=0), (bands.weight > 0).sum(axis=0)
    used = total > 0
    weight = bands.weight[:, used] / total[used]
    mean = (weight * aligned[:, used]).sum(axis=0)
    off = aligned[:, used] - mean
    scatter = [np.sqrt((weight * part**2).sum(axis=0) / number[used]) for part in (off.real, off.imag)]
    real, imaginary = (np.maximum(total[used] ** -0.5, part) for part in scatter)
    return _LogFrf(bands.frequency[used], mean, real + 1j * imaginary)
