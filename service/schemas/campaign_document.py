"""`campaign/1` as JSON Schema, derived from the models and checks that read it (`underskin.recordings`).

The schema says what one field alone may be. What relates fields to one another, such as columns of equal length or a
sensor that the skin must have, only the reader can say; each field is described in words.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING
from typing import Any, get_args

from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings import validation as field
from underskin.recordings.campaign import (
    LINES,
    SCHEMA,
    TIME_SERIES,
    CompressionRecording,
    FrfRecording,
    IndentationRecording,
    Sensor,
    SkinDescription,
    Tolerances,
    built_in_axes,
    further,
    read_estimator,
    read_sensors,
    read_tolerances,
)
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.validation import LONGEST_NAME
from underskin.units import LAB

Schema = dict[str, Any]

_REF = "#/components/schemas/"
_NULL: Schema = {"type": "null"}
_NAME: Schema = {"type": "string", "minLength": 1, "maxLength": LONGEST_NAME, "pattern": r"\S"}
_LOWEST_HZ, _HIGHEST_HZ = field.FREQUENCIES_HZ


def _column(**of_entries: Any) -> Schema:
    return {"type": "array", "items": {"type": "number", **of_entries}, "minItems": 1}


# Of each check what JSON Schema can say of it; `declared` depends on the field.
_OF_CHECK: Mapping[Callable[..., Any], Schema] = {
    field.name: _NAME,
    field.number: {"type": "number"},
    field.positive: {"type": "number", "exclusiveMinimum": 0},
    field.not_negative: {"type": "number", "minimum": 0},
    field.poisson_ratio: {"type": "number", "minimum": 0, "maximum": INCOMPRESSIBLE},
    field.flag: {"type": "boolean"},
    field.count: {"type": "integer", "minimum": 0, "maximum": field.LARGEST_COUNT},
    field.time_of_day: {**_NAME, "pattern": r"^\d{4}", "examples": ["2017-05-03T09:00:00Z"]},
    field.position: {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
    field.series: _column(),
    field.frequencies: _column(minimum=_LOWEST_HZ, maximum=_HIGHEST_HZ),
    field.not_falling: _column(),
    field.coherence: _column(minimum=0, maximum=1 + field.COHERENCE_ROUNDING),
    further: {
        "type": "object",
        "maxProperties": field.MOST_CONDITIONS,
        "propertyNames": {"pattern": f"^{field.CONDITION.pattern}$", "not": {"enum": sorted(built_in_axes())}},
        "additionalProperties": {"anyOf": [{"type": "number"}, _NAME, _NULL]},
    },
    read_estimator: {"type": "string", "enum": list(get_args(Estimator))},
    read_sensors: {"type": "array", "items": {"$ref": f"{_REF}Sensor"}},
    read_tolerances: {"$ref": f"{_REF}Tolerances"},
}

_WORDS: Mapping[str, str] = {
    "id": "Its name, one of its own.",
    "x_mm": "Its centre along the skin's length [mm]; may be left out of a skin's only sensor.",
    "y_mm": "Its centre along the skin's width [mm]; as `x_mm`.",
    "poisson_ratio": "Poisson's ratio ν of the elastomer, 0 to 0.5 [-].",
    "thickness_mm": "Thickness h of the layer over the sensors [mm]; required by recordings of kind `frf`.",
    "youngs_modulus_mpa": "Young's modulus E of the layer [MPa]; required by recordings of kind `frf`.",
    "sensor_radius_mm": "Radius rT of a sensor [mm]; required by recordings of kind `frf`.",
    "d33_pc_per_n": "Piezoelectric coefficient d33 as declared [pC/N]; null where it is not known.",
    "width_mm": "Extent of the skin along y [mm].",
    "length_mm": "Extent of the skin along x [mm].",
    "tolerances": "What the declared thickness, sensor radius and modulus may be off by; part of absolute intervals.",
    "thickness_percent": "Standard deviation of the thickness [%]; 2 where it is left out.",
    "sensor_radius_percent": "Standard deviation of the sensor radius [%]; 2 where it is left out.",
    "youngs_modulus_percent": "Standard deviation of Young's modulus [%]; 10 where it is left out.",
    "sensors": "The sensors of the array.",
    "kind": "What was recorded.",
    "sensor": "Id of the sensor that is pressed, one of the skin's.",
    "indenter_radius_mm": "Radius R of the sphere [mm].",
    "preload_n": "Static force [N].",
    "dynamic_force_n": "Peak amplitude of the oscillating force [N].",
    "recorded_at": "When it was recorded, ISO 8601; without a zone in the time zone of the service.",
    "load_cycles": "Load cycles that the skin had seen [-].",
    "dwell_s": "How long the preload had been held [s].",
    "position_mm": "Commanded place of the sphere, x and y in the sensors' frame [mm]; by default the sensor's centre.",
    "conditions": "What else the lab noted, numbers or short words by names of its own, each an axis of diagnoses.",
    "frequency_hz": "Lines of the FRF, increasing [Hz].",
    "frf_re_pc_per_n": "Real part of the FRF, charge over force, one entry a line, positive in compression for a "
    "positive d33 [pC/N].",
    "frf_im_pc_per_n": "Imaginary part of the FRF by e^(+iωt), one entry a line [pC/N].",
    "coherence": "Coherence γ² of each line, 0 to 1 [-].",
    "sample_rate_hz": "Sampling rate of the time series [Hz].",
    "estimator": "How the FRF is estimated: `H1` is unbiased by noise in the charge, `H2` by noise in the force, `Hv` "
    "by equal relative noise in both; `H1` where it is left out.",
    "force_n": "Force, one entry a sample, compression positive [N].",
    "charge_pc": "Charge, one entry a sample [pC].",
    "displacement_mm": "Displacement, one entry a sample, loading and unloading in order, compression positive [mm].",
    "time_s": "Time of each sample, not falling [s].",
    "stage_stiffness_n_per_mm": "Stiffness of a stage or cantilever whose deflection has been subtracted [N/mm].",
    "signs_checked": "True: force and displacement are compression positive as they stand, and are never turned round.",
    "sample_height_mm": "Height of the cylinder [mm].",
    "sample_diameter_mm": "Diameter of the cylinder [mm].",
}


def campaign_schemas() -> dict[str, Schema]:
    """The schemas of a campaign and its parts by name, which refer to one another as components of OpenAPI."""
    parts = {
        "Sensor": _object(Sensor, "A sensor of the array."),
        "Tolerances": _object(Tolerances, "What declared values of the skin may be off by."),
        "Skin": _object(SkinDescription, "The skin as the lab declares it."),
        "FrfRecording": _frf(LINES, (*TIME_SERIES, "estimator"), "Charge over force, line by line."),
        "FrfTimeSeries": _frf(
            TIME_SERIES, (*LINES, "coherence"), "Force and charge over time, from which charge over force is estimated."
        ),
        "IndentationRecording": _object(
            IndentationRecording, "The force on a sphere that is pressed in.", "indentation"
        ),
        "CompressionRecording": _object(
            CompressionRecording, "The force on a cylinder between platens.", "compression"
        ),
    }
    recordings = [{"$ref": f"{_REF}{name}"} for name in parts if name not in ("Sensor", "Tolerances", "Skin")]
    campaign = {
        "title": "Campaign",
        "type": "object",
        "description": "Recordings of one skin (`campaign/1`), in the lab's units. All columns of a recording have "
        "the same length; an optional field may be null. A recording that cannot be used is refused by itself.",
        "properties": {
            "schema": {"type": "string", "const": SCHEMA, "description": "The format."},
            "name": {**_NAME, "description": "What the lab calls it."},
            "skin": {"$ref": f"{_REF}Skin", "description": "The skin as the lab declares it."},
            "recordings": {
                "type": "array",
                "items": {"anyOf": recordings},
                "minItems": 1,
                "description": "What was recorded, each with its conditions.",
            },
            "units_checked": {
                "type": "boolean",
                "default": False,
                "description": "Accept magnitudes that look like a slip of units (2.5 m, 16 Pa).",
            },
        },
        "required": ["schema", "name", "skin", "recordings"],
        "additionalProperties": False,
    }
    return {"Campaign": campaign, **{name: {"title": name, **schema} for name, schema in parts.items()}}


def _frf(needed: tuple[str, ...], absent: tuple[str, ...], words: str) -> Schema:
    """Of the two forms of a recording of kind `frf` the one with these fields and without those."""
    schema = _object(FrfRecording, words, "frf")
    for name in needed:
        schema["properties"][name] = _field(FrfRecording, name)
    for name in absent:
        schema["properties"][name] = {**_NULL, "description": "Not with these fields."}
    schema["required"] = [*schema["required"], *needed]
    return schema


def _object(model: type, words: str, kind: str | None = None) -> Schema:
    properties: dict[str, Schema] = {}
    required = []
    for name, (_, default) in field.checks_of(model).items():
        schema_of_field = _field(model, name)
        if name == "kind":
            allowed = ["frf", None] if kind == "frf" else [kind]
            schema_of_field = {"enum": allowed, "description": schema_of_field["description"]}
        elif default is not MISSING:
            schema_of_field = {
                "anyOf": [{key: value for key, value in schema_of_field.items() if key != "description"}, _NULL]
            } | {"description": schema_of_field["description"]}
        if default is MISSING or (name == "kind" and kind != "frf"):
            required.append(name)
        properties[name] = schema_of_field
    return {
        "type": "object",
        "description": words,
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _field(model: type, name: str) -> Schema:
    """What a field may be where it is given."""
    check, _ = field.checks_of(model)[name]
    words = _WORDS[name]
    if check is field.declared:
        return {**_declared(name), "description": words + _likely(name)}
    return {**_OF_CHECK[check], "description": words}


def _declared(name: str) -> Schema:
    return {"type": "number", "not": {"const": 0}} if LAB[name].signed else {"type": "number", "exclusiveMinimum": 0}


def _likely(name: str) -> str:
    likely = LAB[name].likely
    if likely is None:
        return ""
    return f" Unless `units_checked`, {likely[0]:g} to {likely[1]:g}{' in magnitude' if LAB[name].signed else ''}."
