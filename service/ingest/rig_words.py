"""A rig description in the words of a lab: its fields with their units, and sentences that are stored with the
campaigns that were read with it."""

from collections.abc import Mapping
from typing import Any

from underskin.recordings.rig_description import AUTOMATIC, ChannelMapping, Property, RigDescription, SignalMapping

KINDS = {
    "frf": "FRF: charge against a shaken force",
    "indentation": "indentation: force against depth",
    "compression": "compression or tension of a sample of the elastomer",
}

# Field, words, unit, and the kinds that have it.
SKIN = (
    ("thickness_mm", "thickness h", "mm"),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa"),
    ("poisson_ratio", "Poisson's ratio ν", ""),
    ("sensor_radius_mm", "sensor radius rT", "mm"),
)
RECORDING = (
    ("sensor", "sensor that was pressed", "", ("frf", "indentation")),
    ("indenter_radius_mm", "sphere radius R", "mm", ("frf", "indentation")),
    ("preload_n", "preload F", "N", ("frf",)),
    ("dynamic_force_n", "dynamic force, peak", "N", ("frf",)),
    ("sample_rate_hz", "sample rate, if the file does not say", "Hz", ("frf",)),
    ("stage_stiffness_n_per_mm", "spring's stiffness, if a formula subtracts it", "N/mm", ("indentation",)),
    ("sample_height_mm", "sample's height", "mm", ("compression",)),
    ("sample_diameter_mm", "sample's diameter", "mm", ("compression",)),
    ("recorded_at", "date and time of recording", "", ("frf", "indentation", "compression")),
)
CHANNELS = {
    "force_n": "force",
    "charge_pc": "charge",
    "displacement_mm": "displacement",
    "time_s": "time",
    "frequency_hz": "frequency",
    "frf_re_pc_per_n": "FRF, real part",
    "frf_im_pc_per_n": "FRF, imaginary part",
    "frf_pc_per_n": "FRF, complex numbers",
    "frf_magnitude_pc_per_n": "FRF, magnitude",
    "frf_phase_deg": "FRF, phase",
    "coherence": "coherence γ²",
}  # possible roles of a channel, for either kind
_SIGNS = {-1: "turned round", AUTOMATIC: "turned round where it falls as it is pressed"}
_CURVES = {"file": "a curve is the whole file", "groups": "a curve is each group of rows"}


def rig_sentences(rig: RigDescription) -> list[str]:
    """A sentence for each channel, one for the values stated for the recordings, and one for the definition of a curve,
    if stated. Formulas, tare and trim are in the reader's own notes."""
    channels = [f"{CHANNELS[field]}: {_channel(rig, mapping)}" for field, mapping in rig.channels.items()]
    values = _values(rig.recording)
    recordings = [f"said of its recordings: {'; '.join(values)}"] if values else []
    checked = ["unusual magnitudes were said to be right"] if rig.units_checked else []
    return [*_instrument(rig.document), *channels, *recordings, *_curve(rig), *checked]


def template_sentence(fields: Mapping[str, Any]) -> str:
    """`said of this file alone: sensor that was pressed s0; preload F 1 N`."""
    return f"said of this file alone: {'; '.join(_values(fields))}"


def typed_of(rig: RigDescription) -> list[str]:
    """The values typed for all recordings, as opposed to values read from each file."""
    read = (Property, SignalMapping)
    return _values({field: value for field, value in rig.recording.items() if not isinstance(value, read)})


def _values(recording: Mapping[str, Any]) -> list[str]:
    words = {field: (words.partition(", if ")[0], unit) for field, words, unit, _ in RECORDING}
    return [_value(*words.get(field, (field, "")), value) for field, value in recording.items()]


def _instrument(document: Mapping[str, Any]) -> list[str]:
    return [f"instrument: {document['name']}"] if document.get("name") else []


def _channel(rig: RigDescription, mapping: ChannelMapping) -> str:
    """`'Load cell', in V, through 2.25 V/N, turned round`."""
    how = _signal(rig, mapping)
    constant = mapping.spring_constant_n_per_m
    if constant is not None:
        how += f", a deflection, times {_of_file(constant) if isinstance(constant, Property) else f'{constant:g} N/m'}"
    if mapping.deflection is not None:
        how += f", less the deflection {_signal(rig, mapping.deflection)}"
    if mapping.stiffness_n_per_mm is not None:
        stiffness = mapping.stiffness_n_per_mm
        how += (
            f", less the force over {_of_file(stiffness) if isinstance(stiffness, Property) else f'{stiffness:g} N/mm'}"
        )
    return how


def _signal(rig: RigDescription, mapping: SignalMapping) -> str:
    formula = rig.derived.get(mapping.channel)
    parts = [f"{mapping.channel!r}{f' = {formula.text}' if formula is not None else ''}"]
    if formula is None or mapping.unit is not None:
        parts.append(f"in {mapping.unit}" if mapping.unit is not None else "in the unit of its label")
    if mapping.labelled is not None:
        parts.append(f"labelled {mapping.labelled!r}, which is wrong")
    if mapping.sensitivity is not None:
        parts.append(f"through {mapping.sensitivity:g} {mapping.sensitivity_unit}")
    if mapping.sign in _SIGNS:
        parts.append(_SIGNS[mapping.sign])
    return ", ".join(parts)


def _value(words: str, unit: str, value: Any) -> str:
    if isinstance(value, Property):
        return f"{words} {_of_file(value)}"
    if isinstance(value, SignalMapping):
        return f"{words} from the column {value.channel!r}"
    return f"{words} {value:g} {unit}".rstrip() if isinstance(value, float | int) else f"{words} {value}"


def _of_file(value: Property) -> str:
    return f"from {value.property!r} of the file"


def _curve(rig: RigDescription) -> list[str]:
    if rig.curves is None or isinstance(rig.curves, str):
        return [_CURVES[rig.curves]] if rig.curves is not None else []
    if rig.curves.channel is not None:
        return [f"a curve is each run of rows with one value in {rig.curves.channel!r}"]
    return [f"a curve ends where {rig.curves.segments!r} falls"]
