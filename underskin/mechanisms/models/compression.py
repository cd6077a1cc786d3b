"""The force of compression (or tension) curves, sample by sample, under a set of mechanisms.

Base model: one modulus E of an incompressible neo-Hookean solid between smooth platens, F = (E A/3)(λ⁻² − λ) with
λ = 1 − (d − d0)/H, compression positive. Stages: declared value → nominal stress of the
material → friction at the platens → relaxation.
"""

from collections.abc import Sequence

import numpy as np

from underskin.autodiff import constant
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.models.curve_state import Curve, numbers
from underskin.mechanisms.models.curves import CurveModel, declared_modulus
from underskin.mechanisms.models.nuisances import contact_point, modulus_parameter, required_modulus
from underskin.mechanisms.models.relaxation import memories
from underskin.mechanisms.parameter import Parameter
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.recordings.block_modulus import of_compression
from underskin.recordings.campaign import CompressionRecording
from underskin.recordings.conditions import CompressionConditions, Conditions, SkinDescription
from underskin.units import Floats, Mask, to_si

_CONTACT_SD, _CONTACT_BOUND = 0.01, 0.1  # of the sample's height: the contact point's prior and bounds
_LEAST_STRETCH = 0.02  # of λ: curves that are pressed to 0.15 are left out


class CompressionModel(CurveModel):
    """The force of compressions under a set of mechanisms.

    Of measured curves, contact points and an undeclared modulus have priors around the base model's own fits. Of
    conditions alone, contact is around displacement 0 and the modulus must be declared.
    """

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Work out everything that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = [entry for entry in conditions.recordings if isinstance(entry, CompressionConditions)]
        nuisances = _nuisances(recordings, conditions.skin)
        super().__init__(mechanisms, conditions, "compression", recordings, nuisances)
        self._height = to_si("sample_height_mm", [entry.sample_height_mm for entry in recordings])[:, None]
        diameter = to_si("sample_diameter_mm", [entry.sample_diameter_mm for entry in recordings])[:, None]
        self._area = np.pi / 4 * diameter**2
        self._shape_factor = diameter / (4 * self._height)

    def _curve(self, own: dict[str, Values], nuisances: Values) -> Curve:
        modulus = declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"]
        curve = Curve(modulus=modulus, poisson_ratio=constant(INCOMPRESSIBLE, 0, modulus.value.shape[:-1]))
        for mechanism in self._mechanisms:
            mechanism.on_curve(curve, own[mechanism.name])
        return curve

    def _force(self, curve: Curve, contact: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        strain = (self.displacement - contact) / self._height
        force = numbers(curve.modulus) * self._area * self._relative_stress(curve, strain)
        relaxation = curve.prony_pairs
        if relaxation is not None:
            force = relaxation.convolved(force, memories(force, self.time, relaxation))
        every = np.ones(force.shape, dtype=bool)
        return force, every, every

    def _relative_stress(self, curve: Curve, strain: Floats) -> Floats:
        """Nominal stress over E, compression positive.

        Neo-Hookean, (λ⁻² − λ)/3; what stiffens has that times 1 + 2 c2 J + 3 c3 J², J = 3 (I/3)^(m/2), I = I1 − 3:
        Yeoh's law at m = 2.
        """
        stretch = np.maximum(1.0 - strain, _LEAST_STRETCH)
        stress = (1.0 / (stretch * stretch) - stretch) / 3.0
        if curve.yeoh is not None:
            second, third, exponent = map(numbers, curve.yeoh)
            invariant = stretch * stretch + 2.0 / stretch - 3.0
            grown = 3.0 * (np.maximum(invariant, 0.0) / 3.0) ** (0.5 * exponent)
            stress = stress * (1.0 + 2.0 * second * grown + 3.0 * third * grown * grown)
        if curve.platen_friction is None:
            return stress
        return np.asarray(stress * (1.0 + 2.0 * self._shape_factor**2 * numbers(curve.platen_friction)))


def _nuisances(recordings: Sequence[CompressionConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisances' parameters; raises InvalidInput where a measured curve does not load."""
    estimates, points = [], []
    for entry in recordings:
        height = float(to_si("sample_height_mm", entry.sample_height_mm))
        begins = 0.0
        if isinstance(entry, CompressionRecording):
            try:
                estimates.append(of_compression(entry).modulus)
            except InvalidInput as refusal:
                raise refusal.at(f"recordings[{entry.id}].{refusal.field}") from refusal
            unloaded = int(np.abs(entry.force_n).argmin())
            begins = float(to_si("displacement_mm", entry.displacement_mm[unloaded]))
        else:
            required_modulus(skin)
        points.append(contact_point(entry.id, begins, _CONTACT_SD * height, _CONTACT_BOUND * height))
    return [modulus_parameter(skin, estimates), *points]
