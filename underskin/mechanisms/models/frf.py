"""The FRF of recordings under a set of mechanisms.

Base model: Hertz' radius on a half space, the contact edge still, σ of the bonded finite-strain layer averaged over the
sensor's disc at its offset; FRF = d33 · (3/2) ρ² σ (Seminara 2018, equations 7 to 16). The stages, in this order:

declared values → material → contact radius and pressure → position → σ → increment with the load → d33 of each
sensor under its own stress → neighbours' charge → ageing → dynamics of tip, sensor and electronics, line by line.
Pick-up stands beside, as a covariance.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated, chain, constant, sum_rows
from underskin.errors import ErrorCode, InvalidInput, required
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.models.composition import Composition, Prediction
from underskin.mechanisms.models.contact_stage import layer_curves, press, stiffness
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign, frf_design, largest_offset
from underskin.mechanisms.models.nuisances import FRF_NUISANCES
from underskin.mechanisms.models.off_centre_response import PROFILE_END, offset_sigma
from underskin.mechanisms.models.pickup import Pickup, together
from underskin.mechanisms.models.response import Response, joined
from underskin.mechanisms.models.sigma_curves import SigmaOfContacts, layer_of
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices, Mask, to_si

_NUISANCE_STRETCH = 1.06  # the thickness' bounds
_QUANTITIES, _BLOCK = 6, 4**4  # of a linear layer's contact, and coefficients around a place in the table
_POSITION = 2  # two more variables: the contact's x and y


class FrfModel:
    """The FRF under given conditions by the base model and a set of mechanisms.

    Rows are all lines of all recordings, one recording after another.
    """

    def __init__(
        self,
        mechanisms: Sequence[Mechanism],
        conditions: Conditions,
        table: SigmaTable,
        beside: Sequence[Mechanism] = (),
    ) -> None:
        """Work out everything that no parameter changes; σ with room for the mechanisms `beside` as well."""
        self._composition = Composition(mechanisms, conditions, "frf", FRF_NUISANCES)
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self._mechanisms = self._composition.mechanisms
        fields = {field for mechanism in mechanisms for field in mechanism.needs_fields}
        neighbours = any(mechanism.needs_neighbours for mechanism in mechanisms)
        self.design = design = frf_design(conditions, fields, neighbours=neighbours)
        self.recording = design.recording
        self.sensor: Indices | None = design.sensor
        skin = conditions.skin
        self._modulus = _required("youngs_modulus_mpa", skin.youngs_modulus_mpa)
        self._thickness = _required("thickness_mm", skin.thickness_mm)
        self._sensor_radius = _required("sensor_radius_mm", skin.sensor_radius_mm)
        self._poisson_ratio = skin.poisson_ratio
        room = (*mechanisms, *beside)
        further = max((mechanism.largest_offset for mechanism in room), default=0.0)
        stretch = _NUISANCE_STRETCH * max((mechanism.largest_stretch for mechanism in room), default=1.0)
        reached = min(PROFILE_END, stretch * largest_offset(design, further) / self._thickness)
        self._sigma = offset_sigma(table, self._sensor_radius / self._thickness, stretch, reached)
        self._needs_stiffness = any(mechanism.needs_stiffness for mechanism in mechanisms)
        self._stressed = [one for one in mechanisms if type(one).on_d33 is not Mechanism.on_d33]
        pickups = [mechanism.pickup(conditions, design) for mechanism in self._mechanisms]
        self.pickup: Pickup | None = together([pickup for pickup in pickups if pickup is not None])
        self._force, self._increments = _force_nodes(self._mechanisms, design)
        self._table = table

    @cached_property
    def valid(self) -> Mask:
        """Which rows lie inside the table as declared."""
        none = np.zeros((0, 1))
        modulus, thickness, poisson_ratio = (
            Differentiated(np.array([v]), none) for v in (self._modulus, self._thickness, self._poisson_ratio)
        )
        design = self.design
        contacts = Contacts(design.force, design.indenter_radius, design.dwell, modulus, thickness, poisson_ratio)
        a_over_h = contacts.hertz_radius.value / self._thickness
        a, x = self._table.axes[0], self._table.axes[2]
        inside = (a_over_h <= a[-1]) & (contacts.cbrt_load.value <= x[-1])
        distance = np.hypot(design.point_x, design.point_y) + self._sensor_radius
        near: Mask = inside[design.point_contact] & (distance <= PROFILE_END * self._thickness)
        return near[design.point][self.recording]

    def predict(self, fit: Floats) -> Prediction:
        """The FRF on every row with its derivatives.

        Parameters
        ----------
        fit
            (parameters,) fit coordinates, in the order of `parameters`.

        Returns
        -------
        Prediction
            In C/N; finite everywhere, also where `inside` is False.

        Raises
        ------
        InvalidInput
            Where `fit` has another length.
        """
        fit = np.asarray(fit, dtype=float)
        if fit.ndim != 1:
            raise InvalidInput("fit", fit.shape, "must be one point: (parameters,)", code=ErrorCode.UNEQUAL_LENGTHS)
        response = self.respond(fit, place=True)
        value, slopes = response.on_rows(self.design)
        count = len(self.parameters)
        pickup = rows = None
        if self.pickup is not None:
            own, _, _ = self._composition.values(fit)
            by_name = {name: one.value for values in own.values() for name, one in values.items()}
            pickup, rows = self.pickup.deviation(by_name), self.pickup.rows
        return Prediction(value, slopes[:count], slopes[count:], pickup, rows, response.inside[self.recording])

    @property
    def numbers(self) -> int:
        """How many numbers a response without derivatives takes, roughly: bounds the points that are worked out at
        once."""
        nodes, contacts, points = len(self._force), len(self.design.force), len(self.design.point_contact)
        transforms = (_QUANTITIES * contacts + points) * self._sigma.wavenumbers
        return nodes * (points * _BLOCK + transforms) + len(self.design.line_frequency)

    def respond(self, fit: Floats, *, slopes: bool = True, place: bool = False) -> Response:
        """The response at points (…, parameters); its derivatives by the parameters and by the contact's place on
        request."""
        further = _POSITION if place else 0
        own, nuisances, position = self._composition.values(fit, further, slopes=slopes)
        contacts = self._contacts(own, nuisances, fit.shape[:-1], (len(self.parameters) if slopes else 0) + further)
        if fit.ndim > 1 and (contacts.layered or self._needs_stiffness) and not _on_one_layer(contacts):
            return joined([self.respond(one, slopes=slopes, place=place) for one in fit[:, None]])
        sigma, inside = self._sigma_at_points(contacts, own, position)
        level = self._level(contacts, sigma, own, nuisances)
        level = level.spread(len(self.design.point))
        lines = self._line_factor(contacts, own)
        count = len(level.slopes) - further
        if lines is not None:
            lines = lines.spread(len(self.design.line_frequency))
            lines = Differentiated(lines.value, lines.slopes[:count])
        return Response(
            Differentiated(level.value, level.slopes[:count]),
            level.slopes[count:] if place else None,
            lines,
            inside[..., self.design.point],
        )

    def _contacts(self, own: dict[str, Values], nuisances: Values, points: tuple[int, ...], variables: int) -> Contacts:
        """The contacts at all force nodes, one node after another, as declared and as the mechanisms change them."""
        nodes = len(self._force)
        contacts = Contacts(
            force=self._force.ravel(),
            indenter_radius=np.tile(self.design.indenter_radius, nodes),
            dwell=np.tile(self.design.dwell, nodes),
            modulus=self._modulus * nuisances["youngs_modulus"],
            thickness=self._thickness * nuisances["thickness"],
            poisson_ratio=constant(self._poisson_ratio, variables, points),
        )
        for mechanism in self._mechanisms:
            mechanism.on_declared(contacts, own[mechanism.name])
        for mechanism in self._mechanisms:
            mechanism.on_material(contacts, own[mechanism.name])
        return contacts

    def _sigma_at_points(
        self, contacts: Contacts, own: dict[str, Values], position: Sequence[Differentiated]
    ) -> tuple[list[Differentiated], Mask]:
        """σ of each point at each force node, and which points are inside the table at all of them.

        Inside means also that the sensor's disc lies within the stress profile, beyond whose end σ is 0.
        """
        design = self.design
        rho = self._sensor_radius / contacts.thickness
        layer = None
        if contacts.layered or self._needs_stiffness:
            layer = layer_curves(self._sigma.contact_grid, layer_of(contacts))
        pressed = press(contacts, layer if contacts.layered else None)
        if layer is not None and self._needs_stiffness:
            contacts.stiffness = stiffness(contacts, pressed, layer)
        of_contacts = SigmaOfContacts(self._sigma, contacts, pressed, rho, layer if contacts.layered else None)
        offset = self._offset(own, position or 2 * [0.0 * contacts.thickness]) / contacts.thickness
        nodes, points = len(self._force), len(design.point_contact)
        every = np.tile(np.arange(points), nodes)
        contact = (design.point_contact + len(design.force) * np.arange(nodes)[:, None]).ravel()
        at_nodes = offset.spread(points)[every] if nodes > 1 else offset
        sigma = of_contacts.at(contact, self._sigma.place(at_nodes.value), at_nodes)
        near = (offset.value <= self._sigma.end) & (offset.value + rho.value <= PROFILE_END)
        reached = of_contacts.inside[..., contact]
        inside = near & reached.reshape(*reached.shape[:-1], nodes, points).all(axis=-2)
        return [sigma[points * node : points * (node + 1)] for node in range(nodes)] if nodes > 1 else [sigma], inside

    def _offset(self, own: dict[str, Values], position: Sequence[Differentiated]) -> Differentiated:
        """The distance of each point's contact from its sensor's centre [m], `position` added to its place."""
        x, y = (
            place + shift for place, shift in zip((self.design.point_x, self.design.point_y), position, strict=True)
        )
        for mechanism in self._mechanisms:
            moved = mechanism.offset(own[mechanism.name])
            if moved is not None:
                x, y = x + moved[0], y + moved[1]
        distance = np.hypot(x.value, y.value)
        away = np.where(distance > 0, distance, 1.0)
        return chain(distance, (x.value / away, x), (y.value / away, y))

    def _level(
        self, contacts: Contacts, sigma: list[Differentiated], own: dict[str, Values], nuisances: Values
    ) -> Differentiated:
        """The FRF of each recording before the dynamics [C/N]."""
        design = self.design
        oscillating = sigma[0]
        for mechanism, nodes, weights in self._increments:
            rate = sigma[nodes[0]] * weights[0][design.point_contact]
            for node, weight in zip(nodes[1:], weights[1:], strict=True):
                rate = rate + sigma[node] * weight[design.point_contact]
            oscillating = oscillating + mechanism.mobility(own[mechanism.name]) * (rate - oscillating)
        rho = self._sensor_radius / contacts.thickness
        charge = oscillating * (1.5e-12 * nuisances["d33"] * rho * rho)
        if self._stressed:
            mean_stress = sigma[0] * (1.5 / np.pi * design.force[design.point_contact]) / (contacts.thickness**2.0)
            for mechanism in self._stressed:
                factor = mechanism.on_d33(mean_stress, own[mechanism.name])
                charge = charge if factor is None else charge * factor
        level = charge[design.point]
        for mechanism in self._mechanisms:
            fraction = mechanism.neighbour_fraction(own[mechanism.name])
            if fraction is not None:
                theirs = sum_rows(charge[design.neighbour_point], design.neighbour_recording, len(design.point))
                level = level + fraction * theirs
            factor = mechanism.on_recordings(design, own[mechanism.name])
            level = level if factor is None else level * factor
        return level

    def _line_factor(self, contacts: Contacts, own: dict[str, Values]) -> Differentiated | None:
        """The complex factor of each distinct line; None where no mechanism has one."""
        product: Differentiated | None = None
        for mechanism in self._mechanisms:
            factor = mechanism.on_lines(self.design, contacts, own[mechanism.name])
            if factor is not None:
                product = factor if product is None else product * factor
        return product


def _force_nodes(
    mechanisms: Sequence[Mechanism], design: FrfDesign
) -> tuple[Floats, list[tuple[Mechanism, list[int], Array]]]:
    """Forces (nodes, contacts), the preload first, and for each mechanism that asks its nodes and their weights."""
    forces = [design.force]
    increments = []
    for mechanism in mechanisms:
        nodes = mechanism.force_nodes(design.force, design.dynamic_force)
        if nodes is not None:
            increments.append((mechanism, list(range(len(forces), len(forces) + len(nodes[0]))), nodes[1]))
            forces += list(nodes[0])
    return np.stack(forces), increments


def _on_one_layer(contacts: Contacts) -> bool:
    """Whether the contacts at several points of the fit coordinates all are on the same linear layer."""
    layers = [x.value for x in (contacts.poisson_ratio, contacts.slip) if x is not None]
    return all(bool((value == value.flat[0]).all()) for value in layers)


def _required(name: str, value: float | None) -> float:
    if value is None:
        raise required(f"skin.{name}", "required by a recording of kind frf")
    return float(to_si(name, value))
