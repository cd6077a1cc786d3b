"""The FRF of recordings under a set of mechanisms.

Base model: Hertz' radius on a half space, the contact edge still, σ of the bonded finite-strain layer averaged over the
sensor's disc at its offset; FRF = d33 · (3/2) ρ² σ (Seminara 2018, equations 7 to 16). The stages, in this order:

declared values → material → contact radius and pressure → position → σ → increment with the load → d33 of each
sensor under its own stress → neighbours' charge → ageing → dynamics of tip, sensor and electronics, line by line.
Pick-up stands beside, as a covariance.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated
from underskin.errors import ErrorCode, InvalidInput, required
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.models.composition import Composition, Prediction
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign, frf_design, largest_offset
from underskin.mechanisms.models.frf_models import FrfModels
from underskin.mechanisms.models.nuisances import frf_nuisances
from underskin.mechanisms.models.off_centre_response import PROFILE_END, offset_sigma
from underskin.mechanisms.models.pickup import Pickup, together
from underskin.mechanisms.models.response import Response, joined
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices, Mask, to_si

_ROOM = 1.01  # beyond the thickness' bounds
FAINT = 1e-12  # of the largest response, below which a recording has no direction
_QUANTITIES = 6  # of a linear layer's contact


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
        self._composition = Composition(mechanisms, conditions, "frf", frf_nuisances(conditions.skin))
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self.mechanisms = self._composition.mechanisms
        fields = {field for mechanism in mechanisms for field in (*mechanism.needs_fields, *mechanism.reads_fields)}
        fields |= {"id" for mechanism in mechanisms if mechanism.tells_recordings_apart}
        neighbours = any(mechanism.needs_neighbours for mechanism in mechanisms)
        self.design = design = frf_design(conditions, fields, neighbours=neighbours)
        self.recording = design.recording
        self.sensor: Indices | None = design.sensor
        skin = conditions.skin
        self.modulus = _required("youngs_modulus_mpa", skin.youngs_modulus_mpa)
        self.thickness = _required("thickness_mm", skin.thickness_mm)
        self.sensor_radius = _required("sensor_radius_mm", skin.sensor_radius_mm)
        self.poisson_ratio = skin.poisson_ratio
        room = (*mechanisms, *beside)
        further = max((mechanism.largest_offset for mechanism in room), default=0.0)
        bounds = max(max(1 / entry.low, entry.high) for entry in self.parameters if entry.name == "thickness")
        stretch = _ROOM * bounds * max((mechanism.largest_stretch for mechanism in room), default=1.0)
        reached = min(PROFILE_END, stretch * largest_offset(design, further) / self.thickness)
        self.sigma = offset_sigma(table, self.sensor_radius / self.thickness, stretch, reached)
        self.needs_stiffness = any(mechanism.needs_stiffness for mechanism in mechanisms)
        pickups = [mechanism.pickup(conditions, design) for mechanism in self.mechanisms]
        self.pickup: Pickup | None = together([pickup for pickup in pickups if pickup is not None])
        self.force, self.increments = _force_nodes(self.mechanisms, design)
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
        own, _, _ = self._composition.values(fit)
        response = self.respond(fit, slopes=slopes, place=place)
        value, by_all = response.on_rows(self.design)
        count = len(response.level.slopes)
        return Prediction(
            value=value,
            slopes=by_all[:count],
            position_slopes=by_all[count:] if place else None,
            pickup=None if self.pickup is None else self.pickup.on_rows(self.pickup.deviation(_by_name(own))),
            pickup_rows=None if self.pickup is None else self.pickup.rows,
            inside=response.inside[self.recording],
        )

    def relative_place_slopes(self, fit: Floats) -> Floats:
        """∇m/m of each recording over its contact's place [1/m] (2, recordings) at one point; 0 of what is faint."""
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
        """How many numbers the largest arrays of a response with derivatives by so many variables take, roughly: bounds
        the points that are worked out at once."""
        contacts, lines = len(self.force.ravel()), len(self.design.line_frequency)
        return _QUANTITIES * contacts * self.sigma.wavenumbers + 2 * (1 + variables) * lines

    @property
    def structure(self) -> Hashable:
        """The same for models that press the same contacts and need the same of them."""
        increments = tuple(mechanism.name for mechanism, _, _ in self.increments)
        return self.design, self.sigma, self.needs_stiffness, increments

    @property
    def places_of_nuisances(self) -> Mapping[str, int]:
        """Where in the fit coordinates d33 and the factors on the declared modulus and thickness are."""
        return self._composition.nuisances

    def places_of(self, mechanism: Mechanism) -> Mapping[str, int]:
        """Where in the fit coordinates a mechanism's parameters are, by their names."""
        return self._composition.places[mechanism.name]

    def respond(self, fit: Floats, *, slopes: bool = True, place: bool = False) -> Response:
        """The response at points (…, parameters); its derivatives by the parameters and by the contact's place on
        request."""
        several = np.atleast_2d(fit)
        owner = np.zeros(len(several), dtype=np.intp)
        parts = FrfModels([self]).respond(owner, several, slopes=slopes, place=place)
        response = joined([part for _, part in parts]).part(np.argsort(np.concatenate([points for points, _ in parts])))
        return response if fit.ndim > 1 else response.part(0)

    def _declared_inside(self, table: SigmaTable) -> Mask:
        """Which points lie inside the table as declared."""
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


def _by_name(own: dict[str, Values]) -> dict[str, Floats]:
    """The mechanisms' parameters (1,), whosever they are."""
    return {name: value.value for values in own.values() for name, value in values.items()}


def _required(name: str, value: float | None) -> float:
    if value is None:
        raise required(f"skin.{name}", "required by a recording of kind frf")
    return float(to_si(name, value))
