"""The interface of a mechanism: a law that the base model leaves out, and the stage of the model at which it acts.

A mechanism is one file: a class that states its texts and traits as attributes and overrides the hooks of the stages
at which it acts. It keeps no state. Values inside hooks are SI, parameters are in their units.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, ClassVar, Literal

from underskin.autodiff import Differentiated, log
from underskin.errors import UnderskinError
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.campaign import Conditions
from underskin.units import Array, Floats

if TYPE_CHECKING:
    from underskin.mechanisms.models.contact_state import Contacts
    from underskin.mechanisms.models.curve_state import Curve
    from underskin.mechanisms.models.frf_design import FrfDesign, Pickup
    from underskin.surrogate.sigma_table import SigmaTable

Kind = Literal["frf", "indentation", "compression"]
UNITS = (
    *("-", "mm", "MPa", "1/MPa", "GPa", "N/mm", "N", "1/N", "g", "J/m²", "Hz", "s", "1/s", "ms", "µs", "°"),
    *("pC", "pC/N", "pF", "MΩ", "cycles", "h"),
)
AXES = (  # fields of a campaign along which an effect can show
    *("preload_n", "indenter_radius_mm", "position_mm", "sensor", "dwell_s", "load_cycles", "dynamic_force_n"),
    *("frequency_hz", "phase", "displacement_mm", "force_n", "time_s", "sample_height_mm", "sample_diameter_mm"),
)
TEXTS = ("plain", "law", "assumptions", "source", "needs")
NEEDED_FIELDS = ("dwell_s", "dynamic_force_n", "load_cycles", "sensor")  # of a recording, that a mechanism may require


class Stage(Enum):
    """Where in a model a mechanism acts, in the order of composition; the value names the stage in a sentence."""

    DECLARED = "declared values"  # on_declared, on_curve
    MATERIAL = "material"  # on_material, on_curve
    POSITION = "position"  # offset
    CONTACT = "contact radius and pressure"  # on_material, on_curve
    LOAD_INCREMENT = "increment with the load"  # force_nodes and mobility
    SENSOR = "d33 of each sensor"  # on_d33, or a parameter that acts on gain_spread
    NEIGHBOURS = "charge of the neighbours"  # neighbour_fraction
    RECORDING = "factor on each recording"  # on_recordings
    LINES = "dynamics, line by line"  # on_lines
    ADDED_CHARGE = "charge from elsewhere, as a covariance"  # pickup
    CURVE = "curves"  # on_curve

    @property
    def position(self) -> int:
        """Its index in the order of composition."""
        return list(Stage).index(self)


class Unsupported(UnderskinError):
    """A campaign cannot support a mechanism. Attributes: `mechanism`, `reason` (what is lacking, in words)."""

    def __init__(self, mechanism: str, reason: str) -> None:
        self.mechanism = mechanism
        self.reason = reason
        super().__init__(f"{mechanism}: {reason}")


Values = Mapping[str, Differentiated]  # of one mechanism's parameters, by name, in their units


class Mechanism:
    """A law that the base model leaves out. Subclasses override hooks; the default of every hook does nothing.

    Texts: `plain` (what happens and how it shows, one sentence without a formula), `law` (the equation),
    `assumptions`, `source` (a publication), `needs` (what the campaign must hold).
    Traits: `stage` and `order` (rank among the mechanisms of that stage, smallest first) give the order of
    composition; `kinds` of recordings that it acts on; `axes` of the campaign on which the effect shows.
    """

    name: str
    plain: str
    law: str
    assumptions: str
    source: str
    stage: ClassVar[Stage]
    order: ClassVar[int] = 100
    kinds: ClassVar[tuple[Kind, ...]] = ("frf",)
    axes: ClassVar[tuple[str, ...]]
    needs: str = "nothing beyond the recordings themselves"
    parameters_stated: tuple[Parameter, ...] = ()  # those that are the same for all campaigns and kinds
    # Fields of a recording without which it cannot be predicted, of NEEDED_FIELDS; they distinguish contacts.
    needs_fields: ClassVar[tuple[str, ...]] = ()
    reads_fields: ClassVar[tuple[str, ...]] = ()  # the same, but it can be predicted without them
    # What a model prepares for it: the contacts' stiffness, the neighbours' charge, room for an offset [m] and for a
    # layer that much thicker or thinner.
    needs_stiffness: ClassVar[bool] = False
    needs_neighbours: ClassVar[bool] = False
    tells_recordings_apart: ClassVar[bool] = False  # its lines differ between recordings of one and the same contact
    largest_offset: ClassVar[float] = 0.0
    largest_stretch: ClassVar[float] = 1.0
    moves_predictions: ClassVar[bool] = True  # False: it acts on the covariance only
    moves_contact_points: ClassVar[bool] = False  # of indentations: contact begins at another travel
    begins_at_guesses: ClassVar[bool] = False  # fits begin only at its guesses, not at quantiles of its priors
    needs_history: ClassVar[bool] = False  # a curve without its beginning cannot be predicted
    imitated_by_seating: ClassVar[bool] = False  # a platen that seats bends the beginning of a compression alike
    extrapolates_modulus: ClassVar[bool] = False  # its law extrapolates the modulus to zero strain
    # Axes of its figure, keys of PANELS in docs/mechanisms/signatures.py; empty: the first two of `axes` with a panel.
    figure: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        """Join texts that are written over several lines."""
        for name in TEXTS:
            if isinstance(text := vars(cls).get(name), str):
                setattr(cls, name, " ".join(text.split()))

    @property
    def needs_lines(self) -> bool:
        """Whether it acts on single lines, so that the lines of a recording cannot be replaced by their mean."""
        return self.stage in (Stage.LINES, Stage.ADDED_CHARGE)

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The parameters for recordings of one kind; bounds may depend on the campaign."""
        return self.parameters_stated

    def parameters_with(
        self, others: Collection[Mechanism], conditions: Conditions, kind: Kind
    ) -> tuple[Parameter, ...]:
        """The parameters in a model that also holds these other mechanisms, which may make more of them
        identifiable."""
        return self.parameters(conditions, kind)

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """Starting values of the parameters for fits, in their order and units, estimated from measured recordings."""
        return ()

    def shared_parameters(self, kind: Kind, values: Values) -> Mapping[str, Differentiated]:
        """Fit coordinates for recordings of another kind, by parameter name, that follow from the values for this
        kind."""
        stated = {parameter.name: parameter for parameter in self.parameters_stated}
        return {
            name: log(value) if name in stated and stated[name].scale == "log" else value
            for name, value in values.items()
        }

    def told(self, values: Mapping[str, float]) -> str:
        """A sentence on what values of the parameters mean together; empty where each value is clear by itself."""
        return ""

    def transfer(self, values: Mapping[str, float], conditions: Conditions) -> Mapping[str, float]:
        """Parameter values for another campaign that follow from the values found on the first.

        Raises InvalidInput where they do not determine the prediction for that campaign.
        """
        return values

    def hidden_in_modulus(self, conditions: Conditions) -> Sequence[float]:
        """Equally probable log factors by which the mechanism may raise the apparent modulus of curves, where
        recordings cannot separate it from the modulus; empty where they can."""
        return ()

    def bind(self, conditions: Conditions, table: SigmaTable) -> Mechanism:
        """The mechanism bound to the recordings of one campaign and their subsets; itself where it needs no
        campaign."""
        return self

    def follows_from_declared(self, conditions: Conditions, kind: Kind) -> bool:
        """Whether it follows from declared facts without a free parameter: each hypothesis then holds it with prior
        odds of 1."""
        return False

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """What the campaign lacks to support it, in words; None where nothing is lacking."""
        return None

    # Stages of the FRF model, in the order in which they act.

    def on_declared(self, contacts: Contacts, values: Values) -> None:
        """Change the declared modulus and thickness."""

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Change the material and interface of each contact: modulus, Poisson ratio, glue, adhesion, half space or
        layer."""

    def offset(self, values: Values) -> tuple[Differentiated, Differentiated] | None:
        """The offset that is added to the contact's position, x and y [m]."""
        return None

    def force_nodes(self, force: Floats, dynamic_force: Floats) -> tuple[Array, Array] | None:
        """Forces [N] (nodes, contacts) and weights (nodes, contacts): Σ weight · σ(force) is the oscillation's σ."""
        return None

    def mobility(self, values: Values) -> Differentiated:
        """The fraction of that σ in the measured response."""
        raise NotImplementedError

    def on_d33(self, mean_stress: Differentiated, values: Values) -> Differentiated | None:
        """The factor on d33 at each point, from the static mean stress there [Pa] (compression positive)."""
        return None

    def on_recordings(self, design: FrfDesign, values: Values) -> Differentiated | None:
        """The factor on each recording."""
        return None

    def neighbour_fraction(self, values: Values) -> Differentiated | None:
        """The fraction of the neighbours' charge that a sensor's channel shows."""
        return None

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated | None:
        """The complex factor on each distinct line (contact and frequency)."""
        return None

    def pickup(self, conditions: Conditions, design: FrfDesign) -> Pickup | None:
        """Charge from other sources, random on each row, and the rows that it affects."""
        return None

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Change the material, contact or stage of an indentation or compression."""
