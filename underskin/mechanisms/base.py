"""The interface of a mechanism: a law that the base model leaves out, and the stage of the model at which it acts.

A mechanism is one file: a class that states its texts and traits as attributes and its law in one hook, `act`. It keeps
no state. Values on a state are SI, parameters are in their units.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import Enum
from typing import Any, ClassVar, Literal

from underskin.autodiff import Differentiated
from underskin.errors import UnderskinError
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.campaign import Conditions

Kind = Literal["frf", "indentation", "compression"]
UNITS = (
    *("-", "mm", "MPa", "1/MPa", "GPa", "N/mm", "N·s/mm", "N", "1/N", "g", "J/m²", "Hz", "s", "1/s", "ms", "µs", "°"),
    *("pC", "pC/N", "pF", "MΩ", "cycles", "h"),
)
AXES = (  # fields of a campaign along which an effect can show
    *("preload_n", "indenter_radius_mm", "position_mm", "sensor", "dwell_s", "load_cycles", "dynamic_force_n"),
    *("frequency_hz", "phase", "displacement_mm", "force_n", "time_s", "sample_height_mm", "sample_diameter_mm"),
)
TEXTS = ("plain", "law", "assumptions", "source", "needs")
NEEDED_FIELDS = ("dwell_s", "dynamic_force_n", "load_cycles", "sensor")  # of a recording, that a mechanism may require
READS = (*NEEDED_FIELDS, "stiffness", "id")


class Stage(Enum):
    """Where in a model a mechanism acts, in the order of composition; the value names the stage in a sentence."""

    DECLARED = "declared values"
    MATERIAL = "material"
    POSITION = "position"
    CONTACT = "contact radius and pressure"
    LOAD_INCREMENT = "increment with the load"
    SENSOR = "d33 of each sensor"
    NEIGHBOURS = "charge of the neighbours"
    RECORDING = "factor on each recording"
    LINES = "dynamics, line by line"
    ADDED_CHARGE = "charge from elsewhere, as a covariance"
    CURVE = "curves"


class Unsupported(UnderskinError):
    """A campaign cannot support a mechanism. Attributes: `mechanism`, `reason` (what is lacking, in words)."""

    def __init__(self, mechanism: str, reason: str) -> None:
        self.mechanism = mechanism
        self.reason = reason
        super().__init__(f"{mechanism}: {reason}")


Values = Mapping[str, Differentiated]  # of one mechanism's parameters, by name, in their units


class Mechanism:
    """A law that the base model leaves out.

    Texts: `plain` (what happens and how it shows, one sentence without a formula), `law` (the equation),
    `assumptions`, `source` (a publication), `needs` (what the campaign must hold).
    Traits: `stage` and `order` (rank among the mechanisms of that stage, smallest first) give the order of
    composition; `kinds` of recordings that it acts on; `axes` of the campaign on which the effect shows;
    `parameters_stated`, the parameters where they are the same for all campaigns and kinds; `reads`, of READS:
    fields of a recording without which it cannot be predicted, the contacts' `stiffness`, and `id` where its lines
    differ between recordings of one and the same contact.
    """

    name: str
    plain: str
    law: str
    assumptions: str
    source: str
    needs: str = "nothing beyond the recordings themselves"
    stage: ClassVar[Stage]
    order: ClassVar[int] = 100
    kinds: ClassVar[tuple[Kind, ...]] = ("frf",)
    axes: ClassVar[tuple[str, ...]]
    reads: ClassVar[tuple[str, ...]] = ()
    parameters_stated: tuple[Parameter, ...] = ()

    def __init_subclass__(cls) -> None:
        """Join texts that are written over several lines."""
        for name in TEXTS:
            if isinstance(text := vars(cls).get(name), str):
                setattr(cls, name, " ".join(text.split()))

    @property
    def rank(self) -> tuple[int, int, str]:
        """Its place in the order of composition."""
        return list(Stage).index(self.stage), self.order, self.name

    @property
    def acts_on_frfs(self) -> bool:
        """Whether FRFs are among the recordings that it acts on."""
        return "frf" in self.kinds

    @property
    def needs_lines(self) -> bool:
        """Whether it acts on single lines, so that the lines of a recording cannot be replaced by their mean."""
        return self.stage in (Stage.LINES, Stage.ADDED_CHARGE)

    @property
    def moves_predictions(self) -> bool:
        """Whether it changes the mean of the recordings; else it changes their covariance alone."""
        return self.stage is not Stage.ADDED_CHARGE and type(self).act is not Mechanism.act

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The parameters for recordings of one kind; bounds may depend on the campaign, and what can be identified
        on the other mechanisms of the model."""
        return self.parameters_stated

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """What the campaign lacks to support it, in words; None where nothing is lacking."""
        return None

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """Starting values of the parameters for fits, in their order and units, estimated from measured recordings."""
        return ()

    def act(self, state: Any, values: Values) -> None:
        """Change the state of the model at this mechanism's stage.

        `state`: of FRFs the `Contacts` at the stages DECLARED, MATERIAL and CONTACT, and an `FrfState` at the others;
        of indentations and compressions the `Curve`. At the stage ADDED_CHARGE it is called once for a model, without
        values.
        """
