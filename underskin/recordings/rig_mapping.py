"""From an instrument's channels to a campaign document, by a rig description.

The blocks of a file are split into recordings (`recording_rows`); `MappedBlock` converts the channels of one block to
the fields of one recording, in the fields' units, and says in words what it used; `apply` does all of it for a file.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any, ClassVar

import numpy as np

from underskin.errors import FileError, Mention, Requirement
from underskin.recordings.campaign import KINDS, SCHEMA
from underskin.recordings.channels import Block, Channel, Contents, Values, text_left_out
from underskin.recordings.curve_preparation import falling
from underskin.recordings.damaged_readings import marks, spikes
from underskin.recordings.field_words import stated_rate
from underskin.recordings.readers import channel_arithmetic
from underskin.recordings.readers.channel_arithmetic import FIELD
from underskin.recordings.readers.unit_labels import (
    DECIBEL,
    MIXED_AMPLITUDES,
    contradicts,
    decibel_reference,
    exponents,
    field_unit,
    meanings,
    mixes_amplitudes,
    ratio_of,
    unit,
)
from underskin.recordings.recording_rows import curve_parts, rows_of_recordings
from underskin.recordings.regular_samples import (
    aligned,
    complete_lines,
    evenly_sampled,
    longest_complete,
    mean_step,
    sorted_spectrum,
    with_joined,
)
from underskin.recordings.rig_description import (
    AUTOMATIC,
    AXES,
    BLOCK_NAME,
    COMPLEX_FRF,
    MAGNITUDE,
    PHASE,
    TEXTS,
    ChannelMapping,
    CurveChannel,
    Property,
    RigDescription,
    SignalMapping,
    Stated,
    Trim,
    UnreadableTime,
    common_value,
    factor,
    spring_constant,
    text_value,
)
from underskin.recordings.tare import rise_of
from underskin.recordings.validation import LONGEST_NAME, shown
from underskin.units import LAB, Floats, readable_unit

_SCALED = ("force_n", "displacement_mm")  # which are small under a small sphere


def readable(field: str, *values: float) -> str:
    """Values of a field in one unit: `0 to 1.787 µN`."""
    largest = max(map(abs, values))
    unit, count = readable_unit(field, largest) if field in _SCALED else (LAB[field].unit, 1.0)
    return f"{' to '.join(f'{count * value + 0.0:.4g}' for value in values)} {unit}"  # 0 instead of -0


def range_of(field: str, column: Floats) -> str:
    """The range of the finite values of a column with at least one."""
    finite = column[np.isfinite(column)]
    return readable(field, float(finite.min()), float(finite.max()))


_PERCENT = 100.0
_OF_UNIT = re.compile(r"unit|einheit|scale|skala|format|amplitude", re.IGNORECASE)
_SAME_RATE = 1e-3  # relative
_NO_DECIBELS = "decibels are a logarithm: state their reference as the unit, such as dB re 1 pC/N, or the ratio itself"
_LEAST_SAMPLES, _STILL = 16, 1e-9  # samples of a measured force; share of its largest value that is rounding


class MappedBlock:
    """The fields of one recording from one block; `taken`: the source of each field in words; `warnings` on them.
    `stated`: the properties of the file."""

    is_curve: ClassVar[bool] = True  # whose tared samples should be in the air

    def __init__(self, rig: RigDescription, block: Block, stated: Stated, file: str) -> None:
        self.rig = rig
        self.block = block
        self.stated = stated
        self.file = file
        self.warnings: list[str] = []
        self.taken: dict[str, str] = {}

    def fields(self) -> dict[str, Any]:
        """The columns."""
        values = {field: self._values(field, mapping) for field, mapping in self.rig.channels.items()}
        if COMPLEX_FRF in values:
            frf = values.pop(COMPLEX_FRF)
            values |= {"frf_re_pc_per_n": frf.real, "frf_im_pc_per_n": frf.imag}
        if any(np.iscomplexobj(column) for column in values.values()):
            only = Requirement("a channel of complex numbers can only be ", Mention(COMPLEX_FRF))
            raise self._error("", only)
        values = self._with_parts(values)
        columns: dict[str, Any] = {field: np.asarray(column, dtype=float) for field, column in values.items()}
        columns = self._complete(columns)
        columns = {field: self._tared(field, column) for field, column in columns.items()}
        columns = self._without_instrument(columns)
        self._say_ranges(columns)
        self._require_stated_sign(columns)
        return self._of_kind(columns) | ({"signs_checked": True} if self.rig.has_stated_signs else {})

    def _of_kind(self, columns: dict[str, Any]) -> dict[str, Any]:
        """Curves with the times that the sample rate gives."""
        rate = self._rate()
        if rate is not None and "time_s" not in columns:
            columns["time_s"] = np.arange(len(columns[next(iter(columns))])) / rate
        return columns

    def _rate(self) -> float | None:
        """Samples a second by the block, else by a property of the file."""
        stated = stated_rate(self.stated) if self.block.sample_rate_hz is None else None
        if stated is None:
            return self.block.sample_rate_hz
        self.taken["sample_rate_hz"] = f"property {stated[0]!r}: {stated[1]:.6g} Hz"
        return stated[1]

    def _complete(self, columns: Mapping[str, Floats]) -> dict[str, Floats]:
        """The columns without lines, or parts of a time series, which must not have gaps, that hold no number."""
        may_have_gaps = self.is_curve or "frequency_hz" in columns
        try:
            complete, note = (complete_lines if may_have_gaps else longest_complete)(columns)
        except ValueError as error:
            raise self._error("", str(error)) from None
        self.warnings += [note] if note else []
        return complete

    def _with_parts(self, values: Mapping[str, Values]) -> dict[str, Values]:
        """The columns with real and imaginary part instead of magnitude and phase."""
        rest = {field: column for field, column in values.items() if field not in (MAGNITUDE, PHASE)}
        if MAGNITUDE not in values:
            return rest
        self._refuse_stated_decibels()
        magnitude, phase = values[MAGNITUDE], values[PHASE]
        if (magnitude < 0).any():
            raise self._error("", Requirement(Mention(MAGNITUDE), f" is below 0, as no magnitude is: {_NO_DECIBELS}"))
        if len(magnitude) != len(phase):
            raise self._error("", Requirement(Mention(MAGNITUDE), " and ", Mention(PHASE), " differ in length"))
        with np.errstate(all="ignore"):
            frf = magnitude * np.exp(1j * np.radians(phase))
        return {**rest, "frf_re_pc_per_n": frf.real, "frf_im_pc_per_n": frf.imag}

    def _refuse_stated_decibels(self) -> None:
        """Reject a magnitude where a property of the file, such as `Y-axis unit: dB`, states decibels."""
        mapping = self.rig.channels[MAGNITUDE]
        channel = self.block.headed(mapping.channel)
        if decibel_reference(mapping.unit or (channel.label if channel else "")) is not None:
            return
        for name, value in self.stated.items():
            stated_unit = unit(value) if isinstance(value, str) and _OF_UNIT.search(name) else None
            if stated_unit is not None and stated_unit.dimension == DECIBEL:
                raise self._error(f"property {name!r}", f"is {value!r}: {_NO_DECIBELS}")

    def common_values(self) -> dict[str, Any]:
        """The fields that a recording has once, without a time that cannot be read, which a warning names."""
        values = {}
        for field, value in self.rig.recording.items():
            try:
                values[field] = self._common_value(field, value)
            except UnreadableTime as error:
                self.warnings.append(str(error))
        return values

    def _common_value(self, field: str, value: Any) -> Any:
        """The value of a field in its unit; of lists and mappings of each part."""
        if isinstance(value, list):
            return [self._common_value(axis, part) for axis, part in zip(AXES, value, strict=False)]
        if isinstance(value, Mapping):
            return {name: self._common_value(name, part) for name, part in value.items()}
        if isinstance(value, SignalMapping):
            return self._row_value(field, value)
        return common_value(field, value, self.stated, self.file)

    def _row_value(self, field: str, value: SignalMapping) -> Any:
        """The value of a field that a column holds in all rows of this recording, in the field's unit."""
        words = self.block.words(value.channel)
        if words is not None:
            text = words.texts[words.codes[0]]
            self.taken.setdefault(field, repr(words.name))
            return text_value(field, text)
        if field in LAB:
            values, self.taken[field] = self._signal(field, value)
            return float(values[0].real)
        channel = self.block.headed(value.channel)
        assert channel is not None
        self.taken[field] = repr(channel.name)
        number = float(channel.values[0].real)
        if field == "recorded_at":
            return text_value(field, f"{number:.15g}")
        return f"{number:g}" if field in TEXTS else number

    def spring(self) -> dict[str, float]:
        """The stiffness of the spring whose deflection was subtracted, where the recording has a field for it."""
        return {}

    def _values(self, field: str, mapping: ChannelMapping) -> Values:
        spring = mapping.spring_constant_n_per_m
        if spring is not None:
            constant = spring_constant(spring, self.stated, self.file)
            deflection, how = self._signal("displacement_mm", mapping)
            self.taken[field] = f"{how}, a deflection, times {constant:g} N/m"
            return deflection * 1e-3 * constant
        values, self.taken[field] = self._signal(field, mapping)
        if mapping.deflection is None:
            return values
        deflection, how = self._signal(field, mapping.deflection)
        if len(deflection) != len(values):
            channels = f"{mapping.channel!r} and {mapping.deflection.channel!r}"
            raise self._error("", f"{channels} differ in length: no deflection can be subtracted")
        self.taken[field] += f", less the deflection {how}"
        return values - deflection

    def _signal(self, field: str, mapping: SignalMapping) -> tuple[Values, str]:
        """A channel's values in the unit of a field, and their source in words."""
        channel = self.block.headed(mapping.channel)
        assert channel is not None
        place = f"channel {channel.name!r}"
        if len(channel.values) == 0:
            raise self._error(place, "holds no values")
        if field == "coherence":
            in_percent = (mapping.unit or channel.label) == "%"
            return channel.values / (_PERCENT if in_percent else 1.0), repr(channel.name)
        target = "frf_re_pc_per_n" if field in (COMPLEX_FRF, MAGNITUDE) else field
        label = self._true_unit(channel, mapping, "angle" if field == PHASE else field_unit(target).dimension)
        values = channel.values
        reference = decibel_reference(label) if field == MAGNITUDE else None
        if reference is not None:
            values = self._ratio(channel, reference, place)
        scale = (
            self._degrees(label, place) if field == PHASE else self._scale(target, reference or label, mapping, place)
        )
        through = f" through {mapping.sensitivity:g} {mapping.sensitivity_unit}" if mapping.sensitivity else ""
        sign = self._automatic_sign(mapping) if mapping.sign == AUTOMATIC else int(mapping.sign or 1)
        turned = ", turned round" if sign == -1 else ""
        with np.errstate(all="ignore"):
            return values * sign * scale, f"{channel.name!r} in {label}{through}{turned}"

    def _ratio(self, channel: Channel, reference: str, place: str) -> Values:
        """The ratio to the reference that decibels state; raises FileError where the label states another one."""
        labelled = decibel_reference(channel.label)
        if labelled is not None and unit(labelled) != unit(reference):
            raise self._error(place, f"is labelled {channel.label!r}, not decibels re {reference}")
        with np.errstate(all="ignore"):
            return 10 ** (channel.values / 20)

    def _automatic_sign(self, mapping: SignalMapping) -> int:
        """-1 where a channel falls during loading: determined from the raw channels, so that travel and deflection are
        both right before their difference is taken."""
        travel = self.block.headed(self.rig.channels["displacement_mm"].channel)
        is_travel = mapping is self.rig.channels["displacement_mm"]
        force = self.block.headed((self.rig.channels["force_n"] if is_travel else mapping).channel)
        assert travel is not None
        assert force is not None
        falls = falling(force.values.real, travel.values.real, sphere=KINDS[self.rig.kind].has_sphere)
        if ("displacement_mm" if is_travel else "force_n") not in falls:
            return 1
        self.warnings.append(f"channel {mapping.channel!r} falls as it is pressed, and was turned round")
        return -1

    def _tared(self, field: str, column: Floats) -> Floats:
        """A column less its mean over the initial part of the curve, `tare_percent` of the rig description."""
        percent = self.rig.channels[field].tare_percent if field in self.rig.channels else None
        if percent is None:
            return column
        tared = column[: max(1, round(percent / _PERCENT * len(column)))]
        zero = float(tared.mean())
        part = f"the first {percent:g} % of all samples"
        self.taken[field] += f", less {readable(field, zero)}, its mean over {part}"
        words = field.rpartition("_")[0]
        self.warnings.append(f"the {words} is 0 on average over {part} of each curve: it was tared so")
        rise = rise_of(column, len(tared)) if field == "force_n" and self.is_curve else None
        if rise is not None:
            shown_in, count = readable_unit(field, abs(rise.height))
            self.warnings.append(
                f"{part} of {self.block.name or 'the curve'} are not in the air alone: from about "
                f"{_PERCENT * rise.start / len(column):.2g} % of all samples, loading and way back together, the force "
                f"leaves its level by {rise.height * count:.3g} {shown_in}; tare over fewer: the zero is off by about "
                f"{abs(zero - rise.level) * count:.2g} {shown_in}"
            )
        return column - zero

    def _true_unit(self, channel: Channel, mapping: SignalMapping, dimension: str) -> str:
        """The rig's unit, else the file's label. They must agree unless the rig declares the label wrong."""
        label, place = channel.label, f"channel {channel.name!r}"
        if mapping.labelled is not None:
            if mapping.labelled != label:
                raise self._error(place, f"is labelled {label!r}, not {mapping.labelled!r} as the rig says")
            self.warnings.append(f"{place} is labelled {label!r}; the rig description says {mapping.unit!r}")
            return mapping.unit or ""
        if dimension == "charge/force" and mixes_amplitudes(channel.name, channel.unit):
            raise self._error(place, f"{MIXED_AMPLITUDES}, or if it does not, add labelled: {label} with the unit")
        if mapping.unit and contradicts(label, mapping.unit, channel.name, dimension):
            reason = f"is labelled {label!r}, but the rig description says {mapping.unit!r}"
            stated = unit(mapping.unit)
            of_one_dimension = stated is not None and any(
                meaning.dimension == stated.dimension for meaning in meanings(label)
            )
            if not (self.rig.units_checked and of_one_dimension):
                raise self._error(
                    place, f"{reason}: correct the one that is wrong; if it is the label, add labelled: {label}"
                )
            self.warnings.append(f"{place} {reason}, whose units_checked confirms it")
            return mapping.unit
        if not mapping.unit and len(meanings(label)) > 1:
            raise self._error(
                place, f"its unit {label!r} has several meanings: say it, as `unit` of the rig description"
            )
        if not (mapping.unit or label):
            raise self._error(
                place, "has no unit in the file: say it, as `unit` of the rig description or as its true unit"
            )
        return mapping.unit or label

    def _degrees(self, label: str, place: str) -> float:
        """From the unit of a phase to degrees."""
        label_unit = unit(label)
        if label_unit is None or label_unit.dimension != "angle":
            raise self._error(place, f"its unit {label!r} is none of an angle: a phase is in deg or rad")
        return math.degrees(label_unit.to_si)

    def _scale(self, field: str, label: str, mapping: SignalMapping, place: str) -> float:
        """From the channel's unit to the field's, through the sensitivity where there is one."""
        label_unit = unit(label)
        if label_unit is not None and label_unit.dimension == DECIBEL:
            raise self._error(place, _NO_DECIBELS)
        if mapping.sensitivity is None or mapping.sensitivity_unit is None:
            return factor(label, field, self.file, place, "; a signal in volts needs its sensitivity")
        above, _, below = mapping.sensitivity_unit.rpartition("/")
        channel_unit = unit(label)
        for signal, quantity, sensitivity in (
            (above, below, 1 / mapping.sensitivity),
            (below, above, mapping.sensitivity),  # nm/V, as those of cantilevers are stated
        ):
            divided, measured = unit(signal), unit(quantity)
            if channel_unit is None or divided is None:
                continue
            if channel_unit.dimension == divided.dimension:
                return channel_unit.to_si / divided.to_si * sensitivity * factor(quantity, field, self.file, place)
            if measured is not None and ratio_of(label, signal, quantity) == exponents(LAB[field].unit):  # V/N by mV/pC
                return channel_unit.to_si / divided.to_si * measured.to_si * sensitivity / LAB[field].to_si
        raise self._error(place, f"its unit {label!r} is not of the sensitivity's {mapping.sensitivity_unit!r}")

    def _without_instrument(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """The columns, the displacement corrected for the instrument's compliance (force over its stiffness)."""
        given = self.rig.channels.get("displacement_mm", ChannelMapping("")).stiffness_n_per_mm
        if given is None:
            return dict(columns)
        stiffness = spring_constant(given, self.stated, self.file, "N/mm")
        if len(columns["displacement_mm"]) != len(columns["force_n"]):
            both = (Mention("displacement_mm"), " and ", Mention("force_n"))
            reason = Requirement(*both, " differ in length: no stiffness can be applied")
            raise self._error("", reason)
        self.taken["displacement_mm"] += f", less the force over {stiffness:g} N/mm"
        return {**columns, "displacement_mm": columns["displacement_mm"] - columns["force_n"] / stiffness}

    def _say_ranges(self, columns: Mapping[str, Any]) -> None:
        for field, column in columns.items():
            if field in LAB and field in self.taken and np.isfinite(column).any():
                self.taken[field] += f": {range_of(field, column)}"

    def _require_stated_sign(self, columns: Mapping[str, Any]) -> None:
        """Raise FileError where force falls with displacement, unless the rig description states both signs."""
        signs = [self.rig.channels[name].sign for name in ("displacement_mm", "force_n") if name in self.rig.channels]
        if len(signs) < 2 or None not in signs or len(columns["displacement_mm"]) != len(columns["force_n"]):
            return
        travel, force = (np.asarray(columns[name], dtype=float) for name in ("displacement_mm", "force_n"))
        with np.errstate(all="ignore"):
            rows = ~(marks(force) | spikes(force))
            covariance = np.mean(_centred(travel[rows]) * _centred(force[rows]))
        if covariance < 0:
            reason = "force falls as the displacement grows, and compression is positive here"
            sign_field = Mention("sign", "sign: 1, -1 or auto")
            how = (sign_field, " for ", Mention("displacement_mm"), " and ", Mention("force_n"))
            doubt = ""
            depth = self.rig.channels["displacement_mm"].channel
            formula = self.rig.derived.get(depth)
            if formula is not None and formula.is_sum:
                turn = f"turn the terms of {formula.text} that fall as it is pressed"
                raise self._error(f"{FIELD}.{depth}", f"{reason}: {turn}{self._also_used(depth)}")
            if self.rig.channels["displacement_mm"].deflection is not None:
                doubt = "; or a unit is another than its heading says: a travel less a deflection needs both right"
            raise self._error("channels", Requirement(f"{reason}: say ", *how, doubt))

    def _also_used(self, derived: str) -> str:
        """Hints on channels of a formula that other formulas use as well, in words."""
        rest = {name: formula for name, formula in self.rig.derived.items() if name != derived}
        hint = ""
        for name in filter(self.block.headed, self.rig.derived[derived].names):
            others = [other for other, formula in rest.items() if name in formula.names]
            if others:
                of = " and of ".join(others)
                hint += f"; if it is {name!r} that is reversed, turn it in the formula of {of} too"
        return hint

    def _error(self, place: str, reason: str | Requirement) -> FileError:
        return FileError(self.file, place, reason)


class IndentationBlock(MappedBlock):
    """A sphere, whose pull-off from an adhesive contact the spring determines."""

    def spring(self) -> dict[str, float]:
        """`stage_stiffness_n_per_mm`, where a deflection was subtracted."""
        force = self.rig.channels.get("force_n", ChannelMapping(""))
        displacement = self.rig.channels.get("displacement_mm", ChannelMapping(""))
        spring, stiffness = force.spring_constant_n_per_m, displacement.stiffness_n_per_mm
        if stiffness is not None:
            return {"stage_stiffness_n_per_mm": spring_constant(stiffness, self.stated, self.file, "N/mm")}
        if displacement.deflection is None or spring is None:
            return {}
        return {"stage_stiffness_n_per_mm": 1e-3 * spring_constant(spring, self.stated, self.file)}


class FrfBlock(MappedBlock):
    """An FRF, or the time series of one, which is tared under the preload."""

    is_curve = False

    def _of_kind(self, columns: dict[str, Any]) -> dict[str, Any]:
        """Without the line at 0 Hz; time series with their sample rate."""
        time = columns.pop("time_s", None)
        if "frequency_hz" in columns:
            columns = self._sorted(columns)
        frequency = columns.get("frequency_hz")
        if frequency is not None and len(frequency) > 1 and frequency[0] == 0:
            self.warnings.append("the line at 0 Hz is left out")
            return {name: column[1:] for name, column in columns.items()}
        stated = self.rig.recording.get("sample_rate_hz")
        is_rated = time is not None or "force_n" not in columns or isinstance(stated, Property)
        rate = self.block.sample_rate_hz if time is None else None
        rate = self._rate() if rate is None and not is_rated else rate
        if "force_n" in columns and stated is None:
            if time is not None:
                columns, rate = self._evenly_sampled(columns, time)
            columns |= {} if rate is None else {"sample_rate_hz": rate}
        elif (
            rate is not None and isinstance(stated, int | float) and not math.isclose(rate, stated, rel_tol=_SAME_RATE)
        ):
            self.warnings.append(
                f"the file states {rate:g} samples a second; the rig description {stated:g}, which counts"
            )
        return {**columns, **self._measured_force(columns)}

    def _measured_force(self, columns: Mapping[str, Any]) -> dict[str, float]:
        """The dynamic force of a time series whose rig description states none: √2 times the rms of the recorded force
        about its linear drift."""
        force = columns.get("force_n", np.zeros(0))
        if "dynamic_force_n" in self.rig.recording or len(force) < _LEAST_SAMPLES or not np.isfinite(force).all():
            return {}
        position = np.linspace(-1.0, 1.0, len(force))
        shaken = force - force.mean() - position * (position @ force) / (position @ position)
        with np.errstate(all="ignore"):
            amplitude = float(np.sqrt(2) * shaken.std())
        if not _STILL * float(np.abs(force).max()) < amplitude < np.inf:
            return {}
        self.taken["dynamic_force_n"] = f"measured: √2 times the rms of the force about its drift, {amplitude:.4g} N"
        return {"dynamic_force_n": amplitude}

    def _sorted(self, columns: Mapping[str, Floats]) -> dict[str, Floats]:
        try:
            spectrum, notes = sorted_spectrum(columns)
        except ValueError as error:
            raise self._error("frequency_hz", str(error)) from None
        self.warnings += notes
        return spectrum

    def _evenly_sampled(self, columns: Mapping[str, Floats], time: Floats) -> tuple[dict[str, Floats], float]:
        try:
            even, rate, note = evenly_sampled(columns, time)
        except ValueError as error:
            raise self._error("time_s", f"{error} (step {shown(mean_step(time))} s)") from None
        self.warnings += [note] if note else []
        return even, rate


_BLOCKS = {"frf": FrfBlock, "indentation": IndentationBlock, "compression": MappedBlock}


def _centred(column: Floats) -> Floats:
    return column - column.mean()


def _text_left_out(rig: RigDescription, blocks: Sequence[Block]) -> list[str]:
    """Messages on the columns of words that the rig does not use."""
    used = {signal.channel for signal in rig.row_fields}
    columns = [
        column
        for block in blocks
        for column in block.texts
        if not block.channel(column.name) and not any(column is block.words(name) for name in used)
    ]
    return [text_left_out(column.name, next(filter(None, column.texts))) for column in columns]


def doubts(contents: Contents, curves: str | CurveChannel | None) -> list[str]:
    """A warning on groups of rows that are read as one curve although `curves` was not stated."""
    most = max((len(block.group_starts) for block in contents.blocks), default=0)
    if curves is not None or most < 2:
        return []
    question = "say curves: groups if each is one, or curves: file"
    return [f"{most} groups of rows, which blank or comment lines part, are read as one curve: {question}"]


@dataclass(frozen=True)
class MappedFile:
    """The campaign document of a file, warnings, and the source of each field of the first recording in words; the
    empty key of `taken` holds how the text was read."""

    document: dict[str, Any]
    warnings: list[str]
    taken: dict[str, str]


def apply(rig: RigDescription, contents: Contents, file: str) -> MappedFile:
    """The campaign document, one recording for each curve in a block that holds the rig's channels, and for each of the
    rig's entries, called after its sensor or its number.

    Raises FileError that names the channel or property that is missing or whose unit does not fit.
    """
    if not rig.entries:
        return _applied(rig, contents, file)
    mapped = [_applied(entry, contents, file) for entry in rig.entries]
    sensors = [entry.recording.get("sensor") for entry in rig.entries]
    are_distinct = all(isinstance(sensor, str) and sensors.count(sensor) == 1 for sensor in sensors)
    names = [_printable(str(sensor if are_distinct else number)) for number, sensor in enumerate(sensors, start=1)]
    recordings = [
        recording if "id" in entry.recording else {**recording, "id": _label(recording["id"], name)}
        for entry, name, of_entry in zip(rig.entries, names, mapped, strict=True)
        for recording in of_entry.document["recordings"]
    ]
    warnings = dict.fromkeys(warning for of_entry in mapped for warning in of_entry.warnings)
    return MappedFile({**mapped[0].document, "recordings": recordings}, list(warnings), mapped[0].taken)


def _applied(rig: RigDescription, contents: Contents, file: str) -> MappedFile:
    in_formulas = [name for formula in rig.derived.values() for name in formula.names]
    contents = aligned(contents, dict.fromkeys([*_channel_names(rig), *in_formulas]), file)
    contents = _with_derived(rig, contents, file)
    blocks = _with_channels(rig, contents, file)
    warnings = [*contents.warnings, *doubts(contents, rig.curves)]
    if len(blocks) < len(contents.blocks):
        warnings.append(f"{len(contents.blocks) - len(blocks)} parts without the rig's channels are left out")
    stem = _printable(PurePath(file).stem)
    recordings = []
    skins: list[dict[str, Any]] = []
    taken: dict[str, str] = {"": contents.layout} if contents.layout else {}
    warnings += _text_left_out(rig, blocks)
    curves = [
        (recording, block_name)
        for part, block_name in curve_parts(blocks, rig.curves, file)
        for recording in rows_of_recordings(rig, part, file)
    ]
    parts = [(_trimmed(block, rig.trim, file), block_name) for block, block_name in curves]
    if rig.trim is not None:
        warnings.append(_used(rig.trim, [_samples(block) for block, _ in curves]))
    for number, (block, block_name) in enumerate(parts, start=1):
        label = _label(stem, _printable(block.name) or str(number)) if len(parts) > 1 else stem
        stated = _stated(contents, block, block_name)
        mapped = _BLOCKS[rig.kind](rig, block, stated, file)
        common = mapped.common_values()
        skins.append({name: common_value(name, value, stated, file) for name, value in rig.skin.items()})
        recorded_at = {} if block.recorded_at is None else {"recorded_at": block.recorded_at}
        estimated = {} if rig.estimator is None else {"estimator": rig.estimator}
        identity = {"id": label, "kind": rig.kind, **recorded_at, **estimated}
        recordings.append({**identity, **mapped.spring(), **common, **mapped.fields()})
        warnings += mapped.warnings
        taken |= {name: how for name, how in mapped.taken.items() if name not in taken}
    for name in (name for name in rig.skin if any(skin[name] != skins[0][name] for skin in skins)):
        values = " and ".join(dict.fromkeys(str(shown(skin[name])) for skin in skins))
        raise FileError(file, f"skin.{name}", f"parts of the file state {values}: all must be of one skin")
    document = {"schema": SCHEMA, "name": stem, "skin": skins[0], "recordings": recordings}
    return MappedFile({**document, "units_checked": rig.units_checked}, list(dict.fromkeys(warnings)), taken)


def has_channels(rig: RigDescription, contents: Contents) -> bool:
    """Whether a part of a file holds every channel that the rig names, or can derive."""
    try:
        return all(_with_channels(one, _with_derived(one, contents, ""), "") for one in rig.entries or (rig,))
    except FileError:
        return False


def _with_derived(rig: RigDescription, contents: Contents, file: str) -> Contents:
    """The contents with the channels that the rig joins or derives."""
    contents = with_joined(contents, rig.joined, file)
    return channel_arithmetic.with_derived(
        contents, rig.derived, lambda block: _stated(contents, block, block.name), file
    )


def _with_channels(rig: RigDescription, contents: Contents, file: str) -> list[Block]:
    """The blocks that hold every channel that the rig names."""
    blocks = [block for block in contents.blocks if not _lacking(rig, block)]
    if blocks:
        return blocks
    lacking = [_lacking(rig, block) for block in contents.blocks or (Block("", ()),)]
    missing = min(lacking, key=len)
    lacks = f"no part holds all channels that the rig description names: it lacks {', '.join(missing)}"
    raise FileError(file, "", f"{lacks}; it has {contents.described()}")


def _trimmed(block: Block, trim: Trim | None, file: str) -> Block:
    """The block cut to the used samples; a curve may end before the last of them."""
    if trim is None:
        return block
    start = (trim.first_sample or 1) - 1
    if _samples(block) <= start:
        reason = f"is {start + 1}; {block.name or 'the curve'} has {_samples(block)} samples"
        raise FileError(file, "trim.first_sample", reason)
    return block.at(slice(start, trim.last_sample), block.name)


def _used(trim: Trim, samples: Sequence[int]) -> str:
    """Which samples are used, in words, of curves with these numbers of samples."""
    last = trim.last_sample
    short = [count for count in samples if last is not None and count < last]
    if not short:
        return f"of each curve, {trim.words} are used"
    if len(samples) == 1:
        used = replace(trim, last_sample=short[0]).words
        return f"{used} are used: the curve ends there, before the last sample that was said, {last}"
    ends = f"{len(short)} of {len(samples)} curves end before that, the shortest at sample {min(short)}"
    return (
        f"of each curve, {trim.words} are used; {ends}, and of these all samples from {trim.first_sample or 1} on are"
    )


def _samples(block: Block) -> int:
    return max((len(channel.values) for channel in block.channels), default=0)


def _lacking(rig: RigDescription, block: Block) -> list[str]:
    """The channels and columns that the rig names and a block does not have."""
    missing = [name for name in _channel_names(rig) if not block.headed(name)]
    columns = dict.fromkeys(signal.channel for signal in rig.row_fields)
    return [*missing, *(name for name in columns if not (block.words(name) or block.headed(name)))]


def _channel_names(rig: RigDescription) -> Sequence[str]:
    """Each once, in the order of the description."""
    names = [signal.channel for mapping in rig.channels.values() for signal in mapping.signals]
    curves = rig.curves
    by = (curves.channel or curves.segments) if isinstance(curves, CurveChannel) else None
    return list(dict.fromkeys([*names, *([] if by is None else [by])]))


def _label(stem: str, part: str) -> str:
    """The file's name and the part's; the file's is cut where an id would be too long."""
    return f"{stem[: max(0, LONGEST_NAME - 1 - len(part))]} {part}".strip()


def _printable(name: str) -> str:
    return "".join(letter for letter in name if letter.isprintable())[:LONGEST_NAME].strip()


def _stated(contents: Contents, block: Block, block_name: str) -> dict[str, str | float]:
    """The properties of the file; those of the block `block_name` that this one is a part of without that prefix
    (`run.preload` is `preload`), and this block's name."""
    prefix = f"{block_name}."
    about_block = {
        name.removeprefix(prefix): value for name, value in contents.properties.items() if name.startswith(prefix)
    }
    return {BLOCK_NAME: block.name, **contents.properties, **about_block}
