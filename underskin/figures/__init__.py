"""Figures of arrays, FRFs, histories and designs: the same in pages, reports and notebooks.

They are built from columns in lab units. Colours can be told apart by colour-blind readers, and what a colour shows is
also shown by a marker, a dash or the text under the pointer.
"""

from underskin.figures.array import Quantity, array_map, frf_versus_preload, response_per_sensor
from underskin.figures.curves import ForceCurve, force_curves
from underskin.figures.design import Mark, array_response, design_overview
from underskin.figures.frf import frf_overview, frf_recordings
from underskin.figures.history import SensorPoints, array_history, d33_history
from underskin.figures.loads import loaded_array, pressure_on_array
from underskin.figures.traces import raw_traces

__all__ = [
    "ForceCurve",
    "Mark",
    "Quantity",
    "SensorPoints",
    "array_history",
    "array_map",
    "array_response",
    "d33_history",
    "design_overview",
    "force_curves",
    "frf_overview",
    "frf_recordings",
    "frf_versus_preload",
    "loaded_array",
    "pressure_on_array",
    "raw_traces",
    "response_per_sensor",
]
