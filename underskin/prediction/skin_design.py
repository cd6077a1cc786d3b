"""Design of a skin before it is built: the share of a load that reaches a sensor, how finely the array locates it, and
the least distance at which two loads are resolved (Seminara 2018, section 4, as a tool).

A sensor's *response* to a contact at the distance e from its centre is σ(e): it bears the share (3/2) ρ² σ(e) of the
force. Two loads are equal, and their responses add, as on a linear layer.
"""

from dataclasses import dataclass

import numpy as np

from underskin.physics.charge_response import Indenter, Skin
from underskin.prediction.pressed_skin import Transmission, transmission
from underskin.surrogate.off_centre_sigma import sigma_off_centre
from underskin.surrogate.sigma_table import ContactModel
from underskin.units import Floats, Mask

_SWEEP = 61  # points of a sweep
_PLACEMENTS = 13  # of the array against the contacts, over half a pitch
_DISTANCES = 160
_FINEST = 25.0  # sensors across the resolution, beyond which more make no difference


@dataclass(frozen=True)
class Sweep:
    """σ, and γ of a point load, both above the sensor's centre, along one axis; the other two are the design's own."""

    axis: str
    values: Floats
    sigma: Floats
    gamma: Floats


@dataclass(frozen=True)
class Resolution:
    """Spatial resolution of an array; lengths in m, NaN where undetermined.

    `width`: full width at half maximum of a sensor's response against the contact's position.
    `between`, `amid`: response to a contact midway between two sensors, and amid four, over that above a sensor.
    `separation`: the smallest distance from which on two equal contacts in line with a row of sensors are resolved for
    any placement of the row; `best_separation`: the smallest for the best placement. They are resolved where a sensor
    between two others reads less than both, by `dip` times the reading above a sensor.
    """

    width: float
    between: float
    amid: float
    separation: float
    best_separation: float


@dataclass(frozen=True)
class Design:
    """A skin under one contact: γ above the sensor, response and γ against the offset [m], sweeps, resolution."""

    contact: Transmission
    gamma: float
    offset: Floats
    response: Floats
    point_response: Floats
    sweeps: tuple[Sweep, ...]
    resolution: Resolution


def design(
    contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: float, pitch: float, dip: float
) -> Design:
    """The share of a load that reaches the sensors of a skin, and the resolution of its array.

    Parameters
    ----------
    contact_model
        The σ table, or the solved contact.
    skin, indenter
        One skin and sphere, in SI.
    preload
        F [N].
    pitch
        Distance between the centres of neighbouring sensors [m].
    dip
        How much less a sensor between two others must read than both for two loads to be resolved, over the reading
        above a sensor [-].

    Returns
    -------
    Design
        NaN in what lies outside the table's domain.
    """
    contact = transmission(contact_model, skin, indenter, preload)
    point = tuple(float(part) for part in (contact.small_strain_a_over_h, contact.rt_over_h, contact.load_parameter))
    h = float(skin.thickness)
    inside = bool(contact.inside)
    offset, response = sigma_off_centre(contact_model, *point) if inside else (np.zeros(1), np.full(1, np.nan))
    _, point_response = sigma_off_centre(contact_model, 0.0, point[1], 0.0) if inside else (offset, response)
    return Design(
        contact=contact,
        gamma=float(contact_model.sigma(0.0, point[1], 0.0).sigma),
        offset=offset * h,
        response=response,
        point_response=point_response,
        sweeps=_sweeps(contact_model, point),
        resolution=resolution(offset * h, response, pitch, 2 * float(contact.contact_radius), dip),
    )


def _sweeps(contact_model: ContactModel, point: tuple[float, ...]) -> tuple[Sweep, ...]:
    sweeps = []
    for axis_index, (axis, (low, high)) in enumerate(contact_model.domain.items()):
        # σ turns fastest near L = 0, where it grows like its cube root.
        values = low + (high - low) * np.linspace(0, 1, _SWEEP) ** (3 if axis == "load_parameter" else 1)
        columns = [values if index == axis_index else np.full(_SWEEP, fixed) for index, fixed in enumerate(point)]
        gamma = contact_model.sigma(0.0, columns[1], 0.0).sigma
        sweeps.append(Sweep(axis, values, contact_model.sigma(*columns).sigma, gamma))
    return tuple(sweeps)


def resolution(offset: Floats, response: Floats, pitch: float, nearest: float, dip: float) -> Resolution:
    """The resolution of an array from a sensor's response against the position of the load.

    Parameters
    ----------
    offset, response
        (n,) distance of the load from the sensor's centre [m], from 0 on, and σ there [-]; 0 beyond the last.
    pitch
        Of the array [m].
    nearest
        Smallest distance of two contacts [m], below which they would overlap.
    dip
        As for `design`.
    """
    if not bool(np.isfinite(response).all()):
        return Resolution(*[float("nan")] * 5)
    last = int(np.argmax(response < float(response[0]) / 2))  # the reach is many times the width
    pair = [last, last - 1]
    width = 2 * float(np.interp(float(response[0]) / 2, response[pair], offset[pair]))
    spacing = max(pitch, width / _FINEST)
    distances = np.linspace(nearest, nearest + 4 * spacing + 3 * width, _DISTANCES)
    resolved = are_resolved(offset, response, spacing, distances, _PLACEMENTS, dip)
    always, sometimes = (np.asarray(part) for part in (resolved.all(axis=1), resolved.any(axis=1)))
    first_resolved = len(distances) - int(np.argmin(always[::-1])) if not always.all() else 0
    between, amid = (
        float(np.interp(distance, offset, response, right=0.0)) / float(response[0])
        for distance in (pitch / 2, pitch / np.sqrt(2))
    )
    return Resolution(
        width=width,
        between=between,
        amid=amid,
        separation=float(distances[first_resolved]) if first_resolved < len(distances) else float("nan"),
        best_separation=float(distances[np.argmax(sometimes)]) if sometimes.any() else float("nan"),
    )


def are_resolved(
    offset: Floats, response: Floats, pitch: float, distances: Floats, placements: int, dip: float
) -> Mask:
    """Whether two contacts are resolved: (m, n), at each distance (m,) and for each placement of the row of sensors
    over half a pitch, of which the other half is the mirror image."""
    count = int(np.ceil(distances[-1] / 2 / pitch)) + 2
    half = distances[:, None, None] / 2
    sensors = pitch * np.arange(-count, count + 1) + pitch * np.linspace(0, 0.5, placements)[:, None]
    first, second = (np.interp(np.abs(sensors + side), offset, response, right=0.0) for side in (-half, half))
    reading = first + second
    from_left = np.maximum.accumulate(reading, axis=2)[:, :, :-2]
    from_right = np.maximum.accumulate(reading[:, :, ::-1], axis=2)[:, :, ::-1][:, :, 2:]
    depth = np.minimum(from_left, from_right) - reading[:, :, 1:-1]
    return np.asarray(depth.max(axis=2) >= dip * response[0])
