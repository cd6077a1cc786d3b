"""How σ bends around each contact's commanded place, in the base model: positioning scatter in second order."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.models.frf_design import frf_recordings
from underskin.surrogate.sigma_table import SigmaTable

_STEP = 0.05  # of the finite difference, in h; σ turns over lengths of 0.3 h and more
_LEAST = 0.2  # of the largest σ: nearer to where σ crosses zero, its first derivative says what scatter does


def curvature(lines: Lines, table: SigmaTable) -> Curvature:
    """∇²σ/σ and tr(H²)/σ² of each recording's contact, at the declared E and h; `lines` are collapsed."""
    campaign = lines.campaign
    assert campaign.skin.thickness_mm is not None
    step = _STEP * campaign.skin.thickness_mm
    sensors = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    moved = []
    for number, (x, y) in enumerate(((0.0, 0.0), (step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step))):
        for entry in frf_recordings(campaign):
            place = entry.position_mm or sensors[entry.sensor]
            moved.append(replace(entry, id=f"{number} {entry.id}", position_mm=(place[0] + x, place[1] + y)))
    model = compose((), replace(campaign, recordings=tuple(moved)), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    here, *_ = np.split(prediction.value.real, 5)
    _, right, left, up, down = np.split(prediction.position_slopes.real, 5, axis=1)
    hessian_x, hessian_y = (right - left) / (2e-3 * step), (up - down) / (2e-3 * step)
    scale = np.where(np.abs(here) > _LEAST * np.abs(here).max(), here, np.inf)
    square = (hessian_x**2).sum(axis=0) + (hessian_y**2).sum(axis=0)
    return Curvature((hessian_x[0] + hessian_y[1]) / scale, square / scale**2)
