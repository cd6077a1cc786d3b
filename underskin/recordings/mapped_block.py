"""The fields of one recording, out of the channels of one block, as a rig description has them."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from underskin.errors import FileError, Mention, Requirement
from underskin.recordings import tare
from underskin.recordings.channel_mapping import AUTOMATIC, ChannelMapping, SignalMapping
from underskin.recordings.channels import Block, Channel, Values
from underskin.recordings.curve_signs import falling
from underskin.recordings.readable_values import range_of, readable
from underskin.recordings.readers.derived_channels import FIELD
from underskin.recordings.readers.dimensions import exponents, ratio_of
from underskin.recordings.readers.unit_labels import contradicts, field_unit, meanings, unit
from underskin.recordings.readers.unit_words import DECIBEL
from underskin.recordings.rig_description import COMPLEX_FRF, MAGNITUDE, PHASE, RigDescription
from underskin.recordings.sampling import even_rate, mean_step
from underskin.recordings.shown_values import shown
from underskin.recordings.stated_values import Stated, factor, spring_constant
from underskin.units import LAB, Floats, readable_unit

_PERCENT = 100.0
_OF_UNIT = re.compile(r"unit|einheit|scale|skala|format|amplitude", re.IGNORECASE)
_SAME_RATE = 1e-3  # relative
_NO_DECIBELS = "decibels are a logarithm: state the ratio itself, 10^(dB/20) times its reference"
_LEAST_SAMPLES, _STILL = 16, 1e-9  # of a force that is measured, and of its largest value: less is rounding


class MappedBlock:
    """The fields of one recording, out of one block, what was `taken` for each, in words, and the `warnings` on them;
    `stated` is what the file says about itself."""

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
        values = self._with_parts(values)
        if any(np.iscomplexobj(column) for column in values.values()):
            only = Requirement("a channel of complex numbers can only be ", Mention(COMPLEX_FRF))
            raise self._error("", only)
        columns: dict[str, Any] = {field: np.asarray(column, dtype=float) for field, column in values.items()}
        columns = {field: self._tared(field, column) for field, column in columns.items()}
        columns = self._without_instrument(columns)
        self._say_ranges(columns)
        self._require_known_sign(columns)
        if self.rig.kind == "frf":
            return self._frf(columns)
        rate = self.block.sample_rate_hz
        if rate is not None and "time_s" not in columns:
            columns["time_s"] = np.arange(len(columns[next(iter(columns))])) / rate
        return columns

    def _with_parts(self, values: Mapping[str, Values]) -> dict[str, Values]:
        """The columns, real and imaginary part in the place of magnitude and phase."""
        rest = {field: column for field, column in values.items() if field not in (MAGNITUDE, PHASE)}
        if MAGNITUDE not in values:
            return rest
        self._refuse_stated_decibels()
        magnitude, phase = values[MAGNITUDE], values[PHASE]
        if (magnitude < 0).any():
            raise self._error("", Requirement(Mention(MAGNITUDE), f" is below 0, as no magnitude is: {_NO_DECIBELS}"))
        if len(magnitude) != len(phase):
            raise self._error("", Requirement(Mention(MAGNITUDE), " and ", Mention(PHASE), " differ in length"))
        frf = magnitude * np.exp(1j * np.radians(phase))
        return {**rest, "frf_re_pc_per_n": frf.real, "frf_im_pc_per_n": frf.imag}

    def _refuse_stated_decibels(self) -> None:
        """Refuses a magnitude where a line of the file, such as `Y-axis unit: dB`, says that its unit is a decibel."""
        for name, value in self.stated.items():
            known = unit(value) if isinstance(value, str) and _OF_UNIT.search(name) else None
            if known is not None and known.dimension == DECIBEL:
                raise self._error(f"property {name!r}", f"is {value!r}: {_NO_DECIBELS}")

    def spring(self) -> dict[str, float]:
        """The stiffness of the spring whose deflection was subtracted: a contact that sticks comes off by it."""
        force = self.rig.channels.get("force_n", ChannelMapping(""))
        displacement = self.rig.channels.get("displacement_mm", ChannelMapping(""))
        spring = force.spring_constant_n_per_m
        if self.rig.kind != "indentation" or displacement.deflection is None or spring is None:
            return {}
        return {"stage_stiffness_n_per_mm": 1e-3 * spring_constant(spring, self.stated, self.file)}

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
        """A channel's values in the unit of a field, and in words what was taken."""
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
        scale = self._degrees(label, place) if field == PHASE else self._scale(target, label, mapping, place)
        through = f" through {mapping.sensitivity:g} {mapping.sensitivity_unit}" if mapping.sensitivity else ""
        sign = self._automatic_sign(mapping) if mapping.sign == AUTOMATIC else int(mapping.sign or 1)
        turned = ", turned round" if sign == -1 else ""
        with np.errstate(all="ignore"):
            return channel.values * sign * scale, f"{channel.name!r} in {label}{through}{turned}"

    def _automatic_sign(self, mapping: SignalMapping) -> int:
        """-1 where a channel falls as the curve is pressed: told from the channels as they came, so that a travel less
        a deflection has both right."""
        travel = self.block.headed(self.rig.channels["displacement_mm"].channel)
        is_travel = mapping is self.rig.channels["displacement_mm"]
        force = self.block.headed((self.rig.channels["force_n"] if is_travel else mapping).channel)
        assert travel is not None
        assert force is not None
        falls = falling(force.values.real, travel.values.real, sphere=self.rig.kind == "indentation")
        if ("displacement_mm" if is_travel else "force_n") not in falls:
            return 1
        self.warnings.append(f"channel {mapping.channel!r} falls as it is pressed, and was turned round")
        return -1

    def _tared(self, field: str, column: Floats) -> Floats:
        """A column less its mean over the part of the curve that the rig description says."""
        percent = self.rig.channels[field].tare_percent if field in self.rig.channels else None
        if percent is None:
            return column
        tared = column[: max(1, round(percent / _PERCENT * len(column)))]
        zero = float(tared.mean())
        part = f"the first {percent:g} % of all samples"
        self.taken[field] += f", less {readable(field, zero)}, its mean over {part}"
        words = field.rpartition("_")[0]
        self.warnings.append(f"the {words} is 0 on average over {part} of each curve: it was tared so")
        rise = tare.rise(column, len(tared)) if field == "force_n" and self.rig.kind != "frf" else None
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
        """The rig's unit, else the file's label, which must not contradict it unless the rig says that it is wrong."""
        label, place = channel.label, f"channel {channel.name!r}"
        if mapping.labelled is not None:
            if mapping.labelled != label:
                raise self._error(place, f"is labelled {label!r}, not {mapping.labelled!r} as the rig says")
            self.warnings.append(f"{place} is labelled {label!r}; the rig description says {mapping.unit!r}")
            return mapping.unit or ""
        if mapping.unit and contradicts(label, mapping.unit, channel.name, dimension):
            reason = f"is labelled {label!r}, but the rig description says {mapping.unit!r}"
            raise self._error(
                place, f"{reason}: correct the one that is wrong; if it is the label, add labelled: {label}"
            )
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
        known = unit(label)
        if known is None or known.dimension != "angle":
            raise self._error(place, f"its unit {label!r} is none of an angle: a phase is in deg or rad")
        return math.degrees(known.to_si)

    def _scale(self, field: str, label: str, mapping: SignalMapping, place: str) -> float:
        """From the channel's unit to the field's, through the sensitivity where there is one."""
        known = unit(label)
        if known is not None and known.dimension == DECIBEL:
            raise self._error(place, _NO_DECIBELS)
        if mapping.sensitivity is None or mapping.sensitivity_unit is None:
            return factor(label, field, self.file, place, "; a signal in volts needs its sensitivity")
        above, _, below = mapping.sensitivity_unit.rpartition("/")
        given = unit(label)
        for signal, quantity, sensitivity in (
            (above, below, 1 / mapping.sensitivity),
            (below, above, mapping.sensitivity),  # nm/V, as those of cantilevers are stated
        ):
            divided, measured = unit(signal), unit(quantity)
            if given is None or divided is None:
                continue
            if given.dimension == divided.dimension:
                return given.to_si / divided.to_si * sensitivity * factor(quantity, field, self.file, place)
            if measured is not None and ratio_of(label, signal, quantity) == exponents(LAB[field].unit):  # V/N by mV/pC
                return given.to_si / divided.to_si * measured.to_si * sensitivity / LAB[field].to_si
        raise self._error(place, f"its unit {label!r} is not of the sensitivity's {mapping.sensitivity_unit!r}")

    def _without_instrument(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """The columns, their displacement without the instrument's own give, force over its stiffness."""
        stiffness = self.rig.channels.get("displacement_mm", ChannelMapping("")).stiffness_n_per_mm
        if stiffness is None:
            return dict(columns)
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

    def _require_known_sign(self, columns: Mapping[str, Any]) -> None:
        """Force must rise with displacement, unless the rig says a sign for both."""
        signs = [self.rig.channels[name].sign for name in ("displacement_mm", "force_n") if name in self.rig.channels]
        if len(signs) < 2 or None not in signs or len(columns["displacement_mm"]) != len(columns["force_n"]):
            return
        with np.errstate(all="ignore"):
            together = np.mean(_centred(columns["displacement_mm"]) * _centred(columns["force_n"]))
        if together < 0:
            reason = "force falls as the displacement grows, and compression is positive here"
            signs_said = Mention("sign", "sign: 1, -1 or auto")
            how = (signs_said, " for ", Mention("displacement_mm"), " and ", Mention("force_n"))
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
        """In words, each channel of a formula that others use too, and these."""
        rest = {name: formula for name, formula in self.rig.derived.items() if name != derived}
        told = ""
        for name in filter(self.block.headed, self.rig.derived[derived].names):
            others = [one for one, formula in rest.items() if name in formula.names]
            if others:
                of = " and of ".join(others)
                told += f"; if it is {name!r} that is reversed, turn it in the formula of {of} too"
        return told

    def _frf(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Without the line at 0 Hz; time series with their sample rate."""
        time = given.get("time_s")
        columns = {name: column for name, column in given.items() if name != "time_s"}
        frequency = columns.get("frequency_hz")
        if frequency is not None and len(frequency) > 1 and frequency[0] == 0:
            self.warnings.append("the line at 0 Hz is left out")
            return {name: column[1:] for name, column in columns.items()}
        rate = self.block.sample_rate_hz if time is None else None
        stated = self.rig.recording.get("sample_rate_hz")
        if "force_n" in columns and stated is None:
            rate = rate if time is None else self._rate(time)
            columns |= {} if rate is None else {"sample_rate_hz": rate}
        elif (
            rate is not None and isinstance(stated, int | float) and not math.isclose(rate, stated, rel_tol=_SAME_RATE)
        ):
            self.warnings.append(
                f"the file states {rate:g} samples a second; the rig description {stated:g}, which counts"
            )
        return {**columns, **self._measured_force(columns)}

    def _measured_force(self, columns: Mapping[str, Any]) -> dict[str, float]:
        """The dynamic force of a time series whose rig description tells none: the amplitude of the sine that shakes as
        strongly as the recorded force does about its drift."""
        force = columns.get("force_n", np.zeros(0))
        if "dynamic_force_n" in self.rig.recording or len(force) < _LEAST_SAMPLES or not np.isfinite(force).all():
            return {}
        place = np.linspace(-1.0, 1.0, len(force))
        shaken = force - force.mean() - place * (place @ force) / (place @ place)
        amplitude = float(np.sqrt(2) * shaken.std())
        if amplitude <= _STILL * float(np.abs(force).max()):
            return {}
        self.taken["dynamic_force_n"] = f"measured: √2 times the rms of the force about its drift, {amplitude:.4g} N"
        return {"dynamic_force_n": amplitude}

    def _rate(self, time: Floats) -> float:
        rate = even_rate(time)
        if rate is None:
            raise self._error("time_s", f"samples are not evenly spaced (step {shown(mean_step(time))} s)")
        return rate

    def _error(self, place: str, reason: str | Requirement) -> FileError:
        return FileError(self.file, place, reason)


def _centred(column: Floats) -> Floats:
    return column - column.mean()
