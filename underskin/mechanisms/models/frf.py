"""The FRF of recordings under a set of mechanisms, for one set or several at once.

Base model: Hertz' radius on a half space, a fixed contact edge, σ of the bonded finite-strain layer averaged over the
sensor's disc at its offset; FRF = d33 · (3/2) ρ² σ (Seminara 2018, equations 7 to 16). The stages, in this order:

declared values → material → contact radius and pressure → position → σ → increment with the load → d33 of each
sensor under its own stress → neighbours' charge → ageing → dynamics of tip, sensor and electronics, line by line.
Pick-up is a covariance.

Models of the same conditions share contacts, positions and the table, which take most of the time. Points whose
models press the same contacts are computed as one array, as far as their contacts have the same structure (sphere on
half space or layer, with or without adhesion, a glue line). A mechanism acts once for all points whose models
have it. The derivatives of a point are those by its own model's parameters, in their order.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated, chain, constant, sum_rows
from underskin.errors import ErrorCode, InvalidInput, required
from underskin.mechanisms.base import Mechanism, Parameter, Stage, Values
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
    as_in_the_table,
    layer_of,
    offset_sigma,
)
from underskin.recordings.campaign import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices, Mask, to_si


class ParameterBatch:
    """Points of fit coordinates as values in their units, with derivatives by each point's own coordinates.

    Attributes: `owner`, the model of each point; `variables`, the number of derivatives; `position`, two further
    variables of value 0, or none.
    """

    def __init__(self, fit: Floats, log: Mask, owner: Indices, *, slopes: bool, further: int) -> None:
        """`log`: which coordinates (points, parameters) are logarithms; without `slopes`, derivatives are by the
        `further` variables alone."""
        self.owner = owner
        self._value = np.where(log, np.exp(np.where(log, fit, 0.0)), fit)
        self._slope = np.where(log, self._value, 1.0)
        self._slopes = slopes
        count = fit.shape[1] if slopes else 0
        self.variables = count + further
        self.position = []
        for index in range(count, self.variables):
            seed = np.zeros((self.variables, 1, 1))
            seed[index] = 1.0
            self.position.append(Differentiated(np.zeros((1, 1)), seed))

    def of(self, points: Indices, indices: Indices) -> Differentiated:
        """The parameters at these indices of each model, for some of the points: (points, 1)."""
        columns = indices[self.owner[points]]
        slopes = np.zeros((self.variables, len(points), 1))
        if self._slopes:
            slopes[columns, np.arange(len(points)), 0] = self._slope[points, columns]
        return Differentiated(self._value[points, columns][:, None], slopes)


class MechanismInModels:
    """A mechanism with its parameters' indices in several models. Attribute: `has` (models,), which models hold it."""

    def __init__(self, mechanism: Mechanism, parameters: Mapping[str, Parameter], models: int) -> None:
        """Start with no model."""
        self.mechanism = mechanism
        self.has = np.zeros(models, dtype=bool)
        self._indices = {name: np.zeros(models, dtype=np.intp) for name in parameters}
        self._relative = [
            (name, parameter.relative_to) for name, parameter in parameters.items() if parameter.relative_to
        ]

    def add(self, model: int, indices: Mapping[str, int]) -> None:
        """Record that a model has it, with its parameters at these indices."""
        self.has[model] = True
        for name, index in indices.items():
            self._indices[name][model] = index

    def values(self, points: Indices, seeds: ParameterBatch) -> Values:
        """Its parameters in their units at points whose models have it."""
        values = {name: seeds.of(points, indices) for name, indices in self._indices.items()}
        for name, other in self._relative:
            values[name] = values[name] * values[other]
        return values


_POSITION = 2  # two more variables: the contact's x and y
_CONTACT = Stage.DECLARED, Stage.MATERIAL, Stage.CONTACT

Part = tuple[Indices, Response]  # which points, and their response


class FrfModels:
    """Several models of the same conditions and skin.

    Attributes: `at_stage`, the mechanisms of each stage that move predictions; `nuisances`, indices (models,) of d33
    and of the factors on the declared values.
    """

    def __init__(self, models: Sequence[FrfModel]) -> None:
        """Find which models have which mechanism, and which press the same contacts."""
        self._models = tuple(models)
        self._count = max(len(model.parameters) for model in models)
        self._log = np.zeros((len(models), self._count), dtype=bool)
        self.nuisances = {name: np.zeros(len(models), dtype=np.intp) for name in models[0].nuisance_indices}
        mechanisms: dict[Hashable, MechanismInModels] = {}
        self._alike: dict[Hashable, list[int]] = {}
        for number, model in enumerate(models):
            self._log[number, : len(model.parameters)] = [parameter.scale == "log" for parameter in model.parameters]
            for name, index in model.nuisance_indices.items():
                self.nuisances[name][number] = index
            for mechanism in model.mechanisms:
                indices = model.parameter_indices(mechanism)
                key = mechanism.name, tuple(indices)
                if key not in mechanisms:
                    mechanisms[key] = MechanismInModels(
                        mechanism, {name: model.parameters[column] for name, column in indices.items()}, len(models)
                    )
                mechanisms[key].add(number, indices)
            self._alike.setdefault(model.structure, []).append(number)
        self.at_stage: dict[Stage, list[MechanismInModels]] = {}
        for candidate in sorted(mechanisms.values(), key=lambda candidate: candidate.mechanism.rank):
            if candidate.mechanism.moves_predictions:
                self.at_stage.setdefault(candidate.mechanism.stage, []).append(candidate)

    def respond(self, owner: Indices, fit: Floats, *, slopes: bool, place: bool, lines: bool = True) -> list[Part]:
        """The responses at points (points, parameters) of these models, in rising order of `owner`, in parts of some
        points.

        Fit coordinates beyond those of a point's own model are ignored. `slopes`: derivatives by the parameters;
        `place`: by the contact's position; without `lines`, no line factors.
        """
        seeds = ParameterBatch(fit, self._log[owner], owner, slopes=slopes, further=_POSITION if place else 0)
        edges = np.searchsorted(owner, np.arange(len(self._models) + 1))
        parts: list[Part] = []
        for members in self._alike.values():
            present = [number for number in members if edges[number + 1] > edges[number]]
            if present:
                rows = {number: np.arange(edges[number], edges[number + 1]) for number in present}
                for points, contacts in self._pressed(rows, seeds):
                    pressed = _Pressed(self, self._models[present[0]], points, contacts, seeds)
                    parts.append((points, pressed.response(lines=lines)))
        return parts

    def _pressed(self, rows: dict[int, Indices], seeds: ParameterBatch) -> list[tuple[Indices, Contacts]]:
        """The contacts of these models' points, declared values changed by the mechanisms, grouped by structure."""
        sets: dict[tuple[MechanismInModels, ...], list[int]] = {}
        for number in rows:
            at_contact = (candidate for stage in _CONTACT for candidate in self.at_stage.get(stage, ()))
            key = tuple(candidate for candidate in at_contact if candidate.has[number])
            sets.setdefault(key, []).append(number)
        groups: dict[Hashable, list[tuple[Indices, Contacts]]] = {}
        for acting, numbers in sets.items():
            points = np.concatenate([rows[number] for number in numbers])
            contacts = self._contacts(self._models[numbers[0]], points, seeds)
            for candidate in acting:
                candidate.mechanism.act(contacts, candidate.values(points, seeds))
            needs_layer = contacts.layered or self._models[numbers[0]].needs_stiffness
            for subset, part in _split_by_layer(contacts, len(points)) if needs_layer else [(slice(None), contacts)]:
                layer = layer_of(part) if needs_layer else as_in_the_table(part)
                structure = part.layered, *(x is None for x in part.optional), layer
                groups.setdefault(structure, []).append((points[subset], part))
        return [
            (np.concatenate([points for points, _ in group]), Contacts.stacked([part for _, part in group], lengths))
            for group in groups.values()
            for lengths in ([len(points) for points, _ in group],)
        ]

    def _contacts(self, model: FrfModel, points: Indices, seeds: ParameterBatch) -> Contacts:
        """The declared contacts at all force nodes, one node after another."""
        nodes, design = len(model.force), model.design
        factors = {name: seeds.of(points, indices) for name, indices in self.nuisances.items() if name != "d33"}
        return Contacts(
            force=model.force.ravel(),
            indenter_radius=np.tile(design.indenter_radius, nodes),
            dwell=np.tile(design.dwell, nodes),
            modulus=model.modulus * factors["youngs_modulus"],
            thickness=model.thickness * factors["thickness"],
            poisson_ratio=constant(model.poisson_ratio, seeds.variables, (len(points),)),
        )


@dataclass(frozen=True)
class _Pressed:
    """Contacts of one structure at some of the points; `model` is one of those that press them."""

    models: FrfModels
    model: FrfModel
    points: Indices
    contacts: Contacts
    seeds: ParameterBatch

    def response(self, *, lines: bool) -> Response:
        """The response, with the derivatives by the contact's position separate from the others; without `lines` no
        line factors."""
        sigma, inside = self._sigma()
        level = self._level(sigma).spread(len(self.model.design.point))
        factor = self._line_factor() if lines else None
        seeds, position_slopes = self.seeds, None
        count = seeds.variables - len(seeds.position)
        if seeds.position:
            position_slopes = level.slopes[count:]
        if factor is not None:
            factor = Differentiated(factor.value, factor.slopes[:count])
        inside = np.broadcast_to(inside, (len(self.points), inside.shape[-1]))[:, self.model.design.point]
        return Response(Differentiated(level.value, level.slopes[:count]), position_slopes, factor, inside)

    def _acted(self, stage: Stage, sigma: Differentiated | None = None) -> Iterator[tuple[FrfState, Indices | None]]:
        """What each mechanism of this stage made of the state, with the indices of the points whose models have it
        (None: all)."""
        owner = self.seeds.owner[self.points]
        for candidate in self.models.at_stage.get(stage, ()):
            having = np.flatnonzero(candidate.has[owner])
            if not len(having):
                continue
            subset = None if len(having) == len(owner) else having
            values = candidate.values(self.points if subset is None else self.points[subset], self.seeds)
            state = FrfState(self.model.design, self.contacts.at_points(subset))
            state.sigma = None if sigma is None else sigma.at_points(subset)
            candidate.mechanism.act(state, values)
            yield state, subset

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
        design, seeds, count = self.model.design, self.seeds, len(self.points)
        moved = [(subset, state.shift) for state, subset in self._acted(Stage.POSITION)]
        if not (seeds.position or moved):
            distance = np.tile(np.hypot(design.point_x, design.point_y), (count, 1))
            return Differentiated(distance, np.zeros((seeds.variables, *distance.shape)))
        still = constant(0.0, seeds.variables, (count,))
        x, y = (
            coordinate + shift
            for coordinate, shift in zip((design.point_x, design.point_y), seeds.position or 2 * [still], strict=True)
        )
        for subset, shift in moved:
            if shift is not None:
                x, y = (
                    coordinate.plus(displacement, subset, count)
                    for coordinate, displacement in zip((x, y), shift, strict=True)
                )
        distance = np.hypot(x.value, y.value)
        away = np.where(distance > 0, distance, 1.0)
        return chain(distance, (x.value / away, x), (y.value / away, y))

    def _level(self, sigma: list[Differentiated]) -> Differentiated:
        """The FRF of each recording before the dynamics [C/N]."""
        model, design, count = self.model, self.model.design, len(self.points)
        oscillating = sigma[0]
        for state, subset in self._acted(Stage.LOAD_INCREMENT):
            assert state.factor is not None
            first_harmonic = sigma[1] * model.weights[0][design.point_contact]
            for node, weight in zip(sigma[2:], model.weights[1:], strict=True):
                first_harmonic = first_harmonic + node * weight[design.point_contact]
            oscillating = oscillating.plus(state.factor * (first_harmonic - sigma[0]).at_points(subset), subset, count)
        rho = model.sensor_radius / self.contacts.thickness
        charge = oscillating * (1.5e-12 * self.seeds.of(self.points, self.models.nuisances["d33"]) * rho * rho)
        for state, subset in self._acted(Stage.SENSOR, sigma[0]):
            charge = charge.times(state.factor, subset, count)
        level = charge[design.point]
        for state, subset in self._acted(Stage.NEIGHBOURS):
            if state.factor is not None:
                neighbours = charge.at_points(subset)[design.neighbour_point]
                theirs = state.factor * sum_rows(neighbours, design.neighbour_recording, len(design.point))
                level = level.plus(theirs, subset, count)
        for state, subset in self._acted(Stage.RECORDING):
            level = level.times(state.factor, subset, count)
        return level

    def _line_factor(self) -> Differentiated | None:
        """The complex factor of each distinct line; None without any such mechanism."""
        product: Differentiated | None = None
        count, lines = len(self.points), len(self.model.design.line_frequency)
        for state, subset in self._acted(Stage.LINES):
            factor = state.factor
            if product is None and subset is None:
                product = factor
            elif factor is not None:
                base = (
                    constant(np.ones(1, dtype=complex), self.seeds.variables, (count,)).spread(lines)
                    if product is None
                    else product
                )
                product = base.times(factor, subset, count)
        return product


def _split_by_layer(contacts: Contacts, points: int) -> list[tuple[slice | Indices, Contacts]]:
    """The points' contacts in parts, each on one linear layer."""
    layers = [x.value for x in (contacts.poisson_ratio, contacts.slip) if x is not None]
    if all(bool((value == value.flat[0]).all()) for value in layers):
        return [(slice(None), contacts)]
    return [(np.array([point]), contacts.at_points(np.array([point]))) for point in range(points)]


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
    def structure(self) -> Hashable:
        """A key that is equal for models that press the same contacts and need the same quantities of them."""
        return self.design, self.sigma, self.needs_stiffness, len(self.weights)

    @property
    def nuisance_indices(self) -> Mapping[str, int]:
        """Indices in the fit coordinates of d33 and of the factors on the declared modulus and thickness."""
        return self._composition.nuisances

    def parameter_indices(self, mechanism: Mechanism) -> Mapping[str, int]:
        """Indices in the fit coordinates of a mechanism's parameters, by their names."""
        return self._composition.indices[mechanism.name]

    def respond(self, fit: Floats, *, slopes: bool = True, place: bool = False) -> Response:
        """The response at points (…, parameters); its derivatives by the parameters and by the contact's position on
        request."""
        several = np.atleast_2d(fit)
        owner = np.zeros(len(several), dtype=np.intp)
        parts = FrfModels([self]).respond(owner, several, slopes=slopes, place=place)
        response = joined([part for _, part in parts]).part(np.argsort(np.concatenate([points for points, _ in parts])))
        return response if fit.ndim > 1 else response.part(0)

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
