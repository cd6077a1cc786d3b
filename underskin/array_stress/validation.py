"""Checks of the loads on an array: errors for invalid loads, findings for unusual ones.

If the skin's length and width are given, it is assumed to be centred on the middle of the sensors' extent.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from underskin.array_stress.request import LabContact, LoadCase, PressureMap
from underskin.errors import Mention, Requirement, conflicting, out_of_range
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.physics import hertz
from underskin.recordings.plausibility import nearest_pair
from underskin.units import Floats, to_lab, to_si, unusual

MOST_PAIRS = 50_000_000  # of a sensor and a point force: about ten seconds
_WIDEST_CELL = 12.0  # thicknesses; no sensor is influenced from further away
_NARROW = 0.1  # sensor radii; a finger, or a sphere, is wider
_LINEAR = 0.01  # of L; there finite strain adds up to 1.3 % beneath a sphere
_ROUNDING = 1e-9


def refuse_many(request: LoadCase, points: int) -> None:
    """Reject a load that would take minutes to integrate (InvalidInput)."""
    if len(request.sensors) * points > MOST_PAIRS:
        allowed = f"sensors times points of the load must be at most {MOST_PAIRS}: send fewer, or coarser, at a time"
        raise out_of_range("sensors", f"{len(request.sensors)} sensors, {points} points", allowed)


def refuse_coarse(x: Floats, y: Floats, thickness: float) -> None:
    """Reject maps whose cells are wider than the range of the influence function (InvalidInput); lengths in m."""
    widest = _WIDEST_CELL * thickness
    for name, positions in (("x_mm", x), ("y_mm", y)):
        step = positions[1] - positions[0]
        if step > widest:
            allowed = (
                f"must be in steps of at most {to_lab('x_mm', widest):g} mm, {_WIDEST_CELL:g} thicknesses: is it in mm?"
            )
            raise out_of_range(f"pressure_map.{name}", f"steps of {to_lab('x_mm', step):g} mm", allowed)


def refuse_off_skin(request: LoadCase, positions: Floats, half: Floats, name: Callable[[int], str]) -> None:
    """Reject loads at `positions` (loads, 2) [m], of half width `half` (…, 2) [m], beyond the edge of the skin.

    The centres of the sensors must lie on the skin too. `name` gives the field of a load.
    """
    sensors = np.array([[sensor.x_mm, sensor.y_mm] for sensor in request.sensors])
    lowest, highest = sensors.min(axis=0), sensors.max(axis=0)
    outermost = np.abs(positions - to_si("x_mm", (lowest + highest) / 2)) + half
    for axis, (extent, size) in enumerate((("length_mm", request.length_mm), ("width_mm", request.width_mm))):
        if size is None:
            continue
        span, middle = highest[axis] - lowest[axis], (highest[axis] + lowest[axis]) / 2
        if span > size:
            raise out_of_range(extent, size, f"must be at least {span:g}: so far apart are the sensors")
        over = to_lab("x_mm", outermost[:, axis]) > size / 2 * (1 + _ROUNDING)
        if over.any():
            first = int(np.argmax(over))
            centre, reach = (
                float(to_lab("x_mm", np.broadcast_to(v, positions.shape)[first, axis])) for v in (positions, half)
            )
            allowed = (
                f"must lie on the skin, {'xy'[axis]} from {middle - size / 2:g} to {middle + size / 2:g} mm "
                f"({extent} {size:g}, about the middle of the sensors)"
            )
            value = f"{'xy'[axis]} from {centre - reach:.4g} to {centre + reach:.4g} mm"
            raise out_of_range(name(first), value, allowed)


def refuse_overlap(positions: Floats, radii: Floats) -> None:
    """Reject contacts at (contacts, 2) [m] with radii (contacts,) [m] that overlap (InvalidInput)."""
    distance = np.hypot(*(positions[:, None] - positions).transpose(2, 0, 1))
    apart = radii[:, None] + radii
    first, second = np.nonzero(np.triu(distance < apart, 1))
    if first.size:
        i, j = int(first[0]), int(second[0])
        gap, least = to_lab("x_mm", distance[i, j]), to_lab("x_mm", apart[i, j])
        gaps = f": the centres are {gap:.4g} mm apart, the radii add to {least:.4g} mm"
        allowed = Requirement("must not overlap ", Mention(f"contacts[{i}]"), gaps)
        x, y = to_lab("x_mm", positions[j])
        raise conflicting(f"contacts[{j}]", f"at x {x:g}, y {y:g} mm", allowed)


def findings(request: LoadCase) -> list[Finding]:
    """Findings on unusual loads: the answer is valid for them, but they are unlikely for a skin."""
    if request.pressure_map is not None:
        return [
            *_about_sensors(request),
            *_about_places(request.pressure_map, request.sensor_radius_mm),
            *_about_map(request.pressure_map, request.youngs_modulus_mpa),
        ]
    modulus = request.youngs_modulus_mpa or np.nan
    strained = [(_load_parameter(contact, modulus), i) for i, contact in enumerate(request.contacts)]
    least = _LINEAR if request.contact == "paper" else np.inf
    slipping = [
        (float(np.hypot(*contact.tangential_force_n)) / contact.normal_force_n, i)
        for i, contact in enumerate(request.contacts)
    ]
    return [
        *_about_sensors(request),
        *_worst(Reason.LOAD_NOT_LINEAR, "load_parameter", ((load, i) for load, i in strained if load > least)),
        *_worst(Reason.CONTACT_SLIPS, "ratio", ((ratio, i) for ratio, i in slipping if ratio > 1)),
    ]


def _about_sensors(request: LoadCase) -> Iterator[Finding]:
    distance, first, second = nearest_pair(request.sensors) or (np.inf, 0, 0)
    if distance < 2 * request.sensor_radius_mm * (1 - _ROUNDING):
        ids = {"first": request.sensors[first].id, "second": request.sensors[second].id}
        arguments = {**ids, "distance_mm": distance}
        yield Finding(Reason.SENSORS_OVERLAP, "", f"sensors[{first}]", arguments)


def _worst(reason: Reason, name: str, contacts: Iterable[tuple[float, int]]) -> Iterator[Finding]:
    """One finding for all these contacts, about the worst of them; `name` is the argument that holds its value."""
    ranked = sorted(contacts, reverse=True)
    if ranked:
        value, index = ranked[0]
        yield Finding(reason, "", f"contacts[{index}]", {name: value, "more": len(ranked) - 1})


def _about_places(given: PressureMap, sensor_radius_mm: float) -> Iterator[Finding]:
    for name, positions in (("x_mm", given.x_mm), ("y_mm", given.y_mm)):
        span = float(np.ptp(positions))
        if span < _NARROW * sensor_radius_mm:
            arguments = {"span_mm": span, "diameter_mm": 2 * sensor_radius_mm}
            yield Finding(Reason.NARROW_MAP, "", f"pressure_map.{name}", arguments)


def _about_map(given: PressureMap, modulus: float | None) -> Iterator[Finding]:
    row, column = np.unravel_index(int(np.argmax(given.pressure_mpa)), given.pressure_mpa.shape)
    highest = float(given.pressure_mpa[row, column])
    field = f"pressure_map.pressure_mpa[{row}][{column}]"
    if highest == 0:
        return
    if modulus is not None and highest > modulus:
        yield Finding(Reason.PRESSURE_NOT_LINEAR, "", field, {"pressure_mpa": highest, "modulus_mpa": modulus})
    for finding in unusual("pressure_mpa", highest):
        yield replace(finding, field=field)


def _load_parameter(contact: LabContact, modulus: float) -> float:
    force, radius = contact.normal_force_n, float(to_si("indenter_radius_mm", contact.indenter_radius_mm))
    return float(hertz.load_parameter(force, radius, to_si("youngs_modulus_mpa", modulus)))
