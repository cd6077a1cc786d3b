"""The FRF of recordings under a set of mechanisms, at several points of its parameters at once.

Base model: Hertz' radius on a half space, a fixed contact edge, σ of the bonded finite-strain layer averaged over the
sensor's disc at its offset; FRF = d33 · (3/2) ρ² σ (Seminara 2018, equations 7 to 16). The stages, in this order:

declared values → material → contact radius and pressure → position → σ → increment with the load → d33 of each
sensor under its own stress → neighbours' charge → ageing → dynamics of tip, sensor and electronics, line by line.
Pick-up is a covariance.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated, chain, constant, sum_rows
from underskin.errors import ErrorCode, InvalidInput, required
from underskin.mechanisms.base import Mechanism, Stage, Values
from underskin.mechanisms.models.composition import Composition, Prediction, frf_nuisances
from underskin.mechanisms.models.contact_state import (
    LARGEST_OFFSET_MM,
    LARGEST_STRETCH,
    Contacts,
    FrfDesign,
    FrfState,
    Pickup,
    Response,
    frf_design,
    joined,
    largest_offset,
    layer_curves,
    press,
    stiffness,
    together,
)
from underskin.mechanisms.models.sigma_curves import (
    PROFILE_END,
    SigmaOfContacts,
    layer_of,
    offset_sigma,
)
from underskin.recordings.campaign import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices, Mask, to_si


class _Variables:
    """The parameters at several points of the fit coordinates, in their units, with derivatives by the coordinates.

    Attributes: `points`, how many; `count`, the number of derivatives; `position`, two further variables of value 0, or
    none.
    """

    def __init__(self, fit: Floats, log: Mask, *, slopes: bool, further: int) -> None:
        """`log`: which coordinates (parameters,) are logarithms; without `slopes`, derivatives are by the `further`
        variables alone."""
        self._value = np.where(log, np.exp(np.where(log, fit, 0.0)), fit)
        self._slope = np.where(log, self._value, 1.0)
        self._slopes = slopes
        count = fit.shape[1] if slopes else 0
        self.points, self.count = len(fit), count + further
        self.position = []
        for index in range(count, self.count):
            seed = np.zeros((self.count, 1, 1))
            seed[index] = 1.0
            self.position.append(Differentiated(np.zeros((1, 1)), seed))

    def of(self, index: int) -> Differentiated:
        """The parameter at this index (points, 1)."""
        slopes = np.zeros((self.count, self.points, 1))
        if self._slopes:
            slopes[index, :, 0] = self._slope[:, index]
        return Differentiated(self._value[:, index, None], slopes)


_POSITION = 2  # two more variables: the contact's x and y
_CONTACT = Stage.DECLARED, Stage.MATERIAL, Stage.CONTACT


@dataclass(frozen=True)
class _Pressed:
    """A model's contacts at several points of its parameters."""

    model: FrfModel
    contacts: Contacts
    variables: _Variables

    def response(self) -> Response:
        """The response, with the derivatives by the contact's position separate from the others."""
        sigma, inside = self._sigma()
        level = self._level(sigma).spread(len(self.model.design.point))
        factor = self._line_factor()
        variables, position_slopes = self.variables, None
        count = variables.count - len(variables.position)
        if variables.position:
            position_slopes = level.slopes[count:]
        if factor is not None:
            factor = Differentiated(factor.value, factor.slopes[:count])
        inside = np.broadcast_to(inside, (variables.points, inside.shape[-1]))[:, self.model.design.point]
        return Response(Differentiated(level.value, level.slopes[:count]), position_slopes, factor, inside)

    def _acted(self, stage: Stage, sigma: Differentiated | None = None) -> Iterator[FrfState]:
        """What each mechanism of this stage made of the state."""
        for mechanism in self.model.at_stage(stage):
            state = FrfState(self.model.design, self.contacts)
            state.sigma = sigma
            mechanism.act(state, self.model.values_of(mechanism, self.variables))
            yield state

    def _sigma(self) -> tuple[list[Differentiated], Mask]:
        """σ at each position for each force node, and which positions are inside the table at all of them.

        Inside includes that the sensor's disc lies within the stress profile, beyond whose end σ is 0.
        """
        model, contacts = self.model, self.contacts
        design, table = model.design, model.sigma
        of_contacts = self._of_pressed()
        nodes, positions = len(model.force), len(design.point_contact)
        contact = (design.point_contact + len(design.force) * np.arange(nodes)[:, None]).ravel()
        offset = self._offset() / contacts.thickness
        repeated = np.tile(np.arange(positions), nodes)
        sigma = of_contacts.at(contact, offset.spread(positions)[repeated] if nodes > 1 else offset)
        near = (offset.value <= table.end) & (offset.value + of_contacts.rho.value <= PROFILE_END)
        contact_inside = of_contacts.inside[..., contact]
        inside = near & contact_inside.reshape(*contact_inside.shape[:-1], nodes, positions).all(axis=-2)
        return [sigma[positions * node : positions * (node + 1)] for node in range(nodes)] if nodes > 1 else [
            sigma
        ], inside

    def _of_pressed(self) -> SigmaOfContacts:
        """σ of the contacts under their forces, which sets their stiffness where it is needed."""
        model, contacts = self.model, self.contacts
        table, layer = model.sigma, None
        if contacts.layered or model.needs_stiffness:
            layer = layer_curves(table.contact_grid, layer_of(contacts))
        pressed = press(contacts, layer if contacts.layered else None)
        if layer is not None and model.needs_stiffness:
            contacts.stiffness = stiffness(contacts, pressed, layer)
        return SigmaOfContacts(table, contacts, model.sensor_radius, pressed, layer if contacts.layered else None)

    def _offset(self) -> Differentiated:
        """The distance of each contact from its sensor's centre [m], with derivatives by position where it varies."""
        design, variables = self.model.design, self.variables
        shifts = [state.shift for state in self._acted(Stage.POSITION)]
        if not (variables.position or shifts):
            distance = np.tile(np.hypot(design.point_x, design.point_y), (variables.points, 1))
            return Differentiated(distance, np.zeros((variables.count, *distance.shape)))
        still = constant(0.0, variables.count, (variables.points,))
        x, y = (
            coordinate + shift
            for coordinate, shift in zip(
                (design.point_x, design.point_y), variables.position or 2 * [still], strict=True
            )
        )
        for shift in shifts:
            if shift is not None:
                x, y = x + shift[0], y + shift[1]
        distance = np.hypot(x.value, y.value)
        away = np.where(distance > 0, distance, 1.0)
        return chain(distance, (x.value / away, x), (y.value / away, y))

    def _level(self, sigma: list[Differentiated]) -> Differentiated:
        """The FRF of each recording before the dynamics [C/N]."""
        model, design = self.model, self.model.design
        oscillating = sigma[0]
        for state in self._acted(Stage.LOAD_INCREMENT):
            assert state.factor is not None
            first_harmonic = sigma[1] * model.weights[0][design.point_contact]
            for node, weight in zip(sigma[2:], model.weights[1:], strict=True):
                first_harmonic = first_harmonic + node * weight[design.point_contact]
            oscillating = oscillating + state.factor * (first_harmonic - sigma[0])
        rho = model.sensor_radius / self.contacts.thickness
        charge = oscillating * (1.5e-12 * self.variables.of(model.nuisance_indices["d33"]) * rho * rho)
        for state in self._acted(Stage.SENSOR, sigma[0]):
            charge = charge if state.factor is None else charge * state.factor
        level = charge[design.point]
        for state in self._acted(Stage.NEIGHBOURS):
            if state.factor is not None:
                neighbours = sum_rows(charge[design.neighbour_point], design.neighbour_recording, len(design.point))
                level = level + state.factor * neighbours
        for state in self._acted(Stage.RECORDING):
            level = level if state.factor is None else level * state.factor
        return level

    def _line_factor(self) -> Differentiated | None:
        """The complex factor of each distinct line; None without any such mechanism."""
        product: Differentiated | None = None
        for state in self._acted(Stage.LINES):
            factor = state.factor
            if factor is not None:
                product = factor if product is None else product * factor
        return product


_ROOM = 1.01  # beyond the thickness' bounds
FAINT = 1e-12  # of the largest response, below which a recording has no direction
_QUANTITIES = 6  # of a linear layer's contact
_NODES, _MORE_NODES = 3, 6  # of the quadrature; the three are exact for charges of the fourth degree in the force
_LARGE = 0.4  # of the preload: a dynamic force beyond which three nodes err by more than 1e-4 of σ
_SMALL = 1e-3  # of the preload: a dynamic force used for the limit of 0; the error is of second order
_LEAST_FORCE = 1e-6  # of the preload, for a sphere that has left the skin


class FrfModel:
    """The FRF under given conditions by the base model and a set of mechanisms.

    Rows are all lines of all recordings, one recording after another.
    """

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions, table: SigmaTable) -> None:
        """Compute all that no parameter changes."""
        self._composition = Composition(mechanisms, conditions, "frf", frf_nuisances(conditions.skin))
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self.mechanisms = self._composition.mechanisms
        self._by_stage: dict[Stage, list[Mechanism]] = {}
        for mechanism in sorted(mechanisms, key=lambda mechanism: mechanism.rank):
            if mechanism.moves_predictions:
                self._by_stage.setdefault(mechanism.stage, []).append(mechanism)
        stages = {mechanism.stage for mechanism in mechanisms}
        fields = {field for mechanism in mechanisms for field in mechanism.reads}
        fields |= {"dynamic_force_n"} if Stage.LOAD_INCREMENT in stages else set()
        self.design = design = frf_design(conditions, fields, neighbours=Stage.NEIGHBOURS in stages)
        self.recording = design.recording
        self.sensor: Indices | None = design.sensor
        skin = conditions.skin
        self.modulus = _required("youngs_modulus_mpa", skin.youngs_modulus_mpa)
        self.thickness = _required("thickness_mm", skin.thickness_mm)
        self.sensor_radius = _required("sensor_radius_mm", skin.sensor_radius_mm)
        self.poisson_ratio = skin.poisson_ratio
        bounds = max(
            max(1 / parameter.low, parameter.high) for parameter in self.parameters if parameter.name == "thickness"
        )
        stretch = _ROOM * bounds * LARGEST_STRETCH
        farthest = largest_offset(design, 1e-3 * LARGEST_OFFSET_MM * np.sqrt(2))
        offset_range = min(PROFILE_END, stretch * farthest / self.thickness)
        self.sigma = offset_sigma(table, self.sensor_radius / self.thickness, stretch, offset_range)
        self.needs_stiffness = "stiffness" in fields
        self.pickup: Pickup | None = together(_pickups(mechanisms, design))
        self.force, self.weights = design.force[None], np.zeros((0, len(design.force)))
        if Stage.LOAD_INCREMENT in stages:
            forces, self.weights = first_harmonic(design.force, design.dynamic_force)
            self.force = np.concatenate([self.force, forces])
        self._table, self._conditions = table, conditions

    @cached_property
    def valid(self) -> Mask:
        """Which rows lie inside the table as declared."""
        return self._declared_inside(self._table)[self.design.point][self.recording]

    def predict(self, fit: Floats, *, slopes: bool = True, place: bool = True) -> Prediction:
        """The FRF on every row with its derivatives on request: `slopes` by the parameters, `place` by the contact's x
        and y.

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
        values, _ = self._composition.values(fit)
        response = self.respond(fit, slopes=slopes, place=place)
        value, by_all = response.on_rows(self.design)
        count = len(response.level.slopes)
        return Prediction(
            value=value,
            slopes=by_all[:count],
            position_slopes=by_all[count:] if place else None,
            pickup=None if self.pickup is None else self.pickup.on_rows(self.pickup.deviation(_by_name(values))),
            pickup_rows=None if self.pickup is None else self.pickup.rows,
            inside=response.inside[self.recording],
        )

    def relative_place_slopes(self, fit: Floats) -> Floats:
        """∇m/m of each recording by its contact's position [1/m] (2, recordings) at one point; 0 where the response
        is faint."""
        response = self.respond(fit, slopes=False, place=True)
        assert response.place_slopes is not None
        value = response.level.value
        answers = np.abs(value) > FAINT * np.abs(value).max()
        return np.asarray(response.place_slopes / np.where(answers, value, np.inf))

    def values(self, fit: Floats) -> Iterator[Array]:
        """The FRF (rows,) at each of several points (points, parameters), without derivatives."""
        response = self.respond(fit, slopes=False)
        for point in range(len(fit)):
            yield response.part(point).on_rows(self.design)[0]

    def numbers(self, variables: int) -> int:
        """The approximate size of a response's largest arrays with derivatives by `variables`: limits the points
        computed at once."""
        contacts, lines = len(self.force.ravel()), len(self.design.line_frequency)
        return _QUANTITIES * contacts * len(self.sigma.wave_numbers[0]) + 2 * (1 + variables) * lines

    @property
    def nuisance_indices(self) -> Mapping[str, int]:
        """Indices in the fit coordinates of d33 and of the factors on the declared modulus and thickness."""
        return self._composition.nuisances

    def at_stage(self, stage: Stage) -> Sequence[Mechanism]:
        """The mechanisms of a stage that move predictions, in the order in which they act."""
        return self._by_stage.get(stage, ())

    def values_of(self, mechanism: Mechanism, variables: _Variables) -> Values:
        """A mechanism's parameters in their units."""
        return self._composition.values_of(mechanism.name, variables.of)

    def respond(self, fit: Floats, *, slopes: bool = True, place: bool = False) -> Response:
        """The response at points (…, parameters); its derivatives by the parameters (`slopes`) and by the contact's
        position (`place`) on request."""
        if fit.ndim == 1:
            return self.respond(fit[None], slopes=slopes, place=place).part(0)
        log = np.array([parameter.scale == "log" for parameter in self.parameters])
        variables = _Variables(fit, log, slopes=slopes, further=_POSITION if place else 0)
        contacts = self._contacts(variables)
        if len(fit) > 1 and (contacts.layered or self.needs_stiffness) and not contacts.share_a_layer:
            return joined([self.respond(point[None], slopes=slopes, place=place) for point in fit])
        return _Pressed(self, contacts, variables).response()

    def _contacts(self, variables: _Variables) -> Contacts:
        """The contacts at all force nodes, one node after another, as the mechanisms change what is declared."""
        nodes, design = len(self.force), self.design
        modulus, thickness = (variables.of(self.nuisance_indices[name]) for name in ("youngs_modulus", "thickness"))
        contacts = Contacts(
            force=self.force.ravel(),
            indenter_radius=np.tile(design.indenter_radius, nodes),
            dwell=np.tile(design.dwell, nodes),
            modulus=self.modulus * modulus,
            thickness=self.thickness * thickness,
            poisson_ratio=constant(self.poisson_ratio, variables.count, (variables.points,)),
        )
        for stage in _CONTACT:
            for mechanism in self.at_stage(stage):
                mechanism.act(contacts, self.values_of(mechanism, variables))
        return contacts

    def _declared_inside(self, table: SigmaTable) -> Mask:
        """Which points are inside the table for the declared values."""
        none = np.zeros((0, 1))
        modulus, thickness, poisson_ratio = (
            Differentiated(np.array([v]), none) for v in (self.modulus, self.thickness, self.poisson_ratio)
        )
        design = self.design
        contacts = Contacts(design.force, design.indenter_radius, design.dwell, modulus, thickness, poisson_ratio)
        a_over_h = contacts.hertz_radius.value / self.thickness
        a, x = table.axes[0], table.axes[2]
        inside = (a_over_h <= a[-1]) & (contacts.cbrt_load.value <= x[-1])
        distance = np.hypot(design.point_x, design.point_y) + self.sensor_radius
        near: Mask = inside[design.point_contact] & (distance <= PROFILE_END * self.thickness)
        return near


def first_harmonic(force: Floats, dynamic_force: Floats) -> tuple[Floats, Floats]:
    """Quadrature of the first harmonic of F σ(F) under an oscillating force, over its amplitude.

    Gauss–Chebyshev for (2/π) ∫₋₁¹ (F + Fd s) σ(F + Fd s) s/√(1 − s²) ds / Fd: forces [N] (nodes, contacts), and their
    weights of σ (nodes, contacts), which hold the force at the node.
    """
    amplitude = np.maximum(dynamic_force, _SMALL * force)
    nodes = _NODES if (amplitude < _LARGE * force).all() else _MORE_NODES
    s = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)[:, None]
    s = s[np.abs(s[:, 0]) > 1e-9]  # the middle one of three has no weight
    forces = np.maximum(force + amplitude * s, _LEAST_FORCE * force)
    return forces, 2 / nodes * s * forces / amplitude


def _pickups(mechanisms: Sequence[Mechanism], design: FrfDesign) -> list[Pickup]:
    """The charge from elsewhere of each mechanism that adds it."""
    states = []
    for mechanism in mechanisms:
        if mechanism.stage is Stage.ADDED_CHARGE:
            states.append(FrfState(design))
            mechanism.act(states[-1], {})
    return [state.pickup for state in states if state.pickup is not None]


def _by_name(values_by_mechanism: dict[str, Values]) -> dict[str, Floats]:
    """The parameters (1,) of all mechanisms by name."""
    return {name: value.value for values in values_by_mechanism.values() for name, value in values.items()}


def _required(name: str, value: float | None) -> float:
    if value is None:
        raise required(f"skin.{name}", "required by a recording of kind frf")
    return float(to_si(name, value))
