"""From an instrument's channels to a campaign, by a rig description."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from underskin.errors import FileError, Mention, Requirement
from underskin.recordings.campaign import SCHEMA
from underskin.recordings.channels import Block, Channel, Contents, Values
from underskin.recordings.readers import text
from underskin.recordings.readers.unit_labels import field_unit, labelled_unit, unit
from underskin.recordings.rig_description import BLOCK_NAME, COMPLEX_FRF, ChannelMapping, Property, RigDescription
from underskin.recordings.shown_values import LONGEST_NAME, shown
from underskin.units import LAB, Floats

_TEXTS = ("id", "sensor", "recorded_at")
_SAMPLING_JITTER = 0.01  # of a sample: more is not evenly sampled


def apply(rig: RigDescription, contents: Contents, file: str) -> tuple[dict[str, Any], list[str]]:
    """The campaign document, one recording for each block that holds the rig's channels, and warnings.

    Raises FileError that names the channel or property that is missing or whose unit does not fit.
    """
    mapped = [entry.channel for entry in rig.channels.values()]
    blocks = [block for block in contents.blocks if all(block.channel(name) for name in mapped)]
    if not blocks:
        nearest = max(
            contents.blocks, key=lambda block: sum(map(bool, map(block.channel, mapped))), default=Block("", ())
        )
        missing = ", ".join(name for name in mapped if not nearest.channel(name))
        raise FileError(
            file, "", f"no part holds all of the rig's channels: {missing} is missing; it has {contents.described()}"
        )
    warnings = list(contents.warnings)
    if len(blocks) < len(contents.blocks):
        warnings.append(f"{len(contents.blocks) - len(blocks)} parts without the rig's channels are left out")
    stem = _printable(PurePath(file).stem)
    recordings = []
    for number, block in enumerate(blocks, start=1):
        label = _label(stem, _printable(block.name) or str(number)) if len(blocks) > 1 else stem
        stated = _stated(contents, block)
        common = {name: _common(name, value, stated, file) for name, value in rig.recording.items()}
        began = {} if block.recorded_at is None else {"recorded_at": block.recorded_at}
        mapped_block = _MappedBlock(rig, block, file)
        recordings.append({"id": label, "kind": rig.kind, **began, **common, **mapped_block.fields()})
        warnings += mapped_block.warnings
    document = {"schema": SCHEMA, "name": stem, "skin": rig.skin, "recordings": recordings}
    return {**document, "units_checked": rig.units_checked}, list(dict.fromkeys(warnings))


def _label(stem: str, part: str) -> str:
    """The file's name and the part's; the file's is cut where both make more than an id may have."""
    return f"{stem[: max(0, LONGEST_NAME - 1 - len(part))]} {part}".strip()


def _printable(name: str) -> str:
    return "".join(letter for letter in name if letter.isprintable())[:LONGEST_NAME].strip()


def _stated(contents: Contents, block: Block) -> dict[str, str | float]:
    """What the file says about itself; of the block its own properties (`run.preload` is `preload`) and its name."""
    own = f"{block.name}."
    about_block = {name.removeprefix(own): value for name, value in contents.properties.items() if name.startswith(own)}
    return {BLOCK_NAME: block.name, **contents.properties, **about_block}


def _common(name: str, value: Any | Property, stated: Mapping[str, str | float], file: str) -> Any:
    """A field that the rig says, or that the file says under the rig's name for it, in the field's unit."""
    if not isinstance(value, Property):
        return value
    if value.property not in stated:
        known = ", ".join(list(stated)[:20])
        raise FileError(file, f"property {value.property!r}", f"is not in the file, which states {known}")
    given = stated[value.property]
    number = text.number(given, ".") if isinstance(given, str) else given
    if number is None or name in _TEXTS:
        return given
    if name not in LAB:
        return number
    label = labelled_unit(value.property)
    return number * _factor(label, name, file, f"property {value.property!r}") if label else number


def _factor(label: str, field: str, file: str, place: str, hint: str = "") -> float:
    """From a unit to the field's; `hint` goes into the error."""
    known, wanted = unit(label), field_unit(field)
    if known is None or known.dimension != wanted.dimension:
        what = "is not known here" if known is None else f"is one of {known.dimension}"
        needs = f" needs one of {wanted.dimension}, such as {LAB[field].unit}{hint}"
        raise FileError(file, place, Requirement(f"its unit {label!r} {what}; ", Mention(field), needs))
    return known.to_si / LAB[field].to_si


class _MappedBlock:
    """The fields of one recording, out of one block, and the `warnings` on them."""

    def __init__(self, rig: RigDescription, block: Block, file: str) -> None:
        self.rig = rig
        self.block = block
        self.file = file
        self.warnings: list[str] = []

    def fields(self) -> dict[str, Any]:
        values = {field: self._values(field, mapping) for field, mapping in self.rig.channels.items()}
        if COMPLEX_FRF in values:
            frf = values.pop(COMPLEX_FRF)
            values |= {"frf_re_pc_per_n": frf.real, "frf_im_pc_per_n": frf.imag}
        if any(np.iscomplexobj(column) for column in values.values()):
            only = Requirement("a channel of complex numbers can only be ", Mention(COMPLEX_FRF))
            raise self._error("", only)
        columns: dict[str, Any] = {field: np.asarray(column, dtype=float) for field, column in values.items()}
        columns = self._without_instrument(columns)
        self._require_known_sign(columns)
        if self.rig.kind == "frf":
            return self._frf(columns)
        rate = self.block.sample_rate_hz
        if rate is not None and "time_s" not in columns:
            columns["time_s"] = np.arange(len(columns[next(iter(columns))])) / rate
        return columns

    def _values(self, field: str, mapping: ChannelMapping) -> Values:
        channel = self.block.channel(mapping.channel)
        assert channel is not None
        place = f"channel {channel.name!r}"
        if len(channel.values) == 0:
            raise self._error(place, "holds no values")
        if field == "coherence":
            return channel.values
        target = "frf_re_pc_per_n" if field == COMPLEX_FRF else field
        label = self._true_unit(channel, mapping, place)
        with np.errstate(all="ignore"):
            return channel.values * (mapping.sign or 1) * self._scale(target, label, mapping, place)

    def _true_unit(self, channel: Channel, mapping: ChannelMapping, place: str) -> str:
        """The rig's unit, unless the file's label contradicts it unacknowledged; the label where the rig says none."""
        if mapping.labelled is not None:
            if mapping.labelled != channel.unit:
                raise self._error(place, f"is labelled {channel.unit!r}, not {mapping.labelled!r} as the rig says")
            self.warnings.append(f"{place} is labelled {channel.unit!r}; the rig description says {mapping.unit!r}")
            return mapping.unit or ""
        if mapping.unit and channel.unit and unit(mapping.unit) != unit(channel.unit):
            reason = f"is labelled {channel.unit!r}, but the rig description says {mapping.unit!r}"
            raise self._error(place, f"{reason}: if the label is wrong, add labelled: {channel.unit}")
        label = mapping.unit or channel.unit
        if not label:
            raise self._error(
                place, "has no unit in the file: say it, as `unit` of the rig description or as its true unit"
            )
        return label

    def _scale(self, field: str, label: str, mapping: ChannelMapping, place: str) -> float:
        """From the channel's unit to the field's, through the sensitivity where there is one."""
        if mapping.sensitivity is None or mapping.sensitivity_unit is None:
            return _factor(label, field, self.file, place, "; a signal in volts needs its sensitivity")
        signal, _, quantity = mapping.sensitivity_unit.rpartition("/")
        given, divided = unit(label), unit(signal)
        if given is None or divided is None or given.dimension != divided.dimension:
            raise self._error(place, f"its unit {label!r} is not of the sensitivity's {mapping.sensitivity_unit!r}")
        return given.to_si / divided.to_si / mapping.sensitivity * _factor(quantity, field, self.file, place)

    def _without_instrument(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """The columns, their displacement without the instrument's own give, force over its stiffness."""
        stiffness = self.rig.channels.get("displacement_mm", ChannelMapping("")).stiffness_n_per_mm
        if stiffness is None:
            return dict(columns)
        if len(columns["displacement_mm"]) != len(columns["force_n"]):
            both = (Mention("displacement_mm"), " and ", Mention("force_n"))
            reason = Requirement(*both, " differ in length: no stiffness can be applied")
            raise self._error("", reason)
        return {**columns, "displacement_mm": columns["displacement_mm"] - columns["force_n"] / stiffness}

    def _require_known_sign(self, columns: Mapping[str, Any]) -> None:
        """Force must rise with displacement, unless the rig says a sign for both."""
        signs = [self.rig.channels[name].sign for name in ("displacement_mm", "force_n") if name in self.rig.channels]
        if len(signs) < 2 or None not in signs or len(columns["displacement_mm"]) != len(columns["force_n"]):
            return
        with np.errstate(all="ignore"):
            together = np.mean(_centred(columns["displacement_mm"]) * _centred(columns["force_n"]))
        if together < 0:
            reason = "force falls as the displacement grows, and compression is positive here"
            how = (Mention("displacement_mm"), " and ", Mention("force_n"))
            raise self._error("channels", Requirement(f"{reason}: say sign: 1 or sign: -1 for ", *how))

    def _frf(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Without the line at 0 Hz; time series with their sample rate."""
        time = given.get("time_s")
        columns = {name: column for name, column in given.items() if name != "time_s"}
        frequency = columns.get("frequency_hz")
        if frequency is not None and len(frequency) > 1 and frequency[0] == 0:
            self.warnings.append("the line at 0 Hz is left out")
            return {name: column[1:] for name, column in columns.items()}
        if "force_n" in columns and "sample_rate_hz" not in self.rig.recording:
            rate = self.block.sample_rate_hz if time is None else self._rate(time)
            return columns if rate is None else {**columns, "sample_rate_hz": rate}
        return columns

    def _rate(self, time: Floats) -> float:
        with np.errstate(all="ignore"):
            step = (time[-1] - time[0]) / max(len(time) - 1, 1)
            jitter = np.abs(time - (time[0] + step * np.arange(len(time)))).max()
        if not (step > 0 and jitter <= _SAMPLING_JITTER * step):
            raise self._error("time_s", f"samples are not evenly spaced (step {shown(step)} s)")
        return float(1 / step)

    def _error(self, place: str, reason: str | Requirement) -> FileError:
        return FileError(self.file, place, reason)


def _centred(column: Floats) -> Floats:
    return column - column.mean()
