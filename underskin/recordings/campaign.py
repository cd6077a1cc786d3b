"""The campaign (`campaign/1`): recordings of one skin, each its conditions and what was measured, in the lab's units.

Fields are named as in the document and keep its units; a field that a document leaves out is None. Reading a document
keeps the good recordings and says of each of the others what is wrong; writing one gives the canonical document.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from underskin import errors
from underskin.errors import ErrorCode, InvalidInput
from underskin.recordings import validation as field
from underskin.recordings.conditions import (
    CompressionConditions,
    Conditions,
    FrfConditions,
    IndentationConditions,
    SkinDescription,
    Tolerances,
)
from underskin.recordings.frf.estimators import Estimator, checked_estimator
from underskin.recordings.physical_limits import refusals
from underskin.recordings.shown_values import shown
from underskin.units import Complexes, Floats

SCHEMA = "campaign/1"


def read_estimator(name: str, value: Any, units_checked: bool) -> Estimator:  # noqa: ARG001
    """How an FRF is estimated from a time series."""
    return checked_estimator(name, shown(value))


@dataclass(frozen=True, eq=False)
class FrfRecording(FrfConditions):
    """Charge over force under these conditions.

    Either the FRF (`frequency_hz`, real and imaginary part, e^(+iωt); γ² in `coherence`) or the time series
    (`sample_rate_hz`, `force_n`, `charge_pc`) that it is estimated from, by `estimator` (H1 where it is None).
    """

    frf_re_pc_per_n: field.Series | None = None
    frf_im_pc_per_n: field.Series | None = None
    coherence: field.Coherence | None = None
    sample_rate_hz: field.Positive | None = None
    force_n: field.Series | None = None
    charge_pc: field.Series | None = None
    estimator: Annotated[Estimator, read_estimator] | None = None

    @classmethod
    def of_lines(
        cls, conditions: FrfConditions, frequency: Floats, values: Complexes, coherence: Floats | None = None
    ) -> Self:
        """The recording of an FRF `values` [C/N] at lines `frequency` [Hz], in other conditions as these."""
        known = vars(conditions.without_measurements(frequency_hz=frequency))
        real, imaginary = 1e12 * values.real, 1e12 * values.imag
        return cls(**known, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary, coherence=coherence)


@dataclass(frozen=True, eq=False)
class IndentationRecording(IndentationConditions):
    """The force on a sphere that is pressed in and drawn back; compression positive."""

    force_n: field.Series


@dataclass(frozen=True, eq=False)
class CompressionRecording(CompressionConditions):
    """The force on a cylinder between platens; compression positive, tension negative."""

    force_n: field.Series


CurveRecording = IndentationRecording | CompressionRecording
Recording = FrfRecording | CurveRecording
KINDS: dict[str, type[Recording]] = {
    "frf": FrfRecording,
    "indentation": IndentationRecording,
    "compression": CompressionRecording,
}
COLUMNS = (
    "frequency_hz",
    "frf_re_pc_per_n",
    "frf_im_pc_per_n",
    "coherence",
    "force_n",
    "charge_pc",
    "displacement_mm",
    "time_s",
)


@dataclass(frozen=True, eq=False)
class Campaign(Conditions):
    """Recordings of one skin; `units_checked` accepts magnitudes that look like a slip of units."""

    recordings: tuple[Recording, ...]
    units_checked: bool = False


@dataclass(frozen=True)
class RecordingProblem:
    """Why a recording was refused: its id (or its place, `recordings[3]`), the field, its value, what is allowed."""

    recording: str
    field: str
    value: Any
    allowed: str
    code: ErrorCode = ErrorCode.INVALID_VALUE

    def as_error(self, field: str) -> InvalidInput:
        """The problem as an error of a field."""
        return InvalidInput(field, self.value, self.allowed, code=self.code)


def samples_of(curve: CurveRecording, rows: NDArray[Any]) -> CurveRecording:
    """A curve with only some of its samples."""
    time = None if curve.time_s is None else curve.time_s[rows]
    return replace(curve, displacement_mm=curve.displacement_mm[rows], force_n=curve.force_n[rows], time_s=time)


def frf_recordings(campaign: Campaign) -> list[FrfRecording]:
    """The campaign's FRF recordings, in order; raises InvalidInput where there is none."""
    recordings = [entry for entry in campaign.recordings if isinstance(entry, FrfRecording)]
    if not recordings:
        raise errors.too_few("recordings", "none of kind frf", "must hold at least one")
    return recordings


def from_dict(document: Any) -> tuple[Campaign, list[RecordingProblem]]:
    """The campaign of a document, with its good recordings, and what is wrong with the others.

    Raises InvalidInput where the campaign itself or its skin cannot be used.
    """
    fields_known = ("schema", "name", "skin", "recordings", "units_checked")
    document = field.of_schema("campaign", document, SCHEMA, fields_known)
    units_checked = field.flag("units_checked", document.get("units_checked", False), False)
    name = field.name("name", document.get("name"), units_checked)
    skin = field.build(SkinDescription, "skin", document.get("skin"), units_checked)
    for refusal in refusals(skin):
        raise refusal.at(f"skin.{refusal.field}")
    entries = document.get("recordings")
    if not isinstance(entries, list) or not entries:
        raise errors.wrong_type("recordings", shown(entries), "must be a list of at least one recording")
    good: dict[str, Recording] = {}
    problems: list[RecordingProblem] = []
    for index, entry in enumerate(entries):
        recording, refused = _recording(entry, skin, units_checked)
        if recording is not None and recording.id in good:
            refused = [errors.not_unique("id", recording.id, "must differ from every other recording's")]
        if recording is not None and not refused:
            good[recording.id] = recording
        label = recording.id if recording is not None else _label(entry, index)
        problems += [RecordingProblem(label, error.place, error.value, error.allowed, error.code) for error in refused]
    if not good and all(problem.field.startswith("skin.") for problem in problems):
        raise problems[0].as_error(problems[0].field)
    return Campaign(name, skin, tuple(good.values()), units_checked), problems


def parse(document: Any) -> Campaign:
    """The campaign of a document; raises InvalidInput at the first thing wrong, in a recording too."""
    campaign, problems = from_dict(document)
    if problems:
        first = problems[0]
        raise first.as_error(f"recordings[{first.recording}].{first.field}")
    return campaign


def to_dict(campaign: Campaign) -> dict[str, Any]:
    """The canonical document of a campaign: plain JSON values, without the fields that are not known.

    `youngs_modulus_mpa` and `d33_pc_per_n` are written as null when unknown; `kind` is left out when it is `frf`.
    """
    unknown = {"youngs_modulus_mpa": campaign.skin.youngs_modulus_mpa, "d33_pc_per_n": campaign.skin.d33_pc_per_n}
    skin = {**_plain(replace(campaign.skin, sensors=())), **unknown}
    if campaign.skin.sensors:
        skin["sensors"] = [_plain(sensor) for sensor in campaign.skin.sensors]
    document = {
        "schema": SCHEMA,
        "name": campaign.name,
        "skin": skin,
        "recordings": [_plain(recording) for recording in campaign.recordings],
    }
    return {**document, "units_checked": True} if campaign.units_checked else document


def _plain(model: Any) -> dict[str, Any]:
    document: dict[str, Any] = {}
    for name in (entry.name for entry in fields(model)):
        value = getattr(model, name)
        if isinstance(value, np.ndarray):
            document[name] = value.tolist()
        elif isinstance(value, Tolerances):
            document[name] = asdict(value)
        elif value not in (None, ()) and (name, value) != ("kind", "frf"):
            document[name] = list(value) if isinstance(value, tuple) else value
    return document


def _recording(entry: Any, skin: SkinDescription, units_checked: bool) -> tuple[Recording | None, list[InvalidInput]]:
    try:
        document = field.mapping("recording", entry)
    except InvalidInput as refusal:
        return None, [refusal]
    kind = shown(document.get("kind")) or "frf"
    if kind not in KINDS:
        return None, [errors.not_one_of("kind", kind, KINDS)]
    values, refused = field.check_fields(KINDS[kind], document, units_checked=units_checked)
    known = {error.field for error in refused}
    together = [*_unmet_needs(kind, document, values, skin), *_unequal_lengths(values)]
    refused += [error for error in together if error.field not in known]
    if known:
        return None, refused
    recording = KINDS[kind](**{**values, "kind": kind})
    return recording, [*refused, *refusals(recording)]


def _unmet_needs(
    kind: str, document: Mapping[str, Any], values: Mapping[str, Any], skin: SkinDescription
) -> list[InvalidInput]:
    """What the recording's kind needs of the skin, and of its own fields together; `values`: those that are good."""
    refused = []
    sensor = None if kind == "compression" else values.get("sensor")
    if sensor is not None and sensor not in (known.id for known in skin.sensors):
        refused.append(
            InvalidInput("sensor", sensor, "must be the id of one of the skin's sensors", code=ErrorCode.NOT_ONE_OF)
        )
    if kind == "frf":
        refused += [
            errors.required(f"skin.{name}", "required by a recording of kind frf")
            for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm")
            if getattr(skin, name) is None
        ]
        refused += _not_one_of_two_forms(document)
    return refused


LINES = ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n")
TIME_SERIES = ("sample_rate_hz", "force_n", "charge_pc")


def _not_one_of_two_forms(document: Mapping[str, Any]) -> list[InvalidInput]:
    """An FRF or the time series it is estimated from: one of the two, whole."""
    series = [name for name in TIME_SERIES if document.get(name) is not None]
    lines = [name for name in (*LINES, "coherence") if document.get(name) is not None]
    if document.get("estimator") is not None and not series:
        allowed = "must be absent where there is no time series"
        return [errors.conflicting("estimator", shown(document["estimator"]), allowed)]
    if series and lines:
        return [errors.conflicting(series[0], "given", "must be absent where the FRF itself is given")]
    needed = TIME_SERIES if series else LINES
    return [errors.required(name) for name in needed if document.get(name) is None]


def _unequal_lengths(values: Mapping[str, Any]) -> list[InvalidInput]:
    columns = {name: len(column) for name, column in values.items() if isinstance(column, np.ndarray)}
    if len(set(columns.values())) < 2:
        return []
    first, length = next(iter(columns.items()))
    return [errors.unequal_lengths(name, size, length, first) for name, size in columns.items() if size != length]


def _label(entry: Any, index: int) -> str:
    called = entry.get("id") if isinstance(entry, Mapping) else None
    return shown(called) if isinstance(called, str) and called else f"recordings[{index}]"
