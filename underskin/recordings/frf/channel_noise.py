"""Noise in the channels of force and charge, and what it makes of an FRF: an error-in-variables estimate.

With white noise of power m in the force and k in the charge, uncorrelated with all else, each line has (Bendat and
Piersol, Random Data, chapters 6 and 7)
    γ² = (1 − m/S_ff) (1 − k/S_qq)    H1 = H (1 − m/S_ff)    H2 = H/(1 − k/S_qq).
m and k are no larger than the least of S_ff and S_qq over the lines, and of many lines with different S_ff and S_qq γ²
tells which is which: where the force was not excited S_ff is m itself. Both have a uniform prior up to these bounds.
The FRF is then the total least-squares line with κ = k/m, and what the posterior leaves open is in its uncertainty; H2,
which somebody chose who knows the force to be noisy, is H2 (1 − k/S_qq). Where the lines' loss of coherence is more
than white noise explains (a disturbance inside the band), it may lie in either channel, so that H lies from H1 to H2.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.frf.spectral_average import Frf
from underskin.recordings.frf.stacks import expected_coherence, information
from underskin.units import Floats, Indices, Mask

_LEAST_LOSS = 2e-3  # 1 − γ² of the lines that are used: below, H1 and H2 differ by less
_FEWEST_LINES, _FEWEST_AVERAGES = 16, 3.0
_NODES = 33  # of each noise's share of its bound
_WORST = 0.9  # of a line's power, that may be taken for noise
_MODEL = 5e-3  # of γ², that leakage and other defects of an estimate make
_CORRELATED = 2.0  # neighbouring lines of Hann's window that tell as much as one
_TINY = float(np.finfo(float).tiny)
_TOGETHER = 16  # lines
_MARGIN = 1.3  # that a group's power may lie below its mean: three standard deviations of 8 blocks and 16 lines
_WORTH_SAYING = 0.01  # of the FRF


def without_noise_bias(measured: Frf, used: Mask) -> Frf:
    """The FRF without the bias by noise of its estimator, which was `bias`, and the uncertainty `bias_unsure` that is
    left, both of the lines that are `used` (lines,).

    As it is where their coherence is nearly 1, or where power or γ² is not known.
    """
    force, charge, coherence, averages = (
        measured.force_power, measured.charge_power, measured.coherence, measured.averages
    )  # fmt: skip
    if force is None or charge is None or coherence is None or averages is None or measured.passes is None:
        return measured
    count = np.minimum(averages, measured.passes)
    known = np.isfinite(coherence) & (force > 0) & (charge > 0) & (count > 1)
    used = used & known
    if used.sum() < 1 or known.sum() < _FEWEST_LINES or float(np.median(averages)) < _FEWEST_AVERAGES:
        return measured
    weight = information(expected_coherence(coherence[used]))
    weight /= weight.sum()
    true_coherence = coherence - (1 - coherence) ** 2 / np.maximum(count, 1.0)  # of n blocks γ² is that much too large
    loss = float(weight @ (1 - true_coherence[used]))
    if loss < _LEAST_LOSS:
        return measured
    noise = _posterior(force, charge, coherence, count, _groups(used, known))
    in_force = np.minimum(noise.force / force, _WORST)
    in_charge = np.minimum(noise.charge / charge, _WORST)
    if measured.estimator == "H2":
        size = np.sqrt(charge / np.maximum(coherence * force, _TINY)) * (1 - in_charge)
        sensitive = noise.charge_sd / charge
    elif noise.force == noise.charge == 0.0:
        return replace(measured, bias_unsure=loss / float(np.sqrt(3.0)))
    else:
        size = _total_least_squares(force, charge, coherence, noise)
        sensitive = noise.force_sd / force
    raw = np.abs(measured.values)
    factor = np.where(known & (raw > 0), size / np.where(raw > 0, raw, 1.0), 1.0)
    explained = float(weight @ (1 - (1 - in_force[used]) * (1 - in_charge[used])))
    unexplained = max(loss - explained, 0.0)
    unsure = float(np.hypot(weight @ sensitive[used], unexplained / np.sqrt(3.0)))
    bias = float(weight @ (1 / factor[used] - 1))
    return replace(measured, values=measured.values * factor, bias=bias, bias_unsure=unsure)


def _total_least_squares(force: Floats, charge: Floats, coherence: Floats, noise: "_Noise") -> Floats:
    """|FRF| of the line through (F, Q), whose noise has these powers: Hv of `estimators` with κ = k/m known, which is
    H1 for m = 0 and H2 for k = 0."""
    unit_force, unit_charge = float(force.max()), float(charge.max())  # N²/Hz, C²/Hz: their squares underflow
    force, charge = force / unit_force, charge / unit_charge
    of_force, of_charge = noise.force / unit_force, noise.charge / unit_charge
    cross = np.sqrt(np.maximum(coherence, _TINY) * force * charge)
    difference = of_force * charge - of_charge * force
    root = np.sqrt(difference**2 + 4 * of_force * of_charge * cross**2)
    above = (difference + root) / (2 * max(of_force, _TINY) * cross)
    beneath = 2 * of_charge * cross / np.maximum(root - difference, _TINY)
    return np.where(difference > 0, above, beneath) * np.sqrt(unit_charge / unit_force)


class _Noise:
    """Means and standard deviations of the powers of noise."""

    def __init__(self, force: Floats, charge: Floats, weight: Floats) -> None:
        of_force, of_charge = weight.sum(axis=1), weight.sum(axis=0)
        self.force, self.charge = float(force @ of_force), float(charge @ of_charge)
        self.force_sd = float(np.sqrt(max(force**2 @ of_force - self.force**2, 0.0)))
        self.charge_sd = float(np.sqrt(max(charge**2 @ of_charge - self.charge**2, 0.0)))


def _posterior(force: Floats, charge: Floats, coherence: Floats, count: Floats, groups: Sequence[Indices]) -> _Noise:
    """That of the noise of both channels, from powers, γ² as estimated and the number of blocks of lines (lines,), on a
    grid up to the least power that any group of lines has and the least share of it that its loss of coherence allows.

    Over the lines of a group γ² is Σ |S_fq|²/Σ S_ff S_qq. Of n blocks the expected sums are those of the spectra times
    γ² + 1/n and 1 + γ²/n.
    """
    product = force * charge
    sums = np.array([[part[own].sum() for part in (product, coherence * product, force, charge)] for own in groups])
    lines = np.array([len(own) for own in groups])
    blocks = np.array([float(np.mean(count[own])) for own in groups])
    seen = sums[:, 1] / sums[:, 0]
    true = np.clip((seen - 1 / blocks) / (1 - seen / blocks), 0.0, 1.0)
    inverse_force, inverse_charge = sums[:, 3] / sums[:, 0], sums[:, 2] / sums[:, 0]  # 1/S_ff and 1/S_qq of a group
    independent = np.maximum(lines / _CORRELATED, 1.0)
    variance = (2 * true + 1 / blocks) * (1 - true) ** 2 / (blocks * independent) + _MODEL**2
    loss = 1 - true + 3 * np.sqrt(variance)  # of coherence: no noise takes a larger share of a group's power
    most_force, most_charge = (
        min(_MARGIN / float(inverse.max()), float((loss / inverse).min()))
        for inverse in (inverse_force, inverse_charge)
    )
    shares = np.linspace(0.0, 1.0, _NODES)
    of_force = 1 - np.minimum(np.outer(shares, most_force * inverse_force), 1.0)
    of_charge = 1 - np.minimum(np.outer(shares, most_charge * inverse_charge), 1.0)
    gap = np.abs(true - of_force[:, None] * of_charge[None]) / np.sqrt(variance)
    misfit = np.where(gap < 3.0, gap**2, 6.0 * gap - 9.0).sum(axis=2)
    common = float((_MODEL**2 / variance).sum())  # groups for one, where all share the defect of the estimate
    excess = max(float(misfit.min()) / len(groups), common, 1.0)
    weight = np.exp(-0.5 * (misfit - misfit.min()) / excess)
    return _Noise(shares * most_force, shares * most_charge, weight / weight.sum())


def _groups(used: Mask, known: Mask) -> list[Indices]:
    """Neighbours among the lines that are used, and among the others: powers of single lines are too unsure, and where
    few lines were excited those beside them have others."""
    groups: list[Indices] = []
    for lines in (np.flatnonzero(used), np.flatnonzero(known & ~used)):
        if len(lines):
            groups += np.array_split(lines, max(1, len(lines) // _TOGETHER))
    return groups


def noise_findings(measured: Sequence[Frf]) -> list[Finding]:
    """What noise made of FRFs, where it is worth saying: of the median recording."""
    biased = [frf for frf in measured if frf.bias or frf.bias_unsure]
    if 2 * len(biased) <= len(measured):
        return []
    bias, unsure = (float(np.median([getattr(frf, name) for frf in biased])) for name in ("bias", "bias_unsure"))
    if max(abs(bias), unsure) < _WORTH_SAYING:
        return []
    arguments = {"percent": 100 * bias, "estimator": biased[0].estimator, "unsure_percent": 100 * unsure}
    return [Finding(Reason.NOISE_IN_FRF, "", "force_n" if biased[0].estimator == "H1" else "charge_pc", arguments)]
