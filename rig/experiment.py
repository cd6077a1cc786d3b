"""An experiment as its description (`experiment/1`) states it, in the lab's units: mm, N, MPa, pC, Hz.

These units are consistent (N = MPa mm²), so the rig calculates in them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rig.effects import Values

SCHEMA = "experiment/1"
MOST_RECORDINGS = 5000


@dataclass(frozen=True)
class DeclaredSkin:
    """The skin as declared; `sensors` holds ids and centres. d33 is the true value, stated only in the truth."""

    thickness_mm: float
    youngs_modulus_mpa: float
    sensor_radius_mm: float
    d33_pc_per_n: float
    sensors: tuple[tuple[str, float, float], ...]
    id: str | None = None
    width_mm: float | None = None
    length_mm: float | None = None


@dataclass(frozen=True)
class RecordingDesign:
    """The recordings: every combination of the lists; dwell times and dynamic forces are assigned at random."""

    indenters_mm: tuple[float, ...] = (4.0,)
    preloads_n: tuple[float, ...] = (1.0,)
    dynamic_forces_n: tuple[float, ...] = (0.09,)
    offsets_mm: tuple[tuple[float, float], ...] = ((0.0, 0.0),)  # commanded, from the sensor's centre
    sensors: tuple[str, ...] = ()  # all of them where empty
    repeats: int = 1
    dwells_s: tuple[float, ...] = ()
    cycles_per_recording: float | None = None
    start: str | None = None  # time of the first recording
    minutes_per_recording: float = 5.0
    shuffled: bool = False
    most_recordings: int | None = None


@dataclass(frozen=True)
class LineGrid:
    """FRF lines, evenly spaced in the logarithm of the frequency."""

    low_hz: float
    high_hz: float
    count: int


@dataclass(frozen=True)
class Drive:
    """Time series: what the shaker does, and the electronics."""

    kind: str = "random"
    low_hz: float = 1.0
    high_hz: float = 130.0
    sample_rate_hz: float = 2048.0
    duration_s: float = 16.0
    steps: int = 20  # of the stepped sine
    charge_noise_pc: float = 0.005  # rms, white, over the whole band
    flicker_corner_hz: float = 1.0
    force_noise_n: float = 1e-5
    converter_bits: int = 24
    charge_range_pc: float = 500.0
    force_range_n: float = 20.0


@dataclass(frozen=True)
class Noise:
    """Gain and position scatter of a recording, and noise of FRF lines: variance rel² |G|² + floor² of each part.

    rel = `line` · (1 + `low` (low end)/f + `high` (f/(high end))²).
    """

    gain: float = 0.02
    position_mm: float = 0.0
    line: float = 0.01
    low: float = 0.5
    high: float = 0.5
    floor_pc_per_n: float = 0.02
    averages: float = 16.0
    coherence: bool = True


@dataclass(frozen=True)
class CurveDesign:
    """Force–displacement curves of the elastomer, kinds indentation and compression."""

    indenters_mm: tuple[float, ...] = (4.0,)
    heights_mm: tuple[float, ...] = (10.0,)
    diameters_mm: tuple[float, ...] = (20.0,)
    largest_displacement_mm: float = 0.5
    tension: bool = False  # a compression machine also pulls
    samples: int = 200
    speeds_mm_per_s: tuple[float, ...] = (0.1,)
    repeats: int = 1
    hold_s: float = 0.0
    force_noise_n: float = 1e-3
    displacement_noise_mm: float = 0.0
    contact_point_mm: float = 0.02  # scatter of the zero of displacement
    modulus_declared: bool = True
    modulus_scatter: float = 0.0  # log-normal: true E over declared E
    times: bool = True
    approach_mm: float | None = None  # travel of the stage in the air, of a sphere
    retreat_mm: float | None = None
    retract: bool = True  # otherwise the recording of a sphere ends at the largest depth
    stage_stiffness_n_per_mm: float | None = None  # its deflection is subtracted; rigid where not given
    stage_declared: bool = True
    gain: float = 0.0  # of the force cell, log-normal, a curve
    cell_gain: float = 0.0  # the same for all curves
    force_zero_n: float = 0.0  # scatter of the zero of force
    drift_n_per_s: float = 0.0  # scatter of the baseline's slopes
    drift_n_per_mm: float = 0.0
    force_step_n: float = 0.0  # of the converters
    displacement_step_mm: float = 0.0
    units_checked: bool = False  # stated in the campaign


@dataclass(frozen=True)
class Experiment:
    """A whole experiment; `document` is the description that it came from."""

    name: str
    seed: int
    kind: str
    skin: DeclaredSkin
    design: RecordingDesign
    lines: LineGrid | None
    drive: Drive | None
    curves: CurveDesign | None
    noise: Noise
    effects: dict[str, Values]
    document: Mapping[str, Any] = field(repr=False)
