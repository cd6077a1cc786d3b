"""The force of compression (or tension) curves, sample by sample, under a set of mechanisms.

Base model: one modulus, F = E A (d − d0)/H, compression positive. Stages: declared value → nominal stress of the
material → friction at the platens → relaxation.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated, constant
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Parameter, Values
from underskin.mechanisms.models.composition import Composition, Prediction
from underskin.mechanisms.models.curve_state import Curve, stiffened
from underskin.mechanisms.models.indentation import declared_modulus, times_of
from underskin.mechanisms.models.nuisances import contact_point, modulus_parameter, required_modulus
from underskin.mechanisms.models.pickup import Pickup
from underskin.mechanisms.models.relaxation import relaxed
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.recordings import elastomer
from underskin.recordings.campaign import CompressionRecording
from underskin.recordings.conditions import CompressionConditions, Conditions, SkinDescription
from underskin.units import Floats, to_si

_CONTACT_SD, _CONTACT_BOUND = 0.01, 0.1  # of the sample's height: the contact point's prior and bounds


class CompressionModel:
    """The force of compressions under a set of mechanisms; rows are all samples, one recording after another.

    Of measured curves, contact points and an undeclared modulus have priors around the base model's own fits. Of
    conditions alone, contact is around displacement 0 and the modulus must be declared.
    """

    sensor: NDArray[np.intp] | None = None

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Work out everything that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = [entry for entry in conditions.recordings if isinstance(entry, CompressionConditions)]
        self._skin = conditions.skin
        self._composition = Composition(mechanisms, conditions, "compression", _nuisances(recordings, self._skin))
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self._mechanisms = self._composition.mechanisms
        self._ids = [entry.id for entry in recordings]
        self.recording = np.repeat(np.arange(len(recordings)), [len(entry.displacement_mm) for entry in recordings])
        self.valid = np.ones(len(self.recording), dtype=bool)
        self.pickup: Pickup | None = None
        self._first = np.diff(self.recording, prepend=-1) > 0
        heights = to_si("sample_height_mm", [entry.sample_height_mm for entry in recordings])
        diameters = to_si("sample_diameter_mm", [entry.sample_diameter_mm for entry in recordings])
        self._height = heights[self.recording]
        self._area = (np.pi / 4 * diameters**2)[self.recording]
        self._shape_factor = (diameters / (4 * heights))[self.recording]
        self._displacement = to_si("displacement_mm", np.concatenate([entry.displacement_mm for entry in recordings]))
        self._time = times_of(recordings)

    def predict(self, fit: Floats) -> Prediction:
        """All samples at one point of the fit coordinates (parameters,)."""
        own, nuisances, _ = self._composition.values(np.asarray(fit, dtype=float))
        curve = Curve(
            modulus=declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"],
            poisson_ratio=constant(INCOMPRESSIBLE, len(self.parameters)),
        )
        for mechanism in self._mechanisms:
            mechanism.on_curve(curve, own[mechanism.name])
        answer = curve.modulus * self._area * self._relative_stress(curve, self._strain(nuisances))
        if curve.relaxation is not None:
            answer = relaxed(answer, self._time, self._first, *curve.relaxation)
        return Prediction(answer.value, answer.slopes, None, None, None, self.valid)

    def sensor_spread_of(self, fit: Floats) -> tuple[float, Floats]:
        """No sensor takes part: the usual spread."""
        return self._composition.sensor_spread(np.asarray(fit, dtype=float))

    def _strain(self, nuisances: Values) -> Differentiated:
        """Nominal strain (rows,), compression positive."""
        points = [nuisances[f"contact_point {name}"] for name in self._ids]
        begins = Differentiated(
            1e-3 * np.concatenate([point.value for point in points])[self.recording],
            1e-3 * np.concatenate([point.slopes for point in points], axis=1)[:, self.recording],
        )
        return (self._displacement - begins) / self._height

    def _relative_stress(self, curve: Curve, strain: Differentiated) -> Differentiated:
        """Nominal stress over E."""
        stress = strain if curve.yeoh is None else stiffened(1.0 - strain, curve.yeoh) / 3.0
        if curve.platen_friction is None:
            return stress
        return stress * (1.0 + 2.0 * self._shape_factor**2 * curve.platen_friction)


def _nuisances(recordings: Sequence[CompressionConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisances' parameters; raises InvalidInput where a measured curve does not load."""
    estimates, points = [], []
    for entry in recordings:
        height = float(to_si("sample_height_mm", entry.sample_height_mm))
        begins = 0.0
        if isinstance(entry, CompressionRecording):
            try:
                estimates.append(elastomer.of_compression(entry).modulus)
            except InvalidInput as refusal:
                raise refusal.at(f"recordings[{entry.id}].{refusal.field}") from refusal
            unloaded = int(np.abs(entry.force_n).argmin())
            begins = float(to_si("displacement_mm", entry.displacement_mm[unloaded]))
        else:
            required_modulus(skin)
        points.append(contact_point(entry.id, begins, _CONTACT_SD * height, _CONTACT_BOUND * height))
    return [modulus_parameter(skin, estimates), *points]
