"""How σ bends around each contact's commanded place, in the base model: positioning scatter in second order."""

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.mechanisms.models.composed import compose
from underskin.recordings.conditions import Conditions, FrfConditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable

_STEP = 0.05  # of the finite difference, in h; σ turns over lengths of 0.3 h and more
_DIGITS = 9  # of a place beside its sensor [mm]
_LEAST = 0.2  # of the largest σ: nearer to where σ crosses zero, its first derivative says what scatter does


def curvature(lines: Lines, table: SigmaTable) -> Curvature:
    """∇²σ/σ and tr(H²)/σ² of each recording's contact, at the declared E and h; `lines` are collapsed."""
    campaign = lines.campaign
    assert campaign.skin.thickness_mm is not None
    step = _STEP * campaign.skin.thickness_mm
    sensors = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    contacts: dict[tuple[float, ...], tuple[int, FrfConditions]] = {}  # alike in the base model: a place among them
    alike = []
    for entry in frf_of(campaign):
        x, y = entry.position_mm or sensors[entry.sensor]
        own_x, own_y = sensors[entry.sensor]
        key = entry.preload_n, entry.indenter_radius_mm, round(x - own_x, _DIGITS), round(y - own_y, _DIGITS)
        alike.append(contacts.setdefault(key, (len(contacts), entry))[0])
    moved = []
    for number, (x, y) in enumerate(((0.0, 0.0), (step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step))):
        for _, entry in contacts.values():
            place = entry.position_mm or sensors[entry.sensor]
            here = (place[0] + x, place[1] + y)
            moved.append(entry.without_measurements(id=f"{number} {entry.id}", position_mm=here))
    model = compose((), Conditions(campaign.name, campaign.skin, tuple(moved)), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    value, *_ = np.split(prediction.value.real, 5)
    _, right, left, up, down = np.split(prediction.position_slopes.real, 5, axis=1)
    hessian_x, hessian_y = (right - left) / (2e-3 * step), (up - down) / (2e-3 * step)
    scale = np.where(np.abs(value) > _LEAST * np.abs(value).max(), value, np.inf)
    square = (hessian_x**2).sum(axis=0) + (hessian_y**2).sum(axis=0)
    return Curvature(((hessian_x[0] + hessian_y[1]) / scale)[alike], (square / scale**2)[alike])
