"""Which channel of a file a field's values are in, and what turns them into the field (`channels` of `rig/1`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from underskin.errors import ErrorCode, InvalidInput, out_of_range
from underskin.recordings import validation as field
from underskin.recordings.shown_values import shown

_WHOLE = 100.0  # %


@dataclass(frozen=True)
class Property:
    """A field's value that the file itself states under the name `property`."""

    property: field.Name


AUTOMATIC: Literal["auto"] = "auto"  # a sign that is told from how a curve goes as it is pressed
Sign = Literal[1, -1, "auto"]


def _sign(name: str, value: Any, units_checked: bool) -> Sign:
    if value == AUTOMATIC:
        return AUTOMATIC
    if isinstance(value, str) or field.number(name, value, units_checked) not in (1, -1):
        raise InvalidInput(name, shown(value), "must be 1, -1 or auto", code=ErrorCode.NOT_ONE_OF)
    return 1 if value == 1 else -1


def _percent(name: str, value: Any, units_checked: bool) -> float:
    result = field.positive(name, value, units_checked)
    if result > _WHOLE:
        raise out_of_range(name, result, "must be a part of the curve, greater than 0 and up to 100 (%)")
    return result


@dataclass(frozen=True)
class SignalMapping:
    """A channel and what its numbers mean.

    `channel` is the name in the file. `unit` is its true unit, which the file's own label must not contradict;
    `labelled` repeats a label that is known to be wrong, and no other is accepted. `sign` -1 turns the values round,
    `auto` does where they fall as a curve is pressed. `sensitivity` leads from a signal to a quantity: in signal over
    quantity (mV/N) it divides the signal, in quantity over signal (nm/V) it multiplies it.
    """

    channel: field.Name
    unit: field.Name | None = None
    labelled: field.Name | None = None
    sign: Annotated[Sign, _sign] | None = None
    sensitivity: field.Positive | None = None
    sensitivity_unit: field.Name | None = None


def _signal(name: str, value: Any, units_checked: bool) -> SignalMapping:
    return field.build(SignalMapping, name, value, units_checked)


def _spring_constant(name: str, value: Any, units_checked: bool) -> float | Property:
    if isinstance(value, Mapping):
        return field.build(Property, name, value, units_checked)
    return field.positive(name, value, units_checked)


@dataclass(frozen=True)
class ChannelMapping(SignalMapping):
    """Where a field's values are.

    Of `displacement_mm`: `stiffness_n_per_mm`, over which force is the instrument's own give; or `deflection`, the
    channel that has it. Either is subtracted. Of `force_n`: `spring_constant_n_per_m`, by which a channel that is a
    deflection is multiplied, or the property of the file that states it. `tare_percent` is the part of each curve, from
    its start, over which the mean of the field becomes 0.
    """

    stiffness_n_per_mm: field.Positive | None = None
    deflection: Annotated[SignalMapping, _signal] | None = None
    spring_constant_n_per_m: Annotated[float | Property, _spring_constant] | None = None
    tare_percent: Annotated[float, _percent] | None = None

    @property
    def signals(self) -> tuple[SignalMapping, ...]:
        """All channels that the field is made of."""
        return (self,) if self.deflection is None else (self, self.deflection)
