"""The truth about a campaign: the law, what the design cannot distinguish from it, and the gain from modelling it.

All fits use the true equations and noise levels (`fits.py`). Rivals are those that leave less than
`INDISTINCT` more chi2 than the law's own form at its best:

- form_also: another form, acting on the same quantity along the same axis;
- axis_also: another axis, acting on the same quantity, with any form;
- acts_on_also: another quantity, along the same axis or one of axis_also, with any form. Modulus, force and contact
  radius are always rivals of one another: E/s^3, F s^3 and a s are the same contact.

`chi2_gain_over_best_listed` is the gain over the best single mechanism of the published catalogue (`listed.py`): the
gain over the base model less what that mechanism gains over the base model from the same numbers. A law is identifiable
if both gains exceed `IDENTIFIABLE`; otherwise no diagnosis can state that a law acts, or that it is unlisted.

A free form fits whatever a narrower one does; it counts as a rival of free laws only. Positions may move along x or y.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from rig.unlisted.bench import (
    Companion,
    Measurement,
    State,
    base_state,
    companion_column,
    log_amplitude,
    responses,
    state,
)
from rig.unlisted.design import Design, axes
from rig.unlisted.fits import Lines, base_chi2, fit_shapes, predict, value
from rig.unlisted.forms import MULTIPLICATIVE, Shape, candidates
from rig.unlisted.laws import STATIC, Law, multiplies
from rig.unlisted.listed_lines import lines_chi2
from rig.unlisted.listed_static import static_chi2
from rig.unlisted.observed import Observed, amplitudes, loss_angles
from rig.unlisted.response import FREQUENCY_FORMS
from rig.unlisted.wording import expression

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Index = npt.NDArray[np.intp]

INDISTINCT = 10.0
CONTACT = {"modulus", "force", "contact_radius"}
IDENTIFIABLE = 20.0
CLEAN_LINE = 0.05
"""Lines with more relative noise than this are left out of the held-out percentages."""


def observe(design: Design, data: Measurement, law: Law, companion: Companion | None) -> Observed:
    """The numbers in which a law not along frequency is visible."""
    truth = state(design, law)
    if law.acts_on == "frequency_response":
        return loss_angles(design, data, responses(design, None, companion, base_state(design)))
    return amplitudes(design, data, responses(design, law, companion, truth), companion, truth)


def size_percent(design: Design, law: Law) -> tuple[float, float]:
    """Root mean square change of the FRF, with d33 refitted and with d33 kept."""
    truth = state(design, law)
    if law.acts_on != "frequency_response":
        change = log_amplitude(design, truth) - log_amplitude(design, base_state(design))
        return 100.0 * float(change.std()), 100.0 * float(np.sqrt((change**2).mean()))
    h = responses(design, law, None, truth)
    level = float(h.real.sum() / h.size)
    return tuple(100.0 * float(np.sqrt((np.abs(h / a - 1.0) ** 2).mean())) for a in (level, 1.0))  # type: ignore[return-value]


class Rivals:
    """chi2 of each requested (acts_on, axis, form)."""

    def __init__(self, observed: Observed, law: Law) -> None:
        self.observed, self.law = observed, law
        self.shapes: dict[tuple[bool, str], list[Shape]] = {}

    def forms(self, acts_on: str, axis: str) -> dict[str, float]:
        """The least chi2 of each form of one quantity along one axis."""
        design, law = self.observed.design, self.law
        is_axis_of_law = axis == law.axis
        key = (multiplies(acts_on), axis)
        if key not in self.shapes:
            barred = {"free"} - {law.form} | (set() if multiplies(acts_on) else set(MULTIPLICATIVE))
            usable = [s for s in candidates(axis, design.columns[axis]) if s.form not in barred]
            fair = is_axis_of_law and law.form not in barred
            self.shapes[key] = [*usable, law.on(design)] if fair else usable
        shapes = self.shapes[key]
        start = np.array(law.coefficients) if is_axis_of_law and acts_on == law.acts_on else None
        chi2: dict[str, float] = {}
        for along in ("x", "y") if acts_on == "position" else ("",):
            for fit in fit_shapes(self.observed, acts_on, along, shapes, start):
                name = "notch" if fit.shape.form == "peak" and fit.coefficients[0] < 0 else fit.shape.form
                chi2[name] = min(chi2.get(name, np.inf), fit.chi2)
        return chi2

    def close(self, acts_on: str, names: Iterable[str], limit: float) -> list[str]:
        """Axes on which some form of one quantity comes within the limit."""
        return [n for n in names if min(self.forms(acts_on, n).values(), default=np.inf) < limit]


def _gains(over_base: float, base: float, listed: dict[str, float]) -> dict[str, Any]:
    """Gains of a law over the base model and over the best listed mechanism, from chi2 of both on the same numbers."""
    best = min(listed, key=lambda name: listed[name])
    return {
        "chi2_gain_over_base": over_base,
        "chi2_gain_over_best_listed": over_base - (base - listed[best]),
        "best_listed": best,
    }


def _listed(
    observed: Observed, data: Measurement, law: Law, companion: Companion | None
) -> tuple[float, dict[str, float]]:
    """chi2 of the base model, and of each listed mechanism, on the numbers that tell them apart; see `listed.py`."""
    design = observed.design
    truth = state(design, law)
    if law.acts_on == "frequency_response":
        lines = Lines(design, data, companion, truth)
        return float((lines.residual("", lines.extra) ** 2).sum()), lines_chi2(lines)
    if companion is None:
        return base_chi2(observed), static_chi2(observed)
    untouched = amplitudes(design, data, responses(design, law, companion, truth), None, truth)
    return base_chi2(observed), static_chi2(observed, companion.name, untouched)


def _static_truth(design: Design, data: Measurement, law: Law, companion: Companion | None) -> dict[str, Any]:
    rivals = Rivals(observe(design, data, law, companion), law)
    forms_of_law = rivals.forms(law.acts_on, law.axis)
    best = (
        forms_of_law[law.name] if law.name in forms_of_law else forms_of_law["peak" if law.name == "notch" else "notch"]
    )
    limit = best + INDISTINCT
    axis_also = rivals.close(law.acts_on, [n for n in axes(design) if n != law.axis], limit)
    other_quantities = [q for q in STATIC if q != law.acts_on] if law.acts_on != "frequency_response" else []
    over_base = base_chi2(rivals.observed) - best
    return _gains(over_base, *_listed(rivals.observed, data, law, companion)) | {
        "form_also": sorted(n for n, chi2 in forms_of_law.items() if n != law.name and chi2 < limit),
        "axis_also": sorted(axis_also),
        "acts_on_also": sorted(
            q for q in other_quantities if {q, law.acts_on} <= CONTACT or rivals.close(q, [law.axis, *axis_also], limit)
        ),
    }


def _spectral_truth(design: Design, data: Measurement, law: Law, companion: Companion | None) -> dict[str, Any]:
    lines = Lines(design, data, companion, state(design, law))
    _, base = lines.base()
    chi2_of_forms: dict[str, float] = {}
    for form in FREQUENCY_FORMS:
        if form == "free" and law.form != "free":
            continue
        p, chi2 = lines.fit(form, np.array(law.coefficients) if form == law.form else None)
        chi2_of_forms["notch" if form == "peak" and p[0] < 0 else form] = chi2
    best = chi2_of_forms.get(law.name, min(chi2_of_forms.values()))
    also = sorted(n for n, chi2 in chi2_of_forms.items() if n != law.name and chi2 < best + INDISTINCT)
    return _gains(base - best, base, lines_chi2(lines)) | {"form_also": also, "axis_also": [], "acts_on_also": []}


def noise_floor(design: Design, data: Measurement) -> float:
    """Root mean square relative noise of the clean lines, percent."""
    clean = np.sqrt(data.line_variance) < CLEAN_LINE
    total = design.noise.gain**2 + data.position_variance[:, None] + 2.0 * data.line_variance
    return 100.0 * float(np.sqrt((total * clean).sum() / clean.sum()))


def _error(data: Measurement, observed: Observed, level: Array, response: Complex, train: Index, test: Index,
           change: Array) -> float:  # fmt: skip
    predicted = np.exp(predict(observed, change, train, test) + level[test])[:, None] * response[test]
    clean = np.sqrt(data.line_variance[test]) < CLEAN_LINE
    error = np.abs(data.frf[test] / predicted - 1.0) ** 2
    return 100.0 * float(np.sqrt((error * clean).sum() / clean.sum()))


def held_out(
    design: Design, data: Measurement, law: Law | None, companion: Companion | None, test: Index
) -> dict[str, float]:
    """Errors on held-out recordings: base model, base model with its companion, and with the law fitted."""
    train = np.setdiff1d(np.arange(design.count), test)
    truth = state(design, law)
    base = log_amplitude(design, base_state(design))
    zero, flat = np.zeros(design.count), np.ones(data.frf.shape, dtype=np.complex128)
    bare = _error(data, amplitudes(design, data, flat, None, truth), base, flat, train, test, zero)
    lines = Lines(design, data, companion, truth, train)
    with_companion = lines.response("", lines.base()[0])
    extra = static_extra(design, companion, truth)
    observed = amplitudes(design, data, with_companion, companion, truth)
    plain = _error(data, observed, base + extra, with_companion, train, test, zero)
    if law is None:
        ideal = plain
    elif law.spectral:
        h = lines.response(law.form, lines.fit(law.form, np.array(law.coefficients))[0])
        ideal = _error(data, amplitudes(design, data, h, companion, truth), base + extra, h, train, test, zero)
    else:
        column = design.columns[law.axis]
        shapes = [s for s in candidates(law.axis, column) if s.form == law.form] + [law.on(design)]
        seen = observe(design, data, law, companion) if law.acts_on == "frequency_response" else observed
        fits = fit_shapes(seen, law.acts_on, law.along, shapes, np.array(law.coefficients), train)
        change = value(min(fits, key=lambda f: f.chi2), seen, law.acts_on, law.along)
        if law.acts_on == "frequency_response":
            h = with_companion * np.exp(-1j * change)[:, None]
            ideal = _error(data, amplitudes(design, data, h, companion, truth), base + extra, h, train, test, zero)
        else:
            ideal = _error(data, observed, base + extra, with_companion, train, test, change)
    return {"heldout_ideal_percent": ideal, "heldout_base_percent": plain, "heldout_bare_base_percent": bare}


def static_extra(design: Design, companion: Companion | None, truth: State) -> Array:
    """The contribution of a static companion to ln |FRF|; `amplitudes` subtracts it, predictions add it."""
    return companion_column(design, companion, truth)[0] if companion else np.zeros(design.count)


def describe(
    design: Design, data: Measurement, law: Law | None, companion: Companion | None, test: Index
) -> dict[str, Any]:
    """The entry of one campaign in `truth.json`, without the numbers of its file."""
    document: dict[str, Any] = {
        "effects": [companion.name] if companion else [],
        "kind": "unknown" if law else "nothing",
        "law": None,
        "altered": bool(law and law.altered),
        "identifiable": False,
        "chi2_gain_over_base": 0.0,
        "chi2_gain_over_best_listed": 0.0,
        "best_listed": None,
        "form_also": [], "axis_also": [], "acts_on_also": [],
    }  # fmt: skip
    if law is not None:
        refit, size = size_percent(design, law)
        names = {"parameters": list(law.parameters), "coefficients": list(law.coefficients), "along": law.along}
        document["law"] = {
            "acts_on": law.acts_on, "axis": law.axis, "form": law.name, "expression": expression(law, design),
            "size_percent": refit, "size_with_d33_kept_percent": size, "parameters": names,
        }  # fmt: skip
        document |= (_spectral_truth if law.spectral else _static_truth)(design, data, law, companion)
        gains = (document["chi2_gain_over_base"], document["chi2_gain_over_best_listed"])
        document["identifiable"] = min(gains) > IDENTIFIABLE
    document |= held_out(design, data, law, companion, test)
    noise = design.noise
    document |= {
        "noise_floor_percent": noise_floor(design, data),
        "companion_parameters": list(companion.parameters) if companion else [],
        "d33_pc_per_n": [float(v) for v in np.exp(data.log_d33)],
        "noise": {
            "gain": noise.gain, "line": noise.line, "low": noise.low, "high": noise.high, "floor": noise.floor,
            "position_mm": noise.position_mm, "averages": noise.averages,
        },
        "finite_strain_chi2": design.finite_strain_chi2,
        "recordings": design.count,
        "lines": int(design.frequency_hz.size),
    }  # fmt: skip
    return document
