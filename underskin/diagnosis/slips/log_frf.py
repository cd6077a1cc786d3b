"""ln FRF of recordings over frequency, and what the laws of the catalogue that turn the phase make of it.

ln H of elements in series add up with weights that are not negative. An element is such a law at a strength from its
prior, which costs ½ χ² as its density falls.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import nnls

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.slips.comparison import LEAST_LINES, base_model
from underskin.diagnosis.slips.levels import models_of_laws
from underskin.mechanisms.base import Normal, Parameter
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, frf_recordings
from underskin.recordings.frf.line_choice import MAINS_HZ
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Complexes, Floats, Mask

_BANDS = 24  # of equal width in the logarithm of frequency: a fraction of the width of any element
_NEAR_MAINS_HZ = 20.0  # mains pick-up has its own phase, at the odd multiples most
_UNSURE = 6.0  # times a line's noise, which no step of noise exceeds
_WIDEST = 0.3  # rad, noise of a line above which the phase cannot be unwrapped


@dataclass(frozen=True)
class LogFrfBands:
    """ln FRF in bands of frequency (recordings, bands), without its real mean and the polarity; `weight` is the inverse
    variance of its real and of its imaginary part by the lines' noise, 0 where there is no line, or no phase."""

    frequency: Floats  # (bands,)
    value: Complexes
    weight: Floats

    @property
    def telling(self) -> Mask:
        """Whether a recording has a phase in any band (recordings,)."""
        return np.asarray((self.weight > 0).any(axis=1))


def log_frf_bands(campaign: Campaign) -> LogFrfBands:
    """The bands of ln FRF of recordings; none from the first one on where unwrapping is ambiguous, as at a zero of the
    response or a sharp resonance: the phase steps by half a turn within the noise of a line."""
    rows = lines(campaign)
    edges = np.geomspace(rows.frequency.min() * (1 - 1e-9), rows.frequency.max() * (1 + 1e-9), _BANDS + 1)
    band = np.clip(np.searchsorted(edges, rows.frequency) - 1, 0, _BANDS - 1)
    off_mains = np.abs(np.subtract.outer(rows.frequency, np.outer(MAINS_HZ, (1, 3)).ravel())).min(axis=1)
    usable = (off_mains >= _NEAR_MAINS_HZ) & (np.abs(rows.value) > 0)
    value, weight = np.zeros((len(rows.spans), _BANDS), dtype=complex), np.zeros((len(rows.spans), _BANDS))
    relative = rows.deviation / np.where(usable, np.abs(rows.value), np.inf)
    # The median over lines, times that over recordings in each band: a resonance between few lines looks like noise
    noises = np.array(
        [np.median(relative[span][usable[span]]) if usable[span].any() else np.inf for span in rows.spans]
    )
    over_own = relative / noises[rows.recording]
    uneven = [
        np.median(over_own[usable & (band == number)]) if (usable & (band == number)).any() else 1.0
        for number in range(_BANDS)
    ]
    for index, span in enumerate(rows.spans):
        of_recording = np.arange(span.start, span.stop)[usable[span]]
        noise = float(noises[index])
        if len(of_recording) < LEAST_LINES or noise > _WIDEST:
            continue
        phase = np.unwrap(np.angle(rows.value[of_recording]))  # near 0 at the lowest lines, but for the polarity
        phase -= np.pi * np.round(np.median(phase[: max(3, len(phase) // 8)]) / np.pi)
        logarithm = np.log(np.abs(rows.value[of_recording])) + 1j * phase
        of_line = (noise * np.array(uneven)[band[of_recording]]) ** -2.0
        np.add.at(value[index], band[of_recording], logarithm * of_line)
        np.add.at(weight[index], band[of_recording], of_line)
        value[index, weight[index] > 0] /= weight[index, weight[index] > 0]
        value[index] -= value[index, weight[index] > 0].real.mean()
        steps = np.flatnonzero(np.abs(np.diff(phase)) > np.pi - _UNSURE * noise)
        weight[index, band[of_recording[steps[0]]] if len(steps) else _BANDS :] = 0.0
    return LogFrfBands(np.sqrt(edges[1:] * edges[:-1]), np.where(weight > 0, value, 0.0), weight)


CHANNEL_DEVIATION = 1.5e-3  # of ln H: difference between channels
_IDEALISED = 0.08  # relative departure of a real FRF from the elements
_COST = 2.5  # of ½ χ², for each element
_SHAPES = 24  # of each law: a resonance of a usual damping lies within half its width of one
_CONTACTS = 8  # whose mean a law's ln H is: they differ in a resonance's frequency
_TILT = 1e-2  # of the row that adds the costs to the squares; small enough that they stay linear

Elements = tuple[Complexes, Floats]  # ln H (bands, elements) at weights 1, which are not negative; their cost in ½ χ²


@dataclass(frozen=True)
class LogFrf:
    """ln FRF over frequency (bands,), real part and phase each with its deviation."""

    frequency: Floats
    value: Complexes
    deviation: Complexes  # of the real part and of the phase

    def fit(self, *elements: Elements, turned: bool = False) -> tuple[float, Floats]:
        """The least χ² including the costs, and the weights, of this or of its conjugate: of
        ½ |(y − A w)/d|² + cost · w over w ≥ 0."""
        value = self.value.conj() if turned else self.value
        size = np.hypot(CHANNEL_DEVIATION, _IDEALISED * np.abs(value))
        of_real, of_phase = (1 / np.hypot(part, size) for part in (self.deviation.real, self.deviation.imag))
        cost = np.concatenate([cost for _, cost in elements])
        columns = np.column_stack([value, *(part for part, _ in elements)])
        real = columns.real - of_real**2 / (of_real**2).sum() @ columns.real
        rows = np.vstack([real * of_real[:, None], columns.imag * of_phase[:, None]])
        matrix, target = rows[:, 1:], rows[:, 0]
        weights, _ = nnls(np.vstack([matrix, _TILT * cost]), np.append(target, -1 / _TILT))
        return float(((target - matrix @ weights) ** 2).sum() + 2 * cost @ weights), weights


def mean_log_frf(bands: LogFrfBands, signs: Floats) -> LogFrf:
    """The mean of the aligned ln FRFs; its deviation is from the recordings' noise, or their scatter if larger."""
    aligned = np.where(signs[:, None] < 0, bands.value.conj(), bands.value)
    total, number = bands.weight.sum(axis=0), (bands.weight > 0).sum(axis=0)
    used = total > 0
    weight = bands.weight[:, used] / total[used]
    mean = (weight * aligned[:, used]).sum(axis=0)
    off = aligned[:, used] - mean
    scatter = [np.sqrt((weight * part**2).sum(axis=0) / number[used]) for part in (off.real, off.imag)]
    real, imaginary = (np.maximum(total[used] ** -0.5, part) for part in scatter)
    return LogFrf(bands.frequency[used], mean, real + 1j * imaginary)


def listed_elements(campaign: Campaign, table: SigmaTable, frequency: Floats) -> dict[str, Elements]:
    """The laws of the catalogue that turn the phase, by name, at strengths from their priors: of those whose strength
    the base model is at 0 of, one at a time at its scale; of shapes, values over the prior, at the cost of its density.
    """
    order = np.argsort([recording.preload_n * recording.indenter_radius_mm for recording in frf_recordings(campaign)])
    some = order[np.linspace(0, len(order) - 1, _CONTACTS).astype(int)]
    recordings = [frf_recordings(campaign)[index] for index in some.tolist()]
    contacts = [replace(one, position_mm=None) for one in recordings]
    base, start, prediction = base_model(campaign, contacts, table, frequency)
    listed = {}
    for name, model in models_of_laws(base.design.conditions, table, along_frequency=True).items():
        if "phase" not in CATALOGUE[name].axes:
            continue
        points, cost = _over_prior(model.parameters[: len(model.parameters) - len(start)])
        values = np.array(list(model.values(np.hstack([points, np.tile(start, (len(points), 1))]))))
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(values / prediction.value).reshape(len(points), _CONTACTS, -1).mean(axis=1)
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
        values = {one.name: scale(one) if one is strength else 0.0 for one in strengths}
        values |= {one.name: one.start + at * scale(one) for one, at in zip(shapes, score, strict=True)}
        points.append([float(np.clip(values[one.name], *one.bounds)) for one in parameters])
        off = [(one.prior, values[one.name]) for one in shapes]
        cost.append(_COST - sum(prior.log_shape(value) for prior, value in off if isinstance(prior, Normal)))
    return np.array(points), np.array(cost)


def scale(parameter: Parameter) -> float:
    """The scale of its prior; 0 where that has none, which leaves it at its start."""
    return parameter.prior.sd if isinstance(parameter.prior, Normal) else 0.0


def unlisted_chi2(log_frf: LogFrf) -> float:
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
