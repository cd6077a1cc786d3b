"""Answers of the service in columns, and the model that a request may name."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underskin.units import Floats


@dataclass(frozen=True)
class ServiceAnswer:
    """Common to all answers in columns: the model, hash of the table (None where none was read), status per row, and
    per row the limit that it exceeds, empty where it is `ok`."""

    model: str
    table_sha256: str | None
    status: NDArray[np.str_]
    limit: NDArray[np.str_]


@dataclass(frozen=True)
class FindingAnswer:
    """A suspicious value: its field, the first such row (None for a single value), in words, and its code."""

    field: str
    index: int | None
    statement: str
    code: str = ""  # older servers send none


@dataclass(frozen=True)
class SigmaAnswer(ServiceAnswer):
    """σ and the bound on its relative error."""

    sigma: Floats
    rel_error: Floats


@dataclass(frozen=True)
class PressedSkinAnswer(ServiceAnswer):
    """Contact and stress on the sensor; units in the names, the others dimensionless. `contact`: `paper` or `solved`;
    None with an adopted model."""

    contact: str | None
    contact_radius_mm: Floats
    a_over_h: Floats
    rt_over_h: Floats
    load_parameter: Floats
    sigma: Floats
    rel_error: Floats
    mean_stress_mpa: Floats


@dataclass(frozen=True)
class FrfAnswer(PressedSkinAnswer):
    """The FRF on the plateau and, where frequencies were given, its parts with one more axis for them."""

    frf_pc_per_n: Floats
    model_id: str | None = None
    frequency_hz: Floats | None = None
    frf_re_pc_per_n: Floats | None = None
    frf_im_pc_per_n: Floats | None = None


@dataclass(frozen=True)
class D33Answer(PressedSkinAnswer):
    """d33 with its standard uncertainty, and the plateau that was inverted."""

    frf_pc_per_n: Floats
    frf_uncertainty_pc_per_n: Floats
    d33_pc_per_n: Floats
    d33_uncertainty_pc_per_n: Floats
    findings: tuple[FindingAnswer, ...] = ()
    model_id: str | None = None
    frf_im_pc_per_n: Floats | None = None


@dataclass(frozen=True)
class StressAnswer(ServiceAnswer):
    """The load on each sensor: id, position, charge with the table's error, and stress (positive in compression).

    `contact`: `paper` or `solved`; `contact_radius_mm`: one entry a contact, none for a map.
    """

    contact: str | None
    sensor: tuple[str, ...]
    x_mm: Floats
    y_mm: Floats
    charge_pc: Floats
    charge_error_pc: Floats
    mean_stress_mpa: Floats
    reach_mm: float
    contact_radius_mm: Floats
    findings: tuple[FindingAnswer, ...]


@dataclass(frozen=True)
class Adopted:
    """The adopted model of a skin, and the columns that it may need (`client.skins.model(...).needs`)."""

    skin_id: str
    sensor: str | None = None
    offset_x_mm: ArrayLike | None = None
    offset_y_mm: ArrayLike | None = None
    dynamic_force_n: ArrayLike | None = None
    dwell_s: ArrayLike | None = None
    load_cycles: ArrayLike | None = None

    def fields(self) -> dict[str, Any]:
        """The fields of the request."""
        return {"model": "adopted", **vars(self)}
