"""What the commands answer: columns in lab units in and out; a single number holds for all rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from underskin.findings.finding import Finding
from underskin.physics import half_space
from underskin.physics.skin import Indenter, Skin
from underskin.prediction import plausibility
from underskin.prediction.pressed_skin import Transmission, transmission
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, checked, finite, non_negative, to_lab, to_si

Model = Literal["layer", "half_space"]


@dataclass(frozen=True)
class Answer:
    """Columns by field name, and which rows are inside the `domain` (NaN in what depends on σ where not)."""

    columns: Mapping[str, Floats]
    inside: NDArray[np.bool_]
    domain: str
    findings: Sequence[Finding] = ()


def sigma(table: SigmaTable, given: Mapping[str, Floats], model: Model) -> Answer:
    """σ from `a_over_h`, `rt_over_h` and `load_parameter`; raises InvalidInput."""
    a, rho, load = (non_negative(name, given[name]) for name in ("a_over_h", "rt_over_h", "load_parameter"))
    if model == "layer":
        found, domain = table.sigma(a, rho, load), _table_domain(table)
    else:
        found, domain = half_space.sigma_in_domain(a, rho), f"a/h and rT/h 0 to {half_space.DOMAIN_END:g}"
    return Answer({"sigma": found.sigma, "rel_error": found.rel_error}, found.inside, domain)


def frf(table: SigmaTable, given: Mapping[str, Floats], units_checked: bool) -> Answer:
    """What the sensor should answer to the preload, and what leads to it; raises InvalidInput."""
    reached = pressed(table, given, units_checked)
    d33 = checked("d33_pc_per_n", given["d33_pc_per_n"], units_checked=units_checked)
    return _skin_answer(table, reached, {"frf_pc_per_n": reached.frf(d33)})


def d33(table: SigmaTable, given: Mapping[str, Floats], units_checked: bool) -> Answer:
    """d33 and its standard uncertainty from a measured FRF, and what leads to them; raises InvalidInput."""
    reached = pressed(table, given, units_checked)
    finite("frf_pc_per_n", given["frf_pc_per_n"])
    if not np.isnan(given["frf_uncertainty_pc_per_n"]).all():  # unknown: then d33's is NaN
        non_negative("frf_uncertainty_pc_per_n", given["frf_uncertainty_pc_per_n"])
    measured = (to_si(name, given[name]) for name in ("frf_pc_per_n", "frf_uncertainty_pc_per_n"))
    value, uncertainty = reached.d33(*measured)
    answer = _skin_answer(table, reached, {"d33_pc_per_n": value, "d33_uncertainty_pc_per_n": uncertainty})
    looked_at = plausibility.of_rows(given["frf_pc_per_n"], answer.columns["d33_pc_per_n"])
    return replace(answer, findings=looked_at)


def pressed(table: SigmaTable, given: Mapping[str, Floats], units_checked: bool) -> Transmission:
    """What reaches the sensor of a skin described in lab units; raises InvalidInput."""
    skin = Skin.from_lab(
        thickness_mm=given["thickness_mm"],
        youngs_modulus_mpa=given["youngs_modulus_mpa"],
        sensor_radius_mm=given["sensor_radius_mm"],
        poisson_ratio=given["poisson_ratio"],
        units_checked=units_checked,
    )
    indenter = Indenter.from_lab(indenter_radius_mm=given["indenter_radius_mm"], units_checked=units_checked)
    return transmission(table, skin, indenter, checked("preload_n", given["preload_n"], units_checked=units_checked))


def lab_columns(reached: Transmission) -> dict[str, Floats]:
    """A transmission as columns in lab units."""
    return {
        "contact_radius_mm": to_lab("contact_radius_mm", reached.contact_radius),
        "a_over_h": reached.a_over_h,
        "rt_over_h": reached.rt_over_h,
        "load_parameter": reached.load_parameter,
        "sigma": reached.sigma,
        "rel_error": reached.rel_error,
        "mean_stress_mpa": to_lab("mean_stress_mpa", reached.mean_stress),
    }


def _skin_answer(table: SigmaTable, reached: Transmission, results: Mapping[str, Floats]) -> Answer:
    in_lab_units = {name: to_lab(name, values) for name, values in results.items()}
    return Answer(lab_columns(reached) | in_lab_units, reached.inside, f"{_table_domain(table)}, Poisson's ratio 0.5")


def _table_domain(table: SigmaTable) -> str:
    symbols = {"a_over_h": "a/h", "rt_over_h": "rT/h", "load_parameter": "L"}
    return ", ".join(f"{symbols[name]} {low:g} to {high:g}" for name, (low, high) in table.domain.items())
