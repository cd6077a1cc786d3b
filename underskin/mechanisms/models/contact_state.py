"""The design of FRF recordings, the contacts that mechanisms change on it, and the response. SI.

Recordings share contacts (sphere, preload and further fields that a mechanism reads); a contact at one offset from a
sensor is a point, and a contact at one frequency is a line. Only distinct ones are computed; the design is what no
parameter changes. A response is a level for each recording and a factor for each line. Pick-up is charge from other
sources: random on each row, it changes the covariance and not the mean.

The stage that turns loads into contacts gives the radius, and the shape of the pressure as a mixture of a sphere's and
a punch's, in four cases (Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301; Lebedev & Ufliand, J. Appl. Math.
Mech. 22 (1958) 442): half space or layer, with or without adhesion. On the half space with adhesion a³ = 3 R F1/(4E'),
F1 = F + 3πwR + √(6πwRF + (3πwR)²), and the pressure is Hertz' under F1 less a flat punch's under F1 − F; on the layer
both parts are those of elastic_layer.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.distance import cdist

from underskin.autodiff import Differentiated, cbrt, chain
from underskin.errors import required
from underskin.physics.elastic_layer import LARGEST_A_OVER_H, ContactCurves, CurveGrid, Layer
from underskin.recordings.campaign import Conditions, FrfConditions, frf_of
from underskin.units import Array, Floats, Indices, Mask, to_si
from underskin.weak_cache import cached_while_alive


@dataclass(frozen=True, eq=False)
class Pickup:
    """`deviation`: sd of real and of imaginary part on these rows [C/N], from the parameters by name in their units.

    Parameters (…, 1) give (…, rows); with `alike` (rows,) they give (…, distinct), and `alike` is the index of each
    row's value.
    """

    rows: Indices
    deviation: Callable[[Mapping[str, Floats]], Floats]
    alike: Indices | None = None

    def on_rows(self, distinct: Floats) -> Floats:
        """Deviations (…, distinct) expanded to the rows (…, rows)."""
        return distinct if self.alike is None else distinct[..., self.alike]


def together(pickups: Sequence[Pickup]) -> Pickup | None:
    """Independent charges combined: variances add on common rows; None for no charge."""
    if len(pickups) < 2:
        return pickups[0] if pickups else None
    rows = np.unique(np.concatenate([pickup.rows for pickup in pickups]))

    def deviation(values: Mapping[str, Floats]) -> Floats:
        parts = [(np.searchsorted(rows, pickup.rows), pickup.on_rows(pickup.deviation(values))) for pickup in pickups]
        variance = np.zeros((*np.broadcast_shapes(*(sd.shape[:-1] for _, sd in parts)), len(rows)))
        for columns, sd in parts:
            variance[..., columns] += sd**2
        return np.sqrt(variance)

    return Pickup(rows, deviation)


# What mechanisms and tables must have room for: each component of an offset, and a factor on the thickness
LARGEST_OFFSET_MM, LARGEST_STRETCH = 2.0, 1.55
NEIGHBOUR_PITCHES = 1.2


class FrfDesign:
    """Arrays over recordings, contacts, points, neighbours, lines and rows; SI."""

    def __init__(self, conditions: Conditions, fields: Collection[str], neighbours: bool) -> None:
        """`fields`: what else distinguishes contacts: "dwell_s", "dynamic_force_n", "id" (every recording)."""
        recordings = frf_of(conditions)
        count = len(recordings)
        self._conditions = weakref.ref(conditions)  # which keep the design in a cache
        self.ids = tuple(recording.id for recording in recordings)
        number = {sensor.id: index for index, sensor in enumerate(conditions.skin.sensors)}
        sensor_positions = to_si("thickness_mm", [(sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors])
        # Of each recording
        self.sensor: Indices = np.array([number[recording.sensor] for recording in recordings])
        cycles = [np.nan if recording.load_cycles is None else recording.load_cycles for recording in recordings]
        self.load_cycles: Floats = np.array(cycles)
        position = np.array(
            [
                sensor_positions[sensor_index]
                if recording.position_mm is None
                else to_si("thickness_mm", recording.position_mm)
                for sensor_index, recording in zip(self.sensor, recordings, strict=True)
            ]
        )
        # Of each contact; dynamic force and dwell are 0 where no mechanism reads them
        keys = np.array([_contact_key(recording, fields) for recording in recordings])
        if "id" in fields:
            keys = np.column_stack([keys, np.arange(count)])
        contacts, first, contact = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        self.contact_recording: Indices = first
        self.force, self.indenter_radius, self.dynamic_force, self.dwell = contacts.T[:4]
        # Of each point: its contact, and that contact's place seen from the sensor's centre; of each recording its
        # point beside its own sensor; of each pair of a recording and a neighbour of its sensor both
        pairs = (
            _neighbours(sensor_positions)
            if neighbours
            else np.zeros((len(sensor_positions), len(sensor_positions)), dtype=bool)
        )
        self.neighbour_recording, other = np.nonzero(pairs[self.sensor])
        pair_recording = np.concatenate([np.arange(count), self.neighbour_recording])
        offset = position[pair_recording] - sensor_positions[np.concatenate([self.sensor, other])]
        points, point = np.unique(
            np.column_stack([contact[pair_recording], np.round(offset, 12)]), axis=0, return_inverse=True
        )
        self.point_contact: Indices = points[:, 0].astype(np.intp)
        self.point_x, self.point_y = points[:, 1], points[:, 2]
        self.point, self.neighbour_point = point[:count], point[count:]
        # Of each row, and of each distinct line
        lines_hz = [frequencies(recording) for recording in recordings]
        self.recording: Indices = np.repeat(np.arange(count), [len(column) for column in lines_hz])
        self._dynamic_forces = np.array([recording.dynamic_force_n for recording in recordings])
        distinct, frequency = _distinct(lines_hz)
        line_of_row = contact[self.recording] * len(distinct) + frequency
        self.line: Indices
        lines, self.line = np.unique(line_of_row, return_inverse=True)
        self.line_contact, self.line_frequency = lines // len(distinct), distinct[lines % len(distinct)]

    @property
    def row_frequency(self) -> Floats:
        """Of each row [Hz]."""
        return self.line_frequency[self.line]

    @property
    def row_dynamic_force(self) -> Floats:
        """Of each row [N]."""
        return self._dynamic_forces[self.recording]

    @property
    def conditions(self) -> Conditions:
        """The conditions that it was computed from, which a model of them holds."""
        conditions = self._conditions()
        assert conditions is not None
        return conditions


_cached_design = cached_while_alive(FrfDesign)  # a diagnosis composes dozens of models of one campaign


def frf_design(conditions: Conditions, fields: Collection[str], *, neighbours: bool) -> FrfDesign:
    """The design, cached for further models of the same conditions."""
    return _cached_design(conditions, frozenset(fields) & {"dwell_s", "dynamic_force_n", "id"}, neighbours)


def frequencies(recording: FrfConditions) -> Floats:
    """The lines of one FRF [Hz]; raises InvalidInput where they are yet to be estimated from a time series."""
    if recording.frequency_hz is None:
        raise required(f"recordings[{recording.id}].frequency_hz", "required for a prediction")
    return recording.frequency_hz


def _distinct(columns: Sequence[Floats]) -> tuple[Floats, Indices]:
    """The distinct frequencies of recordings, most of which share their lines, and the index of each row's
    frequency."""
    keys = [column.tobytes() for column in columns]
    shared = dict(zip(keys, columns, strict=True))
    distinct = np.unique(np.concatenate(list(shared.values())))
    indices = {key: np.searchsorted(distinct, column) for key, column in shared.items()}
    return distinct, np.concatenate([indices[key] for key in keys])


def _neighbours(sensor_positions: Floats) -> Mask:
    """Which sensors (sensors, sensors) are within 1.2 pitches of each other."""
    distance = cdist(sensor_positions, sensor_positions)
    np.fill_diagonal(distance, np.inf)
    near: Mask = distance <= NEIGHBOUR_PITCHES * distance.min()
    return near


def _contact_key(recording: FrfConditions, fields: Collection[str]) -> tuple[float, float, float, float]:
    dwell = recording.dwell_s if "dwell_s" in fields and recording.dwell_s is not None else 0.0
    dynamic_force = recording.dynamic_force_n if "dynamic_force_n" in fields else 0.0
    return recording.preload_n, float(to_si("indenter_radius_mm", recording.indenter_radius_mm)), dynamic_force, dwell


def largest_offset(design: FrfDesign, further: float) -> float:
    """The largest distance of a point's contact from its sensor's centre, plus `further` [m]."""
    return float(np.hypot(design.point_x, design.point_y).max()) + further


@dataclass(frozen=True)
class Response:
    """FRFs at one or several points of the fit coordinates, in two factors: leading axes are those of the points.

    `place_slopes` are by the contact's x and y, None where not requested.
    """

    level: Differentiated  # (…, recordings) [C/N], real: before the dynamics
    place_slopes: Floats | None  # (2, …, recordings) [C/N/m]
    lines: Differentiated | None  # (…, distinct lines) complex: the dynamics' factor; None where there are none
    inside: Mask  # (…, recordings)

    def on_rows(self, design: FrfDesign) -> tuple[Array, Array]:
        """Level times line factor on every row of a single point (rows,), and its derivatives (variables, rows).

        These are by the parameters, then by the position where requested.
        """
        position_slopes = np.zeros((0, *self.level.value.shape)) if self.place_slopes is None else self.place_slopes
        level = self.level.value[design.recording]
        slopes = np.concatenate([self.level.slopes, position_slopes])[:, design.recording]
        if self.lines is None:
            return level.astype(complex), slopes.astype(complex)
        factor = self.lines.value[design.line]
        slopes = slopes * factor
        for row, of_lines in zip(slopes, self.lines.slopes, strict=False):  # derivatives by the parameters only
            if of_lines.any():
                row += level * of_lines[design.line]
        return level * factor, slopes

    def part(self, index: int | slice | Indices) -> Response:
        """The response at some of several points."""

        def of(x: Differentiated) -> Differentiated:
            return Differentiated(x.value[index], x.slopes[:, index])

        position_slopes = None if self.place_slopes is None else self.place_slopes[:, index]
        return Response(
            of(self.level), position_slopes, None if self.lines is None else of(self.lines), self.inside[index]
        )


def joined(responses: Sequence[Response]) -> Response:
    """Responses of one model at several sets of points, concatenated."""

    def of(parts: Sequence[Differentiated]) -> Differentiated:
        return Differentiated(
            np.concatenate([part.value for part in parts]), np.concatenate([part.slopes for part in parts], axis=1)
        )

    position_slopes = [response.place_slopes for response in responses if response.place_slopes is not None]
    lines = [response.lines for response in responses if response.lines is not None]
    return Response(
        of([response.level for response in responses]),
        np.concatenate(position_slopes, axis=1) if position_slopes else None,
        of(lines) if lines else None,
        np.concatenate([response.inside for response in responses]),
    )


@dataclass
class Contacts:
    """One row per contact, (…, contacts); a Differentiated of a single row is broadcast to all."""

    force: Floats  # F [N]
    indenter_radius: Floats  # R [m]
    dwell: Floats  # time since the preload was put on [s]; 0 where no mechanism reads it
    modulus: Differentiated  # E [Pa] in force in each contact: that of the static contact
    thickness: Differentiated  # h [m], of one row
    poisson_ratio: Differentiated  # ν, of one row
    slip: Differentiated | None = None  # of the glue line, 1/(1 + κ), of one row; None where it is rigid
    work_of_adhesion: Differentiated | None = None  # w [J/m²], of one row; None without adhesion
    relaxed: Differentiated | None = None  # that E over the one that a fast oscillation meets; None where they are one
    second_over_first: Differentiated | None = None  # c₂ of Yeoh's law, of one row; None of a neo-Hookean layer
    friction: Differentiated | None = None  # 0 slips to 1 sticks, of one row; None of a frictionless sphere
    tip: Differentiated | None = None  # its share of E*'s compliance, E*/E'_tip, of one row; None of a rigid one
    film: tuple[Differentiated, Differentiated] | None = None  # charge by stretch [1/m] and shear lag [m], of one row
    layered: bool = False  # contact by the layer of finite thickness, not by the half space
    stiffness: Differentiated | None = None  # dF/dδ [N/m] at the present radius, where a mechanism reads it

    @property
    def share_a_layer(self) -> bool:
        """Whether the linear layer and the tip (Poisson ratio, glue line, share) are the same at all points."""
        layers = [x.value for x in (self.poisson_ratio, self.slip, self.tip) if x is not None]
        return all(bool((value == value.flat[0]).all()) for value in layers)

    @property
    def reduced_modulus(self) -> Differentiated:
        """E* [Pa]: E' = E/(1 − ν²), of a tip that yields too 1/E* = 1/E' + 1/E'_tip."""
        of_skin = self.modulus / (1 - self.poisson_ratio**2.0)
        return of_skin if self.tip is None else of_skin * (1.0 - self.tip)

    @property
    def hertz_radius(self) -> Differentiated:
        """a [m] of a sphere on a half space without adhesion, a³ = 3 F R/(4 E*): `hertz.contact_radius` with slopes."""
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        a = np.cbrt(0.75 * self.force * self.indenter_radius * area / self.modulus.value)
        a_rigid = chain(
            a, (-a / (3 * self.modulus.value), self.modulus), (a * (-2 * nu / (3 * area)), self.poisson_ratio)
        )
        return a_rigid if self.tip is None else a_rigid / cbrt(1.0 - self.tip)

    @property
    def cbrt_load(self) -> Differentiated:
        """L^(1/3) with which to enter the tables, which are for ν = 0.5: L = F/(R² E) · (0.75/(1 − ν²))².

        To the skin a tip that yields is a rigid one of radius R E'/E*.
        """
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        x = np.cbrt(self.force / self.indenter_radius**2 / self.modulus.value * (0.75 / area) ** 2)
        x_rigid = chain(
            x, (-x / (3 * self.modulus.value), self.modulus), (x * (4 * nu / (3 * area)), self.poisson_ratio)
        )
        return x_rigid if self.tip is None else x_rigid * cbrt((1.0 - self.tip) ** 2.0)


@dataclass
class FrfState:
    """What a law of FRFs reads beside its parameters, and what it sets, at several points of the fit coordinates.

    By stage, `factor` is: LOAD_INCREMENT the share of the first harmonic in the oscillation; SENSOR a factor on d33 at
    each of the design's points; NEIGHBOURS the share of the neighbours' charge in a sensor's; RECORDING a factor on
    each recording; LINES a complex factor on each distinct line. At POSITION a law sets `shift`, at ADDED_CHARGE
    `pickup`.
    """

    design: FrfDesign
    loaded: Contacts | None = None  # the contacts, from POSITION on
    sigma: Differentiated | None = None  # σ under the preload at each of the design's points, at SENSOR
    factor: Differentiated | None = None
    shift: tuple[Differentiated, Differentiated] | None = None  # x and y added to the contacts' position [m]
    pickup: Pickup | None = None

    @property
    def contacts(self) -> Contacts:
        """The contacts, with their stiffness where a mechanism reads it."""
        assert self.loaded is not None
        return self.loaded

    @property
    def mean_stress(self) -> Differentiated:
        """The static stress [Pa] at each of the design's points, mean over the sensor, compression positive."""
        assert self.sigma is not None
        force = 1.5 / np.pi * self.design.force[self.design.point_contact]
        return self.sigma * force / (self.contacts.thickness**2.0)


@dataclass(frozen=True)
class PressedContacts:
    """Contacts (rows,) under their loads."""

    a_over_h: Differentiated
    cbrt_load: Differentiated  # L^(1/3) to enter the table with
    sphere_share: Differentiated | None  # of the load, in the sphere's part of the pressure; None: all of it


@lru_cache(maxsize=8)  # most steps of a fit change neither the Poisson ratio nor the glue line
def layer_curves(grid: CurveGrid, layer: Layer) -> ContactCurves:
    """The contact curves of one layer at the wave numbers of a grid."""
    return grid.curves(layer)


def press(contacts: Contacts, curves: ContactCurves | None) -> PressedContacts:
    """The contacts under their forces; `curves` of the layer for contact with the layer itself."""
    if curves is not None:
        return _on_layer(contacts, curves)
    if contacts.work_of_adhesion is None:
        return PressedContacts(contacts.hertz_radius / contacts.thickness, contacts.cbrt_load, None)
    adhesive_force = (1.5 * np.pi) * contacts.indenter_radius * contacts.work_of_adhesion
    root = 2.0 * (adhesive_force * (contacts.force + adhesive_force)) ** 0.5
    equivalent = contacts.force + 2.0 * adhesive_force + root
    radius = cbrt(0.75 * contacts.indenter_radius * equivalent / contacts.reduced_modulus)
    return PressedContacts(radius / contacts.thickness, contacts.cbrt_load, equivalent / contacts.force)


def _on_layer(contacts: Contacts, curves: ContactCurves) -> PressedContacts:
    scale = contacts.reduced_modulus * contacts.thickness**3.0
    load = contacts.force * contacts.indenter_radius / scale
    adhesion = contacts.work_of_adhesion
    root = None if adhesion is None else contacts.indenter_radius * (adhesion / scale) ** 0.5
    shape = load.value.shape
    solved = curves.at_load(load.value.ravel(), np.zeros(load.value.size) if root is None else root.value.ravel())
    slip = contacts.slip

    beyond = np.isnan(solved.alpha.value)  # of the curves' reach, which is beyond the table's

    def by_parameters(quantity: Differentiated, otherwise: Floats | float) -> Differentiated:
        slopes = np.where(beyond, 0.0, quantity.slopes).reshape(-1, *shape)
        by_load, by_root, by_poisson_ratio, by_slip, by_tip = slopes
        terms = [(by_load, load), (by_poisson_ratio, contacts.poisson_ratio)]
        terms += [] if root is None else [(by_root, root)]
        terms += [] if slip is None else [(by_slip, slip)]
        terms += [] if contacts.tip is None else [(by_tip, contacts.tip)]
        value = np.where(beyond.reshape(shape), otherwise, quantity.value.reshape(shape))
        return chain(value, *terms)

    share = None if root is None else by_parameters(solved.sphere_load, load.value) / load
    return PressedContacts(by_parameters(solved.alpha, LARGEST_A_OVER_H), contacts.cbrt_load, share)


def stiffness(contacts: Contacts, pressed: PressedContacts, curves: ContactCurves) -> Differentiated:
    """dF/dδ = 2 E' a S(a/h) [N/m] of the layer at the present contact radius, edge fixed, E* unrelaxed as E'."""
    alpha = pressed.a_over_h
    shape = alpha.value.shape
    at_radius = curves.stiffness_at(np.minimum(alpha.value, LARGEST_A_OVER_H).ravel())
    by_alpha, by_poisson_ratio, by_slip, by_tip = at_radius.slopes.reshape(-1, *shape)
    terms = [(by_alpha, alpha), (by_poisson_ratio, contacts.poisson_ratio)]
    terms += [] if contacts.slip is None else [(by_slip, contacts.slip)]
    terms += [] if contacts.tip is None else [(by_tip, contacts.tip)]
    result = chain(at_radius.value.reshape(shape), *terms) * alpha * contacts.thickness
    result = 2.0 * contacts.reduced_modulus * result
    return result if contacts.relaxed is None else result / contacts.relaxed
