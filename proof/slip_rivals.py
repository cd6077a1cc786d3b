"""What else than a slip could have done it, by the rig's own equations: χ² that the best single effect leaves.

Of levels: each effect of the rig that moves them, beside those hidden, at strengths that the rig draws. Of phases: a
delay of either sign, alone and beside each effect that turns the phase, within the ranges that the rig draws from.
E and h (2 %, 1 %) and the sensors' gains (1 %) are free near their values.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rig import linear_filters
from rig.description import parse
from rig.effects import EFFECTS, FRF, UNCATALOGUED, Values
from rig.errors import RigError
from rig.recorded import RecordedLines
from rig.strengths import drawn_parameters, of_frf
from rig.true_response import TrueResponse

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_ALONG_FREQUENCY = {
    "contact_resonance", "amplifier_high_pass", "sensor_relaxation", "mains_pickup", "timing_delay", "preload_leak",
    "rattle", "notch", "cable_motion",
}  # fmt: skip
_DRAWS = 4  # of each effect's strengths
_STRONGER = 1.5  # times its change of the levels at most
_SPREAD, _SENSOR, _MODULUS, _THICKNESS = 0.25, 0.01, 0.02, 0.01  # standard deviations
_STEP = 1e-3
_DELAY = "timing_delay"
_LADDER: Values = {"law": "ladder"}
_STEP_LAW: Values = {"law": "step"}
# Effects that turn the phase: the fitted parameter of each, and its law.
_TURNING: tuple[tuple[str, tuple[str, ...], Values], ...] = (
    ("amplifier_high_pass", ("corner_hz",), {}),
    ("sensor_relaxation", ("exponent",), _LADDER),
    ("sensor_relaxation", ("step", "corner_hz"), _STEP_LAW),
    ("contact_resonance", ("tip_mass_g", "damping"), {}),
)


class LevelRivals:
    """The changes of the recordings' ln level that other causes can make, and how much of a slip's changes they
    leave unexplained."""

    def __init__(self, recorded: RecordedLines, scatter: Floats) -> None:
        response = recorded.response
        self.weight = np.where(np.isfinite(scatter), scatter, np.inf) ** -2.0
        sensor = (response.plan.sensor[:, None] == np.unique(response.plan.sensor)).astype(float)
        declared = [_MODULUS * _change(response, "youngs_modulus_mpa"), _THICKNESS * _change(response, "thickness_mm")]
        self.free = np.column_stack([np.ones(len(sensor)), *declared, _SENSOR * sensor])
        self.spread = _SPREAD * sensor
        self.rivals = list(_rivals(response))

    def least_residual(self, logarithm: Floats) -> float:
        """The least χ² that they leave of changes of ln level (recordings,)."""
        projector = self._projector(self.free)
        spread = self._projector(np.column_stack([self.free, self.spread]))
        residuals = [float(logarithm @ projector @ logarithm), float(logarithm @ spread @ logarithm)]
        for rival in self.rivals:
            along, size = float(rival @ projector @ logarithm), float(rival @ projector @ rival)
            share = float(np.clip(along / size, 0.0, _STRONGER)) if size > 0 else 0.0
            residuals.append(residuals[0] - 2 * share * along + share**2 * size)
        return min(residuals)

    def _projector(self, columns: Floats) -> Floats:
        """The matrix of the χ² left by columns with normal coefficients; the first column's is free."""
        weighted = self.weight[:, None] * columns
        penalty = np.diag([0.0, *np.ones(columns.shape[1] - 1)])
        inner = np.linalg.solve(columns.T @ weighted + penalty, weighted.T)
        return np.asarray(np.diag(self.weight) - weighted @ inner)


def _change(response: TrueResponse, name: str) -> Floats:
    """∂ ln level/∂ ln of a declared value (recordings,)."""
    skin = response.experiment.skin
    stepped = replace(skin, **{name: getattr(skin, name) * (1 + _STEP)})
    changed = replace(response, experiment=replace(response.experiment, skin=stepped))
    return (_level(changed) - _level(response)) / _STEP


def _level(response: TrueResponse) -> Floats:
    return np.log(np.maximum(np.abs(response.level), 1e-300))


def _rivals(response: TrueResponse) -> Iterator[Floats]:
    document = dict(response.experiment.document)
    random, ranges = np.random.default_rng([response.experiment.seed, 31]), of_frf(document)
    for name, effect in {**EFFECTS, **UNCATALOGUED}.items():
        if FRF not in effect.kinds or name in _ALONG_FREQUENCY or name == "sensor_spread":
            continue
        for _ in range(_DRAWS):
            on = {**response.on, name: drawn_parameters(random, name, ranges)}
            try:
                changed = replace(response, experiment=parse({**document, "effects": on}))
                yield _level(changed) - _level(response)
            except RigError:
                break


def conjugated_residual(recorded: RecordedLines) -> float:
    """The least χ² that an unconjugated phase leaves of the conjugated FRFs."""
    ranges = of_frf(dict(recorded.response.experiment.document))
    of_filters = _OfFilters(recorded)
    chi2 = [of_filters.least((), {}, ranges[_DELAY]["delay_us"], [])]
    for name, parameters, law in _TURNING:
        bounds = [ranges[name][parameter] for parameter in parameters]
        chi2.append(of_filters.least((name, *parameters), law, ranges[_DELAY]["delay_us"], bounds))
    return min(chi2)


class _OfFilters:
    """Least squares of filters on the conjugated FRFs, one row for each distinct contact."""

    def __init__(self, recorded: RecordedLines) -> None:
        response = recorded.response
        _, first, contact = np.unique(response.contact, return_index=True, return_inverse=True)
        self.frequency = recorded.frequency_hz
        level = response.level[:, None]
        self.wanted = (recorded.exact / level).conj()[first]
        self.weight = np.zeros(self.wanted.shape)
        np.add.at(self.weight, contact.reshape(-1), level**2 / recorded.line_variance)
        self.stiffness = response.stiffness[first]
        self.preload = response.plan.preload_n[first]

    def least(
        self, effect: tuple[str, ...], law: Values, delay: tuple[float, float], bounds: list[tuple[float, float]]
    ) -> float:
        """χ² of a gain, a delay of either sign up to the longest, and an effect within the bounds of its parameters."""
        name, parameters = effect[:1], effect[1:]
        low = np.array([0.5, -delay[1], *(np.log(lower) for lower, _ in bounds)])
        high = np.array([2.0, delay[1], *(np.log(upper) for _, upper in bounds)])

        def residual(fit: Floats) -> Floats:
            on = {name[0]: {**law, **dict(zip(parameters, np.exp(fit[2:]).tolist(), strict=True))}} if name else {}
            late = np.exp(-2e-6j * np.pi * self.frequency * fit[1])
            misfit = np.sqrt(self.weight) * (self.wanted - fit[0] * self._filtered(on) * late)
            return np.concatenate([misfit.real.ravel(), misfit.imag.ravel()])

        starts = [low + share * (high - low) for share in (0.2, 0.8)] if bounds else [(low + high) / 2]
        for start in starts:
            start[:2] = 1.0, 0.0
        fits = (least_squares(residual, start, bounds=(low, high), x_scale=high - low) for start in starts)
        return min(float(2 * fit.cost) for fit in fits)

    def _filtered(self, on: dict[str, Values]) -> Complexes:
        if "contact_resonance" not in on:
            return linear_filters.response(linear_filters.electrical(on, 1.0), self.frequency)[None, :]
        chains = [linear_filters.resonance(on, float(stiffness)) for stiffness in self.stiffness]
        return np.stack([linear_filters.response(chain, self.frequency) for chain in chains])


def over_one_sign(recorded: RecordedLines, turned: NDArray[np.bool_], share: float) -> float:
    """χ² of phases of which a `share` is turned, which ones unknown, over that of one course times any amount."""
    expected = recorded.exact.imag
    measured = np.where(turned, -1.0, 1.0)[:, None] * expected
    along = (measured * expected / recorded.line_variance).sum(axis=1)
    size = (expected**2 / recorded.line_variance).sum(axis=1)
    either = np.logaddexp(np.log1p(-share) + along - size / 2, np.log(share) - along - size / 2).sum()
    return float(2 * (either - along.sum() ** 2 / size.sum() / 2)) if size.sum() > 0 else 0.0
