"""What an explanation of curves leaves, and where: the report's `remainder`."""

from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.reporting.numbers import rounded
from underskin.diagnosis.selection.answers import remainder
from underskin.findings.formatting import in_digits
from underskin.mechanisms.models.curves import CurveModel
from underskin.recordings.campaign import curves_of

_PARTS = 10  # tenths of the depth: curves are summed up in some hundred samples


def remainder_document(problem: FittingProblem, explanation: Explanation) -> dict[str, Any] | None:
    """The smooth error of the force beyond an explanation: percent of the largest force, its size over a sample's
    noise, the axis along which it was looked for, and a statement with the tenth of the depth where it is largest.

    None of FRFs, and where nothing stands out of the noise.
    """
    found = remainder(explanation)
    model, lines = explanation.model, problem.lines
    if found is None or not isinstance(model, CurveModel):
        return None
    square = (lines.value - model.predict(explanation.point.fit).value).real ** 2
    depths = []
    contacts = explanation.point.fit[model.contact_points].tolist()
    for curve, at, rows in zip(curves_of(lines.campaign), contacts, lines.spans, strict=True):
        travel = curve.displacement_mm - at
        travel = travel * np.sign(travel[np.abs(lines.value[rows].real).argmax()])  # also of pulled samples
        depths.append(travel / max(float(travel.max()), 1e-12))
    depth = np.concatenate(depths)
    part = np.minimum((_PARTS * depth[depth > 0]).astype(np.intp), _PARTS - 1)
    mean = np.bincount(part, square[depth > 0], _PARTS) / np.maximum(np.bincount(part, minlength=_PARTS), 1)
    low, high = (round(100 * end / _PARTS) for end in (int(mean.argmax()), int(mean.argmax()) + 1))
    percent, over_noise = 100 * found[0], found[1]
    statement = (
        f"{in_digits(percent, 2)} % of the largest force remains, {in_digits(over_noise, 2)} times a sample's noise, "
        f"the most at {low} to {high} % of the depth."
    )
    stated = {"percent": rounded(percent), "over_noise": rounded(over_noise)}
    return {**stated, "axis": "displacement_mm", "statement": statement}
