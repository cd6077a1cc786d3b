"""The mechanism `cyclic_softening`."""

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.curve_state import Curve, numbers
from underskin.recordings.campaign import CompressionConditions, Conditions
from underskin.recordings.curve_course import presses_again
from underskin.units import Floats


class CyclicSoftening(Mechanism):
    """The first loading softens a sample for all later ones up to the same strain (Mullins)."""

    name = "cyclic_softening"
    plain = """The first loading damages the sample, so that on the way back and in later cycles it is softer below the
    largest strain that it has seen, and stiff again beyond that."""
    law = """Stress · (1 − d (1 − e^(−(ε_m − ε)/ε_s))), ε the strain's magnitude and ε_m the largest so far: d is the
    fraction that is lost far below ε_m, ε_s the strain below ε_m at which most of that is lost."""
    assumptions = """no softening before the recording; damage follows the largest strain alone, so that cycles to the
    same strain are alike from the second on: a slow fading of the peaks is relaxation, or not described. With a d near
    1 no force remains far below ε_m, as of a sample with a set. Beside relaxation, the softened stress relaxes."""
    source = """Mullins, Rubber Chem. Technol. 42 (1969) 339; Ogden & Roxburgh, Proc. R. Soc. A 455 (1999) 2861, whose
    variable of damage is a function of the largest energy; here of the largest strain."""
    needs = "a sample that is loaded, unloaded and loaded again"
    stage = Stage.MATERIAL
    order = 60
    kinds = ("compression",)
    axes = ("displacement_mm",)
    parameters_stated = (
        Parameter(
            name="softened_fraction",
            unit="-",
            low=0.0,
            high=1.0,
            prior=Uniform(),
            scale="linear",
            limit=0.0,
            shown=0.4,
            closed=(1.0,),
            reason="a few percent in unfilled silicone, a third in foams and filled rubbers, all where it breaks",
        ),
        Parameter(
            name="softening_strain",
            unit="-",
            low=0.005,
            high=5.0,
            prior=Normal(float(np.log(0.2)), 1.0),
            scale="log",
            limit=None,
            shown=0.2,
            reason="0.35 of a shoe foam pressed by 0.6, 0.1 of a food that breaks",
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """With a single loading, softening looks like relaxation."""
        for recording in conditions.recordings:
            if isinstance(recording, CompressionConditions):
                travel = np.abs(recording.displacement_mm - recording.displacement_mm[0])
                if presses_again(travel):
                    return None
        return "no sample is loaded again after it was unloaded"

    def act(self, state: Curve, values: Values) -> None:
        """Soften what lies below the largest strain so far."""
        lost, scale = numbers(values["softened_fraction"]), numbers(values["softening_strain"])
        state.softening = lambda strain: _remaining(strain, lost, scale)


def _remaining(strain: Floats, lost: Floats, scale: Floats) -> Floats:
    """The factor on the stress at strains in the order of time."""
    size = np.abs(strain)
    return np.asarray(1.0 + lost * np.expm1(-(np.maximum.accumulate(size, axis=-1) - size) / scale))
