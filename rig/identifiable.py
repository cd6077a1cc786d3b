"""Visibility of effects: the gain in χ² of the true model over the base model on the recordings themselves.

Both are fitted by generalised least squares with the rig's own noise levels: line noise, and for each recording a gain
error along the model's response and an error of position along its derivatives. Both have d33 free, and E, h (2 %, 1 %)
and the sensors' gains (1 %) near their declared or true values. Of mains the charge is known and the phase in each
recording is not: they are part of the covariance, and their share of its log determinant is included.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.layer import Floats
from rig.linear_filters import Complexes
from rig.recorded import RecordedLines
from rig.true_response import TrueResponse

THRESHOLD = 20.0
_DECLARED = {"youngs_modulus_mpa": 0.02, "thickness_mm": 0.01}
_SENSOR = 0.01
_STEP = 1e-3
_SMALL_MM = 1e-3
_ROUNDS = 4


@dataclass(frozen=True)
class Visibility:
    """Result of `visibility`.

    Attributes
    ----------
    chi2_gain : float
        χ² of the base model less that of the true one.
    base_misfit_percent : float
        rms misfit of the base model to the response before noise.
    """

    chi2_gain: float
    base_misfit_percent: float

    @property
    def identifiable(self) -> bool:
        """Whether the true model gains more than the threshold."""
        return self.chi2_gain > THRESHOLD


def visibility(recorded: RecordedLines, effects_in_model: tuple[str, ...] = ()) -> Visibility:
    """Visibility of the effects against a model that has only the effects `effects_in_model`, at their true values."""
    response = recorded.response
    aimed = replace(response, missed_mm=np.zeros_like(response.missed_mm))
    effects = {name: values for name, values in response.on.items() if name in effects_in_model}
    gains = response.sensor_gains if "sensor_spread" in effects_in_model else np.ones_like(response.sensor_gains)
    plain = replace(aimed, experiment=replace(response.experiment, effects=effects), sensor_gains=gains)
    true, _ = _Fit(recorded, aimed).best(_with_nuisances(recorded, aimed))
    pickup = recorded.pickup if "mains_pickup" in effects_in_model else np.zeros_like(recorded.pickup)
    base, fitted = _Fit(recorded, plain).best(_with_nuisances(recorded, plain))
    expected = recorded.exact + recorded.pickup - pickup
    scale = np.vdot(fitted, expected).real / np.vdot(fitted, fitted).real
    misfit = np.sqrt((np.abs(expected - scale * fitted) ** 2).sum() / (np.abs(expected) ** 2).sum())
    return Visibility(base - true, 100 * float(misfit))


_Design = tuple[Complexes, Floats]  # (columns, rows, lines), and the prior deviation of each column


def _with_nuisances(recorded: RecordedLines, response: TrueResponse) -> _Design:
    """The response, its derivatives to ln E and ln h, and each sensor's share of it."""
    base = response.lines(recorded.frequency_hz)
    columns, deviations = [base], [np.inf]
    for name, deviation in _DECLARED.items():
        skin = response.experiment.skin
        stepped = replace(skin, **{name: getattr(skin, name) * (1 + _STEP)})
        changed = replace(response, experiment=replace(response.experiment, skin=stepped)).lines(recorded.frequency_hz)
        columns.append((changed - base) / _STEP)
        deviations.append(deviation)
    for number in np.unique(response.plan.sensor):
        columns.append(base * (response.plan.sensor == number)[:, None])
        deviations.append(_SENSOR)
    return np.stack(columns), np.array(deviations)


class _Fit:
    """Least squares of one model on lines (rows, lines), with covariances that follow the model."""

    def __init__(self, recorded: RecordedLines, response: TrueResponse) -> None:
        self.measured = measured = recorded.measured
        self.variance = recorded.line_variance
        self.noise = response.experiment.noise
        self.moved = np.zeros((0, *measured.shape), dtype=complex)
        if self.noise.position_mm:
            base = response.lines(recorded.frequency_hz)
            self.moved = np.stack(
                [
                    (response.elsewhere(response.missed_mm + step).lines(recorded.frequency_hz) - base)
                    * (self.noise.position_mm / _SMALL_MM)
                    for step in _SMALL_MM * np.eye(2)
                ]
            )

        size = np.abs(recorded.pickup) / np.sqrt(2)  # of any phase: each part has half the square
        self.mains = np.stack([size, 1j * size]) if "mains_pickup" in response.on else np.zeros((0, *size.shape))

    def best(self, design: _Design) -> tuple[float, Complexes]:
        """The least χ², with priors and the share of mains in log|C|, and the response there."""
        columns, deviations = design
        amount = np.zeros(len(columns))
        amount[0] = 1.0
        chi2 = np.inf
        for _ in range(_ROUNDS):
            model = np.tensordot(amount, columns, 1)
            penalty = 1 / (amount[0] * deviations) ** 2
            along = np.stack([self.noise.gain * model, *(amount[0] * self.moved), *self.mains])
            everything = np.concatenate([columns, (self.measured - model)[None]])
            gram = self._gram(everything, along)
            chi2 = float(gram[-1, -1] + penalty @ amount**2)
            step = np.linalg.solve(gram[:-1, :-1] + np.diag(penalty), gram[:-1, -1] - penalty * amount)
            amount = amount + step
        return chi2 + self._mains_determinant(along), np.tensordot(amount, columns, 1)

    def _mains_determinant(self, along: Complexes) -> float:
        """The share of mains in log|C|."""
        low_rank = _parts(along / np.sqrt(self.variance))
        inner = np.einsum("arl,brl->rab", low_rank, low_rank) + np.eye(len(along))
        without = len(along) - len(self.mains)
        return float((np.linalg.slogdet(inner)[1] - np.linalg.slogdet(inner[:, :without, :without])[1]).sum())

    def _gram(self, columns: Complexes, along: Complexes) -> Floats:
        """x^T C⁻¹ y of all pairs, C = line noise + along along^T in each recording (Woodbury)."""
        plain = _parts(columns / np.sqrt(self.variance))
        low_rank = _parts(along / np.sqrt(self.variance))
        inner = np.einsum("arl,brl->rab", low_rank, low_rank) + np.eye(len(along))
        onto = np.einsum("arl,crl->rac", low_rank, plain)
        flat = plain.reshape(len(plain), -1)
        return np.asarray(flat @ flat.T - np.einsum("rac,rad->cd", onto, np.linalg.solve(inner, onto)))


def _parts(values: Complexes) -> Floats:
    """Real and imaginary parts side by side along the lines."""
    return np.concatenate([values.real, values.imag], axis=-1)
