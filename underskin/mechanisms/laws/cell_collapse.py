"""The mechanism `cell_collapse`."""

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.curve_state import Curve, numbers
from underskin.recordings.campaign import CompressionConditions, CompressionRecording, Conditions
from underskin.units import Floats

_PLATEAU_SHOWS = 0.1  # strain, twice that at which the cells of elastomeric foams collapse
_PACKED = 0.95  # of the strain of densification, beyond which the law goes on as a straight line


class CellCollapse(Mechanism):
    """A foam: its cells collapse at a plateau of stress, and are packed in the end."""

    name = "cell_collapse"
    plain = """The sample is a foam, whose cell walls buckle, so that beyond a first stiff part the force hardly rises
    as it is pressed, until the cells are packed and it rises steeply."""
    law = """Nominal stress E ε_c (1 − e^(−ε/ε_c))/(1 − ε/ε_D) in compression, E ε in tension: E ε at first, a plateau
    at E ε_c from the strain of collapse ε_c on, and densification towards ε_D."""
    assumptions = """does not widen as it is pressed (Poisson's ratio 0), so that platens do not stiffen it; one knee
    and one densification for all cells; the same way in and back. It takes the place of the incompressible solid, its
    stiffening included; with ε_c and ε_D large it is nearly that solid again. Beyond 0.95 ε_D the last factor goes on
    as its tangent."""
    source = """Gibson & Ashby, Cellular Solids (1997), sections 5.2 and 5.3: elastic collapse at a strain of 0.05,
    ε_D = 1 − 1.4 of the relative density; Rusch, J. Appl. Polym. Sci. 13 (1969) 2297; Avalle, Belingardi & Ibba, Int.
    J. Impact Eng. 34 (2007) 3, for the exponential knee."""
    needs = "a sample that is pressed by a tenth of its height"
    stage = Stage.MATERIAL
    order = 50
    kinds = ("compression",)
    axes = ("displacement_mm",)
    parameters_stated = (
        Parameter(
            name="collapse_strain",
            unit="-",
            low=0.005,
            high=2.0,
            prior=Normal(float(np.log(0.1)), 0.7),
            scale="log",
            limit=None,
            shown=0.1,
            reason="cells buckle at a strain of 0.05; by an exponential knee shoe foams have 0.1 to 0.2",
        ),
        Parameter(
            name="densification_strain",
            unit="-",
            low=0.3,
            high=1.0,
            prior=Normal(0.8, 0.15),
            scale="linear",
            limit=None,
            shown=0.8,
            closed=(1.0,),
            reason="1 − 1.4 of the relative density, which is 0.05 to 0.3",
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Where no sample is pressed far enough, a plateau cannot show."""
        pressed = [_pressed(recording) for recording in conditions.of(CompressionConditions)]
        if max(pressed, default=0.0) < _PLATEAU_SHOWS:
            return f"no sample is pressed by {100 * _PLATEAU_SHOWS:g} % of its height"
        return None

    def act(self, state: Curve, values: Values) -> None:
        """Replace the solid by a foam."""
        collapse, packed = numbers(values["collapse_strain"]), numbers(values["densification_strain"])
        state.foam = lambda strain: _stress_over_modulus(strain, collapse, packed)


def _stress_over_modulus(strain: Floats, collapse: Floats, packed: Floats) -> Floats:
    pressed = np.maximum(strain, 0.0)
    filled = np.minimum(pressed / packed, _PACKED)
    densified = (1 + (pressed / packed - filled) / (1 - filled)) / (1 - filled)
    return np.where(strain < 0, strain, -collapse * np.expm1(-pressed / collapse) * densified)


def _pressed(recording: CompressionConditions) -> float:
    """The largest strain of a recording, compression positive."""
    unloaded = 0.0
    if isinstance(recording, CompressionRecording):
        unloaded = float(recording.displacement_mm[np.abs(recording.force_n).argmin()])
    return float(np.max(recording.displacement_mm) - unloaded) / recording.sample_height_mm
