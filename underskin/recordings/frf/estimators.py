"""H1, H2 and Hv: charge over force from spectra of both, each unbiased by another noise.

With F and Q the spectra of force and charge over n blocks, m and k the noise in each, uncorrelated with all else, and
S_fq the mean of conj(F) Q (Bendat and Piersol, Random Data, chapters 6 and 7):

    H1 = S_fq/S_ff            expected H/(1 + S_mm/S_ff,true): too small where the force is noisy
    H2 = S_qq/S_qf            expected H (1 + S_kk/S_qq,true): too large where the charge is noisy
    Hv = (d + √(d² + 4 κ |S_fq|²))/(2 S_qf), d = S_qq − κ S_ff
    γ² = |S_fq|²/(S_ff S_qq) = H1/H2

Hv is the total least-squares line through (F, Q): unbiased where the noise powers have the ratio S_kk/S_mm = κ, and
always between H1 and H2 in magnitude (Rocklin, Crowley and Vold, A Comparison of H1, H2, and Hv Frequency Response
Functions, IMAC 3, 1985). κ is taken to be the ratio of the signals' own powers over all lines, so that Hv does not
depend on units; this assumes that both channels have the same signal-to-noise ratio over the band. It is one number for
all lines, also of a stepped sine, since noise of an amplifier is nearly white while the signals vary with the FRF. With
a κ for each line, S_qq = κ S_ff there, and Hv would be the geometric mean of H1 and H2 at each line, too large where
the charge is smaller than at other lines, and too small where it is larger.
"""

from collections.abc import Iterable
from typing import Any, Literal, get_args

import numpy as np

from underskin.errors import not_one_of
from underskin.units import Complexes, Floats

Estimator = Literal["H1", "H2", "Hv"]
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)
_TINY = float(np.finfo(float).tiny)


def checked_estimator(field: str, value: Any) -> Estimator:
    """The estimator of that name; raises InvalidInput."""
    for estimator in ESTIMATORS:
        if value == estimator:
            return estimator
    raise not_one_of(field, value, ESTIMATORS)


def noise_ratio(spectra: Iterable[tuple[Complexes, Complexes]]) -> float:
    """κ of the module, [C²/N²], from spectra of force and charge, each (blocks, lines): of some lines in each pair."""
    ff, qq = (sum(_power(part).sum() for part in channel) for channel in zip(*spectra, strict=True))
    return float(qq / max(ff, _TINY))


def _power(spectra: Complexes) -> Floats:
    """The mean over blocks at each line."""
    return np.asarray(np.mean(np.abs(spectra) ** 2, axis=0))


def ratio(force: Complexes, charge: Complexes, estimator: Estimator, kappa: float) -> tuple[Complexes, Floats]:
    """The FRF and its coherence from spectra of blocks.

    Parameters
    ----------
    force, charge : (blocks, lines) complex arrays
        Spectra [N], [C], scaled alike.
    estimator : "H1", "H2" or "Hv"
        See the module.
    kappa : float
        `noise_ratio` of all lines, which Hv needs.

    Returns
    -------
    frf, coherence : (lines,) arrays
        [C/N] and γ².

    Raises
    ------
    InvalidInput
        There is no such estimator.
    """
    checked_estimator("estimator", estimator)
    ff, qq = _power(force), _power(charge)
    fq = np.mean(np.conj(force) * charge, axis=0)
    coherence = np.minimum(np.abs(fq) ** 2 / np.maximum(ff * qq, _TINY), 1.0)
    if estimator == "H1":
        return fq / np.maximum(ff, _TINY), coherence
    if estimator == "H2":
        return qq * fq / np.maximum(np.abs(fq) ** 2, _TINY), coherence
    difference = qq - kappa * ff
    root = np.sqrt(difference**2 + 4 * kappa * np.abs(fq) ** 2)
    share = np.where(difference > 0, (difference + root) / (2 * np.maximum(np.abs(fq) ** 2, _TINY)), 0)
    return fq * np.where(difference > 0, share, 2 * kappa / np.maximum(root - difference, _TINY)), coherence
