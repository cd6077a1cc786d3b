"""Answers of server and command line on a pressed skin: columns in lab units; a single number holds for all rows.

Also d33 by the other contact model, where both differ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from underskin.errors import InvalidInput
from underskin.findings.finding import Finding
from underskin.findings.formatting import significant
from underskin.physics import half_space
from underskin.physics.charge_response import Indenter, Skin, gain
from underskin.prediction.columns import rows
from underskin.prediction.pressed_skin import Transmission, Words, in_words, of_numbers, of_pressed, transmission
from underskin.recordings import plausibility
from underskin.surrogate.sigma_table import ContactModel, ContactName, SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import Floats, Mask, checked, finite, non_negative, to_lab, to_si

SigmaModelName = Literal["layer", "half_space"]
_SKIN = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
_DECLARED = (*_SKIN[:-1], "indenter_radius_mm", "preload_n", "d33_pc_per_n")
_FRF_UNCERTAINTY = "frf_uncertainty_pc_per_n"


@dataclass(frozen=True)
class ComputedColumns:
    """Columns by field name, and which rows are inside the `domain` (others have NaN where σ enters); `limits`: the
    exceeded limit of each row outside, None where all are inside."""

    columns: Mapping[str, Floats]
    inside: Mask
    domain: str
    limits: Words | None
    findings: Sequence[Finding] = ()


def sigma(table: SigmaTable, given: Mapping[str, Floats], model: SigmaModelName) -> ComputedColumns:
    """σ from `a_over_h`, `rt_over_h` and `load_parameter`; raises InvalidInput."""
    a, rho, load = (non_negative(name, given[name]) for name in ("a_over_h", "rt_over_h", "load_parameter"))
    if model == "layer":
        answer, domain, limited = table.sigma(a, rho, load), _table_domain(table), table.domain
    else:
        answer, domain = half_space.sigma_in_domain(a, rho), f"a/h and rT/h 0 to {half_space.DOMAIN_END:g}"
        limited = dict.fromkeys(("a_over_h", "rt_over_h"), (0.0, half_space.DOMAIN_END))
    numbers = {"a_over_h": a, "rt_over_h": rho, "load_parameter": load}
    limits = in_words(answer.inside, rows(numbers), of_numbers(numbers, limited))
    return ComputedColumns({"sigma": answer.sigma, "rel_error": answer.rel_error}, answer.inside, domain, limits)


def frf(contact_model: ContactModel, given: Mapping[str, Floats], units_checked: bool) -> ComputedColumns:
    """FRF of a sensor under a preloaded sphere, FRF = d33 (3/2) (rT/h)² σ, with intermediate results.

    Parameters
    ----------
    contact_model : the σ table, or the solved contact.
    given : columns in lab units by field name: the skin's, the sphere's and `d33_pc_per_n`, of equal length or single.
    units_checked : accept magnitudes that look like a slip of units.

    Returns
    -------
    ComputedColumns
        A row is inside where the table holds it and its FRF is finite.

    Raises
    ------
    InvalidInput
        Names the field and the row of a value that cannot be used.
    """
    reached = pressed(contact_model, given, units_checked)
    d33 = checked("d33_pc_per_n", given["d33_pc_per_n"], units_checked=units_checked)
    frf = to_lab("frf_pc_per_n", reached.frf(d33))
    return _skin_answer(contact_model, reached, given, {**lab_columns(reached), "frf_pc_per_n": frf}, frf)


def d33(contact_model: ContactModel, given: Mapping[str, Floats], units_checked: bool) -> ComputedColumns:
    """d33 of a sensor from the measured plateau of its FRF, d33 = FRF / ((3/2) (rT/h)² σ), with intermediate results.

    Parameters
    ----------
    contact_model : the σ table, or the solved contact.
    given : columns in lab units by field name: the skin's, the sphere's, `frf_pc_per_n` and perhaps
        `frf_uncertainty_pc_per_n`, the standard uncertainty; without it that of d33 is NaN.
    units_checked : accept magnitudes that look like a slip of units.

    Returns
    -------
    ComputedColumns
        With the FRF and its uncertainty. A row is inside where the table holds it and its d33 is finite. Findings name
        implausible magnitudes.

    Raises
    ------
    InvalidInput
        Names the field and the row of a value that cannot be used.
    """
    reached = pressed(contact_model, given, units_checked)
    plateau = measured(given)
    value, uncertainty = reached.d33(*(to_si(name, values) for name, values in plateau.items()))
    results = {
        "d33_pc_per_n": to_lab("d33_pc_per_n", value),
        "d33_uncertainty_pc_per_n": to_lab("d33_uncertainty_pc_per_n", uncertainty),
    }
    columns = {**plateau, **lab_columns(reached), **results}
    answer = _skin_answer(contact_model, reached, given, columns, results["d33_pc_per_n"])
    return replace(answer, findings=plausibility.of_rows(plateau["frf_pc_per_n"], results["d33_pc_per_n"]))


def measured(given: Mapping[str, Floats]) -> dict[str, Floats]:
    """The measured plateau and its uncertainty, NaN where none is given; raises InvalidInput."""
    uncertainty = np.full((), np.nan)
    if _FRF_UNCERTAINTY in given:
        uncertainty = non_negative(_FRF_UNCERTAINTY, given[_FRF_UNCERTAINTY])
    return {"frf_pc_per_n": finite("frf_pc_per_n", given["frf_pc_per_n"]), _FRF_UNCERTAINTY: uncertainty}


def refused(given: Mapping[str, Floats], units_checked: bool) -> list[InvalidInput]:
    """The errors of the declared columns among these, in lab units."""
    errors = []
    for name in (field for field in _DECLARED if field in given):
        try:
            checked(name, given[name], units_checked=units_checked)
        except InvalidInput as error:
            errors.append(error)
    return errors


def pressed(contact_model: ContactModel, given: Mapping[str, Floats], units_checked: bool) -> Transmission:
    """The transmission to the sensor of a skin described in lab units; raises InvalidInput."""
    skin = Skin.from_lab(**{name: given[name] for name in _SKIN}, units_checked=units_checked)
    indenter = Indenter.from_lab(indenter_radius_mm=given["indenter_radius_mm"], units_checked=units_checked)
    preload = checked("preload_n", given["preload_n"], units_checked=units_checked)
    return transmission(contact_model, skin, indenter, preload)


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


def _skin_answer(
    contact_model: ContactModel,
    reached: Transmission,
    given: Mapping[str, Floats],
    columns: Mapping[str, Floats],
    result: Floats,
) -> ComputedColumns:
    """The answer; a row whose result is not finite is outside, like one beyond the table."""
    domain = f"{_table_domain(contact_model)}, Poisson's ratio 0.5"
    inside = reached.inside & np.isfinite(result)
    return ComputedColumns(
        columns, inside, domain, limits_of_pressed(contact_model, reached, given, inside, rows(given))
    )


def limits_of_pressed(
    contact_model: ContactModel, reached: Transmission, given: Mapping[str, Floats], inside: Mask, count: int
) -> Words | None:
    """The exceeded limit of each row of a pressed skin that is outside; `given`: preload and Poisson's ratio."""
    limits = of_pressed(reached, given["preload_n"], contact_model)
    return in_words(inside, count, limits, given["poisson_ratio"])


def _table_domain(table: ContactModel) -> str:
    symbols = {"a_over_h": "a/h", "rt_over_h": "rT/h", "load_parameter": "L"}
    return ", ".join(f"{symbols[name]} {low:g} to {high:g}" for name, (low, high) in table.domain.items())


OTHER: Mapping[ContactName, ContactName] = {"paper": "solved", "solved": "paper"}
WORDS: Mapping[ContactName, str] = {
    "paper": "under Hertz' pressure (paper)",
    "solved": "in contact with the layer itself (solved)",
}
STATED = 0.01  # least relative difference at which the other value is stated


@dataclass(frozen=True)
class OtherContact:
    """d33 [pC/N] (rows,) by the contact `name`, NaN outside its domain, and the rows where it `differs` by more than
    1 % from the requested one."""

    name: ContactName
    d33: Floats
    ratio: Floats  # over the requested one

    @property
    def differs(self) -> Mask:
        """False where either has no value."""
        return np.abs(self.ratio - 1) > STATED

    @property
    def sentence(self) -> str:
        """In words, empty where no row differs."""
        differs = self.differs
        if not differs.any():
            return ""
        if differs.size == 1:
            return f"d33 {WORDS[self.name]}: {significant(float(self.d33.flat[0]), 4)} pC/N"
        percent = 100 * (self.ratio[differs] - 1)
        low, high = (f"{value:+z.1f}" for value in (percent.min(), percent.max()))
        by = f"{low} %" if low == high else f"{low} to {high} %"
        return f"d33 {WORDS[self.name]} differs in {differs.sum()} of {differs.size} rows, by {by}"


def other_contact(
    table: SigmaTable,
    requested: ContactName,
    given: Mapping[str, Floats],
    d33: Floats,
    *,
    units_checked: bool,
) -> OtherContact:
    """d33 by the other contact.

    Parameters
    ----------
    table : the σ table.
    requested : the contact of `d33` [pC/N] (rows,).
    given : columns in lab units by field name, as for `answers.d33`.
    units_checked : accept magnitudes that look like a slip of units.
    """
    name = OTHER[requested]
    with np.errstate(all="ignore"):  # what overflows is outside
        reached = pressed(contact_model(table, name), given, units_checked)
        other = given["frf_pc_per_n"] / gain(reached.sigma, reached.rt_over_h)
        return OtherContact(name, other, other / d33)
