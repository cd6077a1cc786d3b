"""Models of force curves: what all share, and the compression (or tension) of cylinders.

Arrays are (points, curves, samples): points of the fit coordinates; shorter curves are padded with their last value.
Derivatives are differences, exact to about 1e-5: the shifted points are computed together with the point itself, with
its contact. Contact points are shifted all at once, since each moves one curve only.

Compression, sample by sample: base model is one modulus E of an incompressible neo-Hookean solid between smooth
platens, F = (E A/3)(λ⁻² − λ) with λ = 1 − (d − d0)/H, compression positive. A sample that is only compressed or only
pulled is slack, F = 0, before d0, and again where it relaxed and its force would change sign on its way back. Stages:
declared value → nominal stress of the material → friction at the platens → relaxation → the frame that gives, on which
d − d0 is the shortening and F/k.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.autodiff import constant
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Kind, Mechanism, Parameter, Values
from underskin.mechanisms.models.composition import (
    STRAIN_SHARE,
    Composition,
    Prediction,
    contact_point,
    modulus_parameter,
    required_modulus,
)
from underskin.mechanisms.models.contact_state import Pickup
from underskin.mechanisms.models.curve_state import Curve, memories, numbers
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.physics.uniaxial import neo_hookean, stiffening
from underskin.recordings.block_modulus import ZERO_SD, of_compression
from underskin.recordings.campaign import (
    CompressionConditions,
    CompressionRecording,
    Conditions,
    CurveConditions,
    SkinDescription,
)
from underskin.recordings.curve_course import is_one_sided
from underskin.units import Floats, Indices, Mask, to_si

_STEP = 3e-6  # of a logarithm or of a prior's width
_AT_ONCE = 1_000_000  # samples of all points


class CurveModel(ABC):
    """The force of curves under a set of mechanisms; rows are all samples, one recording after another."""

    sensor: Indices | None = None
    pickup: Pickup | None = None
    hidden_jumps = False  # whether contact may begin or end with a jump that no curve shows

    def __init__(
        self,
        mechanisms: Sequence[Mechanism],
        conditions: Conditions,
        kind: Kind,
        recordings: Sequence[CurveConditions],
        nuisances: Sequence[Parameter],
    ) -> None:
        """Arrange the samples; `nuisances` end with the recordings' contact points."""
        self._composition = Composition(mechanisms, conditions, kind, nuisances)
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self._mechanisms = self._composition.mechanisms
        self._skin = conditions.skin
        lengths = np.array([len(recording.displacement_mm) for recording in recordings], dtype=np.intp)
        self.recording = np.repeat(np.arange(len(recordings)), lengths)
        self.valid = np.ones(len(self.recording), dtype=bool)
        self._sample = np.arange(len(self.recording)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        self.displacement = self._arranged(
            [to_si("displacement_mm", recording.displacement_mm) for recording in recordings]
        )
        self.time = self._arranged([times_of(recording) for recording in recordings])
        intervals = np.diff(self.time, axis=-1)
        longest = float(np.ptp(self.time, axis=-1).max()) or 1.0
        self.times = float(intervals[intervals > 0].min(initial=longest)), longest
        count = len(self.parameters) - len(recordings)
        self.contact_points = np.arange(count, len(self.parameters))
        # What moves together in the differences: each shared parameter, then all contact points.
        self._moved = [np.array([index]) for index in range(count)] + [self.contact_points]
        bounds = np.array([parameter.bounds for parameter in self.parameters]).reshape(-1, 2)
        logarithmic = np.array([parameter.scale == "log" for parameter in self.parameters])
        self._high = bounds[:, 1]
        self._step = np.where(logarithmic, _STEP, _STEP * np.minimum(1.0, bounds[:, 1] - bounds[:, 0]))

    @property
    def poisson_ratio(self) -> float:
        """ν of the material."""
        return self._skin.poisson_ratio

    def _curve(self, values: dict[str, Values], nuisances: Values) -> Curve:
        """The quantities that govern the curves, numbers (points, 1), as changed by the mechanisms."""
        modulus = declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"]
        thickness_mm = self._skin.thickness_mm if "thickness" in nuisances else None
        curve = Curve(
            modulus=modulus,
            poisson_ratio=constant(self.poisson_ratio, 0, modulus.value.shape[:-1]),
            strain_share=nuisances.get(STRAIN_SHARE.name),
            thickness=None if thickness_mm is None else to_si("thickness_mm", thickness_mm) * nuisances["thickness"],
            times=self.times,
        )
        for mechanism in self._mechanisms:
            mechanism.act(curve, values[mechanism.name])
        return curve

    @abstractmethod
    def _force(self, curve: Curve, contact: Floats, alike: bool) -> tuple[Floats, Mask]:
        """F (points, curves, samples) [N], and which samples are inside the tables.

        `contact` (points, curves, 1) [m]; `alike`: the same samples are in contact at all points as at the first.
        """

    def forces(self, fit: Floats) -> Floats:
        """F (points, rows) [N] at points (points, parameters)."""
        at_once = max(_AT_ONCE // self.displacement.size, 1)
        parts = [self._forces(fit[first : first + at_once])[0] for first in range(0, len(fit), at_once)]
        return np.concatenate(parts)[:, self.recording, self._sample]

    def forces_and_slopes(self, fit: Floats) -> tuple[Floats, Floats]:
        """F (points, rows) [N], and its derivatives by the fit coordinates (points, parameters, rows)."""
        values, slopes, _ = zip(*map(self._differentiated, fit), strict=True)
        return np.stack(values), np.stack(slopes)

    def predict(self, fit: Floats) -> Prediction:
        """All samples at one point of the fit coordinates (parameters,); raises InvalidInput for another length."""
        value, slopes, inside = self._differentiated(np.asarray(fit, dtype=float))
        return Prediction(value, slopes, None, None, None, inside)

    def _forces(self, fit: Floats, *, alike: bool = False) -> tuple[Floats, Mask]:
        values, nuisances = self._composition.values(fit)
        contact = 1e-3 * fit[:, self.contact_points, None]
        return self._force(self._curve(values, nuisances), contact, alike)

    def _differentiated(self, fit: Floats) -> tuple[Floats, Floats, Mask]:
        """F (rows,) at one point, its derivatives (parameters, rows), and which rows are inside."""
        points = np.tile(fit, (1 + len(self._moved), 1))
        steps = np.where(fit + self._step <= self._high, self._step, -self._step)
        for number, indices in enumerate(self._moved, start=1):
            points[number, indices] += steps[indices]
        force, inside = self._forces(points, alike=True)
        rows = self.recording, self._sample
        value, slopes = force[0][rows], np.zeros((len(self.parameters), len(self.recording)))
        for number, indices in enumerate(self._moved, start=1):
            change = force[number][rows] - value
            if indices is self.contact_points:
                slopes[indices[self.recording], np.arange(len(self.recording))] = (
                    change / steps[indices[self.recording]]
                )
            else:
                slopes[indices[0]] = change / steps[indices[0]]
        return value, slopes, inside[0][rows]

    def _arranged(self, columns: Sequence[Floats]) -> Floats:
        """Columns of the curves as one array (curves, samples), padded with their last values."""
        longest = max(map(len, columns))
        return np.stack([np.pad(column, (0, longest - len(column)), mode="edge") for column in columns])


def times_of(recording: CurveConditions) -> Floats:
    """time_s of the samples; their indices where a recording has none."""
    if recording.time_s is None:
        return np.arange(float(len(recording.displacement_mm)))
    return recording.time_s


def declared_modulus(youngs_modulus_mpa: float | None) -> float:
    """The unit of the parameter youngs_modulus [Pa]: the declared modulus, or 1 MPa."""
    return float(to_si("youngs_modulus_mpa", 1.0 if youngs_modulus_mpa is None else youngs_modulus_mpa))


_CONTACT_SD, _CONTACT_BOUND = 0.01, 0.1  # of the sample's height: the contact point's prior and bounds
_LEAST_STRETCH = 0.02  # of λ: curves that are pressed to 0.15 are left out
_FRAME_GRID, _FRAME_STEP = 201, 1e-6  # strains of a first guess on a frame that gives; of its slope, of the height
_FRAME_ITERATIONS, _FRAME_SETTLED = 40, 1e-10  # as of spheres on such a stage; of the largest travel


class CompressionModel(CurveModel):
    """The force of compressions under a set of mechanisms.

    For measured curves, contact points and an undeclared modulus have priors around the base model's own fits. For
    conditions alone, contact is around displacement 0 and the modulus must be declared.
    """

    poisson_ratio = INCOMPRESSIBLE

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Compute all that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = conditions.of(CompressionConditions)
        nuisances = _nuisances(recordings, conditions.skin)
        super().__init__(mechanisms, conditions, "compression", recordings, nuisances)
        self._height = to_si("sample_height_mm", [recording.sample_height_mm for recording in recordings])[:, None]
        diameter = to_si("sample_diameter_mm", [recording.sample_diameter_mm for recording in recordings])[:, None]
        self._area = np.pi / 4 * diameter**2
        self._shape_factor = diameter / (4 * self._height)
        self._loaded, self._leaves = np.array([_sides(recording) for recording in recordings]).T[..., None]

    def _force(self, curve: Curve, contact: Floats, alike: bool) -> tuple[Floats, Mask]:
        travel = self.displacement - contact
        if curve.stage_stiffness is None:
            force = self._sample_force(curve, travel)
        else:
            force = self._on_frame(curve, travel, 1.0 / numbers(curve.stage_stiffness))
        return force, np.ones(force.shape, dtype=bool)

    def _on_frame(self, curve: Curve, travel: Floats, compliance: Floats) -> Floats:
        """F where travel = shortening + F/k: from the shortenings at which it is so without history, Newton steps of
        all samples together, whose slope is learnt from step to step."""
        shortening = self._without_history(curve, travel, compliance)
        beside = shortening + _FRAME_STEP * self._height
        elastic, further = (self._elastic_force(curve, depth) for depth in (shortening, beside))
        slope = np.maximum(further - elastic, 0.0) / (_FRAME_STEP * self._height)
        force = self._sample_force(curve, shortening)
        scale = np.abs(travel).max(axis=-1, keepdims=True) + np.finfo(float).tiny
        for _ in range(_FRAME_ITERATIONS):
            residual = shortening + compliance * force - travel
            if (np.abs(residual) <= _FRAME_SETTLED * scale).all():
                break
            moved_to = np.clip(shortening - residual / (1.0 + compliance * slope), -scale, scale)
            change, shortening = moved_to - shortening, moved_to
            after = self._sample_force(curve, shortening)
            moved = np.abs(change) > _FRAME_SETTLED * scale
            secant = np.divide(after - force, change, out=np.zeros_like(change), where=moved)
            slope = np.where(moved & (secant > 0), 0.5 * (slope + np.minimum(secant, 4.0 * slope)), slope)
            force = after
        return force

    def _without_history(self, curve: Curve, travel: Floats, compliance: Floats) -> Floats:
        """The shortenings of a sample that remembers nothing, by interpolation over its strain."""
        largest = np.abs(travel).max(axis=-1, keepdims=True)
        pressed = np.minimum(largest, (1.0 - _LEAST_STRETCH) * self._height)
        strain = -largest + (largest + pressed) * np.linspace(0.0, 1.0, _FRAME_GRID)
        ends = np.maximum.accumulate(strain + compliance * self._elastic_force(curve, strain), axis=-1)
        strain, ends = np.broadcast_arrays(strain, ends)
        found = np.empty_like(travel)
        for index in np.ndindex(travel.shape[:2]):
            found[index] = np.interp(travel[index], ends[index], strain[index])
        return found

    def _elastic_force(self, curve: Curve, shortening: Floats) -> Floats:
        """F of a sample that neither relaxes nor softens (points, curves, samples)."""
        return self._sample_force(replace(curve, softening=None, relaxation=()), shortening)

    def _sample_force(self, curve: Curve, shortening: Floats) -> Floats:
        """F of the sample itself (points, curves, samples) [N] at shortenings in the order of time [m]."""
        strain = shortening / self._height
        strain = np.where(self._loaded * strain < 0, 0.0, strain)  # slack
        force = numbers(curve.modulus) * self._area * self._relative_stress(curve, strain)
        relaxation = curve.relaxes
        if relaxation is not None:
            force = relaxation.at_rest * force
            force = relaxation.convolved(force, memories(force, self.time, relaxation))
            force = np.where(self._leaves * force < 0, 0.0, force)
        return np.asarray(force)

    def _relative_stress(self, curve: Curve, strain: Floats) -> Floats:
        """Nominal stress over E, compression positive: of the material, and as cycles soften it."""
        stress = self._solid(curve, strain) if curve.foam is None else curve.foam(strain)
        return stress if curve.softening is None else stress * curve.softening(strain)

    def _solid(self, curve: Curve, strain: Floats) -> Floats:
        """Of an incompressible solid between platens."""
        stretch = np.maximum(1.0 - strain, _LEAST_STRETCH)
        stress = (
            neo_hookean(stretch) if curve.stiffened is None else stiffening(stretch, *map(numbers, curve.stiffened))
        )
        if curve.platen_friction is None:
            return stress
        return np.asarray(stress * (1.0 + 2.0 * self._shape_factor**2 * numbers(curve.platen_friction)))


def _sides(recording: CompressionConditions) -> tuple[float, float]:
    """1 of a cylinder that is only compressed, −1 of one that is only pulled, 0 of both: one is slack before.

    And the same, but 0 where the force also reads the other sign, beyond what the zero may be off: a sample that
    relaxed, drawn back, is left by a platen, which does not pull, or hangs slack, as a strip that cannot push; one that
    is glued is not.
    """
    if not isinstance(recording, CompressionRecording) or not is_one_sided(recording.force_n):
        return 0.0, 0.0
    force = recording.force_n
    side = 1.0 if force.max() > -force.min() else -1.0
    return side, side if float((-side * force).max()) < ZERO_SD * float(np.abs(force).max()) else 0.0


def _unloaded(force: Floats) -> int:
    """The sample at which a cylinder is unloaded: before its largest force, since one that relaxed has lost its
    contact before it is drawn back all the way; of all samples where none before reads zero."""
    size = np.abs(force)
    before = int(size[: int(size.argmax()) + 1].argmin())
    return before if size[before] < ZERO_SD * size.max() else int(size.argmin())


def _nuisances(recordings: Sequence[CompressionConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisance parameters; raises InvalidInput where a measured curve does not load."""
    estimates, points = [], []
    for recording in recordings:
        height = float(to_si("sample_height_mm", recording.sample_height_mm))
        contact = 0.0
        if isinstance(recording, CompressionRecording):
            try:
                estimates.append(of_compression(recording).modulus)
            except InvalidInput as refusal:
                raise refusal.at(f"recordings[{recording.id}].{refusal.field}") from refusal
            contact = float(to_si("displacement_mm", recording.displacement_mm[_unloaded(recording.force_n)]))
        else:
            required_modulus(skin)
        points.append(contact_point(recording.id, contact, _CONTACT_SD * height, _CONTACT_BOUND * height))
    return [modulus_parameter(skin, estimates), *points]
