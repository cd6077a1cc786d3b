"""The force of indentation curves, sample by sample, under a set of mechanisms.

Base model: Hertz on a half space, F = (4/3) E/(1 − ν²) √R (d − d0)^(3/2), with the contact point d0 and, where none is
declared, E free. Stages: declared value → material → contact radius, depth and force together with the stage's give,
through the body's history where it relaxes.
"""

from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated, constant, where
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Parameter, Values
from underskin.mechanisms.models.composition import Composition, Prediction
from underskin.mechanisms.models.contact_stage import layer_curves
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.models.indentation_law import Sphere, in_contact
from underskin.mechanisms.models.nuisances import (
    THICKNESS,
    contact_point,
    force_offset,
    modulus_parameter,
    required_modulus,
)
from underskin.mechanisms.models.pickup import Pickup
from underskin.mechanisms.models.receding_contact import Presses, relaxing
from underskin.mechanisms.models.stage_compliance import relaxing_on_stage
from underskin.physics.contact_curves import ContactCurves, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.recordings import elastomer
from underskin.recordings.campaign import IndentationRecording
from underskin.recordings.conditions import Conditions, CurveConditions, IndentationConditions, SkinDescription
from underskin.units import Floats, to_si

_CONTACT_SD, _CONTACT_BOUND = 0.1, 0.8  # of the range of displacement: the contact point's prior and bounds


class IndentationModel:
    """The force of indentations under a set of mechanisms; rows are all samples, one recording after another.

    Of measured curves, contact points, force offsets and an undeclared modulus have priors around the base model's own
    fits. Of conditions alone they are those expected of the declared modulus, with contact at displacement 0.
    """

    sensor: NDArray[np.intp] | None = None

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Work out everything that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = [entry for entry in conditions.recordings if isinstance(entry, IndentationConditions)]
        self._skin = conditions.skin
        self._composition = Composition(mechanisms, conditions, "indentation", _nuisances(recordings, self._skin))
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self._mechanisms = self._composition.mechanisms
        self._ids = [entry.id for entry in recordings]
        lengths = [len(entry.displacement_mm) for entry in recordings]
        self.recording = np.repeat(np.arange(len(recordings)), lengths)
        self.valid = np.ones(len(self.recording), dtype=bool)
        self.pickup: Pickup | None = None
        self._first = np.diff(self.recording, prepend=-1) > 0
        self._radius = to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in recordings])
        self._displacement = to_si("displacement_mm", np.concatenate([entry.displacement_mm for entry in recordings]))
        self._time = times_of(recordings)

    def predict(self, fit: Floats) -> Prediction:
        """All samples at one point of the fit coordinates (parameters,)."""
        own, nuisances, _ = self._composition.values(np.asarray(fit, dtype=float), 1)
        curve = self._curve(own, nuisances)
        spheres = Sphere(curve, self._radius, _curves(curve) if curve.layered else None)
        travel = self._travel(nuisances)
        if curve.relaxation is None:
            answer, inside = self._elastic(spheres, travel)
        else:
            answer, inside = self._relaxing(spheres, travel)
        offsets = [nuisances[f"force_offset {name}"] for name in self._ids]
        value = answer.value + np.concatenate([offset.value for offset in offsets])[self.recording]
        slopes = answer.slopes + np.concatenate([offset.slopes for offset in offsets], axis=1)[:, self.recording]
        return Prediction(value, slopes[: len(self.parameters)], None, None, None, inside)

    def sensor_spread_of(self, fit: Floats) -> tuple[float, Floats]:
        """No sensor takes part: the usual spread."""
        return self._composition.sensor_spread(np.asarray(fit, dtype=float))

    def _curve(self, own: dict[str, Values], nuisances: Values) -> Curve:
        thickness = self._skin.thickness_mm
        count = len(self.parameters) + 1
        curve = Curve(
            modulus=declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"],
            poisson_ratio=constant(self._skin.poisson_ratio, count),
            thickness=None if thickness is None else to_si("thickness_mm", thickness) * nuisances["thickness"],
        )
        for mechanism in self._mechanisms:
            mechanism.on_curve(curve, own[mechanism.name])
        return curve

    def _travel(self, nuisances: Values) -> Differentiated:
        """Displacement since the contact point [m], (rows,)."""
        points = [nuisances[f"contact_point {name}"] for name in self._ids]
        begins = Differentiated(
            1e-3 * np.concatenate([point.value for point in points])[self.recording],
            1e-3 * np.concatenate([point.slopes for point in points], axis=1)[:, self.recording],
        )
        return self._displacement - begins

    def _elastic(self, spheres: Sphere, travel: Differentiated) -> tuple[Differentiated, NDArray[np.bool_]]:
        """F, and which rows the layer's curves reach."""
        least, lowest = (limit[self.recording] for limit in spheres.pull_off())
        held = in_contact(travel.value, lowest, self._first)
        at, inside = spheres.rows(self.recording).at_travel(travel, held, least)
        return at.force, inside

    def _relaxing(self, spheres: Sphere, travel: Differentiated) -> tuple[Differentiated, NDArray[np.bool_]]:
        """The same through the history, which begins where a recording touches, between two samples."""
        touched = _since(travel.value >= 0, self._first)
        ahead = np.append(touched[1:] & ~self._first[1:], False) & ~touched
        time = Differentiated(self._time, np.zeros_like(travel.slopes))
        then = np.minimum(np.arange(len(ahead)) + 1, len(ahead) - 1)
        still = constant(-1.0, 1).spread(len(ahead))
        way = where(ahead, travel, 0.0) / where(ahead, travel - travel[then], still)
        presses = Presses(
            self.recording,
            time + way * (self._time[then] - self._time),
            started=touched | ahead,
            begins=ahead | (touched & self._first),
        )
        on = relaxing if spheres.curve.stage_stiffness is None else relaxing_on_stage
        force, _, inside = on(spheres, where(~ahead, travel, 0.0), presses)
        return where(touched, force, 0.0), inside


def declared_modulus(youngs_modulus_mpa: float | None) -> float:
    """What the parameter youngs_modulus multiplies [Pa]: the declared modulus, or 1 MPa."""
    return float(to_si("youngs_modulus_mpa", 1.0 if youngs_modulus_mpa is None else youngs_modulus_mpa))


def times_of(recordings: Sequence[CurveConditions]) -> Floats:
    """time_s of all samples; the sample's number where a recording has none, and no mechanism asks."""
    return np.concatenate(
        [np.arange(float(len(entry.displacement_mm))) if entry.time_s is None else entry.time_s for entry in recordings]
    )


def _since(marked: NDArray[np.bool_], first: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """From the first row where it is `marked` on, in each recording."""
    total = np.cumsum(marked)
    before = np.maximum.accumulate(np.where(first, total - marked, 0))
    return np.asarray(total > before)


def _curves(curve: Curve) -> ContactCurves:
    """Of the layer that the curve was recorded on."""
    return layer_curves(_grid(), Layer(float(curve.poisson_ratio.value[0])))


@cache
def _grid() -> CurveGrid:
    """No stress is asked for: one wave number, of no use."""
    return CurveGrid(np.ones(1))


def _nuisances(recordings: Sequence[IndentationConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisances' parameters; raises InvalidInput where no measured curve loads, or one does not move."""
    estimates, per_recording, refused = [], [], None
    for entry in recordings:
        span = float(np.ptp(to_si("displacement_mm", entry.displacement_mm)))
        if not isinstance(entry, IndentationRecording):
            begins, largest = 0.0, _expected_force(entry, skin)
        else:
            columns = [np.asarray(column, dtype=float).tobytes() for column in (entry.displacement_mm, entry.force_n)]
            try:
                modulus, begins = _hertz(*columns, entry.indenter_radius_mm, skin.poisson_ratio)
                estimates.append(modulus)
            except InvalidInput as refusal:
                refused = refusal.at(f"recordings[{entry.id}].{refusal.field}")
                # A curve that does not load begins where it shows least force.
                begins = float(to_si("displacement_mm", entry.displacement_mm[int(np.abs(entry.force_n).argmin())]))
            if refused is not None and span == 0:
                raise refused
            largest = float(np.abs(entry.force_n).max())
        per_recording.append(contact_point(entry.id, begins, _CONTACT_SD * span, _CONTACT_BOUND * span))
        per_recording.append(force_offset(entry.id, largest))
    if refused is not None and not estimates:
        raise refused
    thickness = [] if skin.thickness_mm is None else [THICKNESS]
    return [modulus_parameter(skin, estimates), *thickness, *per_recording]


def _expected_force(entry: IndentationConditions, skin: SkinDescription) -> float:
    """The largest force [N] by the base model, F = (4/3) E/(1 − ν²) √R d^(3/2), at the declared modulus."""
    depth = float(to_si("displacement_mm", np.abs(entry.displacement_mm).max()))
    modulus = float(to_si("youngs_modulus_mpa", required_modulus(skin)))
    radius = float(to_si("indenter_radius_mm", entry.indenter_radius_mm))
    return float(4 / 3 * modulus / (1 - skin.poisson_ratio**2) * np.sqrt(radius) * depth**1.5)


@lru_cache(maxsize=1024)  # a diagnosis composes some dozen models of the same recordings
def _hertz(displacement_mm: bytes, force_n: bytes, radius_mm: float, poisson_ratio: float) -> tuple[float, float]:
    """Modulus [Pa] and contact point [m] of the base model's own fit."""
    fit = elastomer.indentation_modulus(
        to_si("displacement_mm", np.frombuffer(displacement_mm)),
        to_si("force_n", np.frombuffer(force_n)),
        float(to_si("indenter_radius_mm", radius_mm)),
        poisson_ratio,
    )
    return fit.modulus, fit.contact_point
