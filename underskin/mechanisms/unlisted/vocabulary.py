"""The words of the grammar, as used in reports."""

from typing import Literal

ActsOn = Literal["gain", "modulus", "thickness", "contact_radius", "force", "position", "frequency_response"]
Form = Literal["linear", "power", "exponential", "saturating", "threshold", "step", "periodic", "peak", "notch", "free"]
ACTS_ON: dict[ActsOn, tuple[str, str]] = {  # name and symbol
    "gain": ("gain of the charge", "Q"),
    "modulus": ("modulus", "E"),
    "thickness": ("thickness", "h"),
    "contact_radius": ("contact radius", "a"),
    "force": ("force on the skin", "F"),
    "position": ("place of the contact", "x"),
    "frequency_response": ("frequency response", "FRF"),
}
AXES: dict[str, tuple[str, str, str]] = {  # of built-in axes the words, the symbol and the unit
    "preload_n": ("the preload", "F", "N"),
    "previous_preload_n": ("the preload of the recording before", "Fprev", "N"),
    "indenter_radius_mm": ("the radius of the sphere", "R", "mm"),
    "dynamic_force_n": ("the dynamic force", "Fd", "N"),
    "load_cycles": ("the load cycles", "N", "cycles"),
    "dwell_s": ("the time under preload", "t", "s"),
    "recorded_at": ("the time", "t", "h"),
    "time_of_day": ("the time of day", "t", "h"),
    "order": ("the order of the recordings", "k", "-"),
    "x_mm": ("the place along x", "x", "mm"),
    "y_mm": ("the place along y", "y", "mm"),
    "sensor": ("the sensor", "sensor", "-"),
    "frequency_hz": ("frequency", "f", "Hz"),
    "displacement_mm": ("the depth", "d", "mm"),
    "force_n": ("the force", "F", "N"),
    "time_s": ("the time", "t", "s"),
}
OF_SAMPLES = ("displacement_mm", "force_n", "time_s")  # axes of laws on curves
OF_CURVES: dict[str, str] = {  # quantities that laws of curves act on, with their names
    "modulus": "modulus",
    "gain": "gain of the cell",
    "force": "force that is read",
    "position": "place of the surface",
}


def acted_on(acts_on: str, axis: str) -> str:
    """The quantity a law acts on, in words; for an axis of samples the quantity on a curve."""
    if axis in OF_SAMPLES and acts_on in OF_CURVES:
        return OF_CURVES[acts_on]
    return next((words for name, (words, _) in ACTS_ON.items() if name == acts_on), acts_on.replace("_", " "))


def followed(axis: str) -> str:
    """The axis that a law follows, in words; a lab's own column by its heading."""
    return AXES[axis][0] if axis in AXES else axis
