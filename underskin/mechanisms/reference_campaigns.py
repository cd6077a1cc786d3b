"""One synthetic campaign of each kind, on which every law can be evaluated: all axes vary, all fields are given."""

from collections.abc import Callable, Mapping

import numpy as np

from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    FrfRecording,
    IndentationRecording,
    Recording,
    Sensor,
    SkinDescription,
)

_FREQUENCY_HZ = np.array([1.0, 3.0, 10.0, 30.0, 47.0, 49.0, 50.0, 51.0, 60.0, 100.0, 150.0, 400.0, 1000.0])
_SENSORS = (Sensor("s1", 0.0, 0.0), Sensor("s2", 4.0, 0.0), Sensor("s3", 0.0, 4.0))
_SKIN = SkinDescription(
    poisson_ratio=0.5, thickness_mm=2.5, youngs_modulus_mpa=2.0, sensor_radius_mm=1.5, sensors=_SENSORS
)


def reference_campaign(kind: Kind) -> Campaign:
    """A campaign with recordings of one kind on a skin of 2.5 mm and 2 MPa."""
    return Campaign(f"reference {kind}", _SKIN, _RECORDINGS[kind]())


def _frf() -> tuple[FrfRecording, ...]:
    lines = len(_FREQUENCY_HZ)
    recordings = []
    for number in range(12):
        sensor = _SENSORS[number % 3]
        recordings.append(
            FrfRecording(
                id=f"r{number}",
                sensor=sensor.id,
                indenter_radius_mm=(4.0, 10.0)[number // 3 % 2],
                preload_n=(0.5, 1.0, 2.0)[number // 6 + (number % 2)],
                dynamic_force_n=(0.03, 0.3)[number % 2],
                position_mm=(sensor.x_mm + 0.3 * (number % 4), sensor.y_mm + 0.2 * (number % 5)),
                load_cycles=300 * number,
                dwell_s=(2.0, 60.0, 600.0)[number % 3],
                frequency_hz=_FREQUENCY_HZ,
                frf_re_pc_per_n=np.full(lines, 5.0),
                frf_im_pc_per_n=np.zeros(lines),
            )
        )
    return tuple(recordings)


def _indentations() -> tuple[IndentationRecording, ...]:
    """Two spheres pressed in, held a moment and drawn back."""
    depth = np.concatenate([np.linspace(-0.05, 0.4, 23), np.full(5, 0.4), np.linspace(0.38, -0.1, 25)])
    time = np.linspace(0.0, 20.8, len(depth))
    return tuple(
        IndentationRecording(
            id=f"i{number}",
            indenter_radius_mm=radius,
            displacement_mm=depth,
            force_n=4 / 3 * 2.0 / 0.75 * np.sqrt(radius) * np.maximum(depth, 0.0) ** 1.5,
            time_s=time,
        )
        for number, radius in enumerate((2.5, 4.0))
    )


def _compressions() -> tuple[CompressionRecording, ...]:
    """Two cylinders of different shape, loaded and unloaded twice."""
    strain = np.tile(np.concatenate([np.linspace(0, 0.4, 20), np.linspace(0.38, 0, 20)]), 2)
    return tuple(
        CompressionRecording(
            id=f"c{number}",
            sample_height_mm=height,
            sample_diameter_mm=30.0,
            displacement_mm=height * strain,
            force_n=2.0 * np.pi / 4 * 30.0**2 * strain,
            time_s=np.arange(80.0),
        )
        for number, height in enumerate((30.0, 15.0))
    )


_RECORDINGS: Mapping[Kind, Callable[[], tuple[Recording, ...]]] = {
    "frf": _frf,
    "indentation": _indentations,
    "compression": _compressions,
}
