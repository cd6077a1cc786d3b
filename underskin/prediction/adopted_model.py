"""An explained diagnosis as the model of its skin: what the mechanisms that it found predict for new recordings.

The mechanisms stand at the values of the report, the declared modulus and thickness as declared. FRF = d33 · response,
since every mechanism is linear in d33. A response is what one line shows; its level is the same without those
mechanisms that act line by line (resonance, delays, high pass), as a plateau would show it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from underskin.errors import InvalidInput
from underskin.findings import sentences
from underskin.mechanisms.base import Mechanism, Parameter
from underskin.mechanisms.models.composition import chosen, parameters_together
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.models.frf_design import frf_recordings, offsets
from underskin.mechanisms.registry import CATALOGUE
from underskin.prediction import plausibility
from underskin.recordings.campaign import Campaign, FrfRecording, SkinDescription
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats, to_si

_DECLARED = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
NOT_ADOPTED = {
    "ambiguous": "must be explained: several explanations remain, and only one can serve. Record what the report plans "
    "(next_experiment), send it together with these recordings, and diagnose that",
    "unexplained": "must be explained: none of the known mechanisms describes what is missing, so that nothing could "
    "be predicted with it. Look at the rig where the report says that the misfit lies, and record it again",
    "no_mismatch": "must be explained: nothing is missing, so that there is nothing to adopt; the paper's model serves",
    "insufficient_data": "must be explained: too little was recorded to tell what is missing. Record what the report "
    "plans (next_experiment), send it together with these recordings, and diagnose that",
}  # by verdict: why it is refused, and what to do
_SAME = 1e-9  # relative
# These widen what is expected of recordings, and move no prediction; parameters of older reports may be others.
_WIDENING = frozenset({"sensor_spread", "mains_pickup"})
_REPORTED_SDS = 2 * float(ndtri(0.975))  # width of a report's interval


@dataclass(frozen=True)
class Response:
    """FRF over d33 [-], one row a line: recordings one behind another, as in the campaign."""

    value: Complexes  # (rows,)
    recording: NDArray[np.intp]  # (rows,)
    inside: NDArray[np.bool_]  # (rows,) False where the contact lies beyond the table


@dataclass(frozen=True)
class AdoptedModel:
    """The skin that was diagnosed, and the value of each parameter of each mechanism, by name.

    `unsure` is the relative standard deviation of the d33 that the diagnosis found, its parameters' included: how far
    responses are unsure within the range of that campaign.
    """

    skin: SkinDescription
    parameters: Mapping[str, Mapping[str, float]]
    unsure: float

    @property
    def mechanisms(self) -> list[Mechanism]:
        """Those that move predictions, in order of composition."""
        return [mechanism for mechanism in chosen(list(self.parameters), CATALOGUE) if mechanism.name not in _WIDENING]

    @property
    def of_lines(self) -> list[str]:
        """Names of the mechanisms that act line by line."""
        return [mechanism.name for mechanism in self.mechanisms if _acts_on_lines(mechanism)]

    @property
    def needs(self) -> dict[str, str]:
        """Fields of a recording that its predictions need beside sphere, preload and lines; each with who needs it."""
        found: dict[str, str] = {}
        for mechanism in self.mechanisms:
            fields: list[str] = [name for name in ("dwell_s", "dynamic_force_n") if name in mechanism.contact_axes]
            fields += ["load_cycles"] if "load_cycles" in mechanism.axes else []
            fields += ["sensor"] if mechanism.needs_neighbours else []
            found |= {name: mechanism.name for name in fields if name not in found}
        return found

    def require_skin(self, declared: Mapping[str, Any]) -> None:
        """Raises InvalidInput where a skin is declared otherwise than the one that was diagnosed.

        What was found may be about those very values, such as a wrong modulus.
        """
        for name in _DECLARED:
            here = getattr(self.skin, name)
            there = np.atleast_1d(np.asarray(declared[name], dtype=float))
            if not np.allclose(there, here, rtol=_SAME, atol=0):
                off = there[~np.isclose(there, here, rtol=_SAME, atol=0)][0]
                raise InvalidInput(
                    name, float(off), f"must be {here:g}, as the skin was declared when it was diagnosed"
                )

    def response(self, campaign: Campaign, table: SigmaTable, *, level: bool = False) -> Response:
        """What each line of the campaign's FRF recordings shows; their `level` with one row a recording instead.

        Raises InvalidInput where a recording lacks what a mechanism needs.
        """
        mechanisms = self.mechanisms
        if level:
            mechanisms = [mechanism for mechanism in mechanisms if not _acts_on_lines(mechanism)]
            campaign = _with_one_line(campaign)
        self._require_fields(campaign)
        known = {name: value for mechanism in mechanisms for name, value in self.parameters[mechanism.name].items()}
        if "offset" in known:
            _require_centred(campaign)
        elif "offset_x" in known:  # of which centred presses need the length alone
            known["offset"] = float(np.hypot(known["offset_x"], known["offset_y"]))
        model = FrfModel(mechanisms, campaign, table)
        fit = [_on_fit(parameter, known.get(parameter.name, 1.0)) for parameter in model.parameters]
        predicted = model.predict(np.array(fit))
        return Response(
            value=predicted.value.astype(np.complex128) / float(to_si("d33_pc_per_n", 1.0)),
            recording=model.recording,
            inside=model.valid & predicted.inside,
        )

    def as_base_model(self, campaign: Campaign, table: SigmaTable) -> tuple[Campaign, list[str]]:
        """The campaign as the base model would show it, for what knows only that; and the recordings left out.

        Each line is multiplied by the base model's response over this one's. Recordings beyond the table, and lines
        that are not finite, are left out, as are recordings of other kinds. Raises InvalidInput.
        """
        self.require_skin(vars(campaign.skin))
        kept = replace(campaign, recordings=tuple(map(_with_lines, frf_recordings(campaign))))
        found = self.response(kept, table)
        base = AdoptedModel(self.skin, {}, 0.0).response(kept, table)
        ratio = base.value / found.value
        recordings, left_out = [], []
        for number, entry in enumerate(frf_recordings(kept)):
            rows = found.recording == number
            if found.inside[rows].all() and base.inside[rows].all():
                recordings.append(_times(entry, ratio[rows]))
            else:
                left_out.append(entry.id)
        return replace(campaign, recordings=tuple(recordings)), left_out

    def _require_fields(self, campaign: Campaign) -> None:
        for name, mechanism in self.needs.items():
            for entry in frf_recordings(campaign):
                if getattr(entry, name) is None:
                    raise InvalidInput(f"recordings[{entry.id}].{name}", None, _needed(mechanism))


def adopted(report: Mapping[str, Any], campaign: Campaign) -> AdoptedModel:
    """The model of a `report/1` and the campaign that it is of; raises InvalidInput where it cannot serve."""
    if report["verdict"] != "explained":
        raise InvalidInput(
            "diagnosis_id", f"a diagnosis of verdict {report['verdict']}", NOT_ADOPTED[report["verdict"]]
        )
    reason = implausible_d33(report)
    if reason is not None:
        raise InvalidInput("diagnosis_id", "a diagnosis", f"its d33 cannot be right: {reason}")
    if not any(isinstance(entry, FrfRecording) for entry in campaign.recordings):
        raise InvalidInput("diagnosis_id", "a diagnosis of curves", "must be of a campaign with recordings of kind frf")
    parameters = {
        entry["name"]: {found["name"]: float(found["value"]) for found in entry["parameters"]}
        for entry in report["mechanisms"]
    }
    frf = [mechanism for name, mechanism in CATALOGUE.items() if name in parameters and "frf" in mechanism.kinds]
    known = parameters_together(frf, campaign, "frf")
    for name, values in parameters.items():
        as_known = name in known and (name in _WIDENING or set(values) == {entry.name for entry in known[name]})
        if not as_known:
            allowed = "must be of mechanisms that this version knows, with the parameters that it knows"
            raise InvalidInput("diagnosis_id", name, allowed)
    d33 = report["d33"]
    return AdoptedModel(campaign.skin, parameters, float(np.log(d33["high"] / d33["low"])) / _REPORTED_SDS)


def implausible_d33(report: Mapping[str, Any]) -> str | None:
    """Why the d33 of a `report/1`, by the middle of its interval, is none that PVDF can have; None where it may be."""
    interval = report["d33"] or {}
    if not {"low", "high"} <= set(interval):
        return None
    d33 = float(np.sqrt(interval["low"] * interval["high"]))
    doubt = plausibility.doubt_of(d33)
    return None if doubt is None else f"{d33:.4g} pC/N, {sentences.D33_DOUBTS[doubt]}"


def pressed_campaign(
    skin: SkinDescription, sensor: str | None, columns: Mapping[str, Floats], frequency_hz: Floats
) -> Campaign:
    """One recording a row: columns of one length, `offset_x_mm` and `offset_y_mm` from the centre of the sensor.

    Columns that a model may need and that are not there stay unknown. Where no sensor is named, it is any one of the
    array. Raises InvalidInput for a sensor that the array does not have.
    """
    places = {entry.id: entry for entry in skin.sensors}
    if sensor is not None and sensor not in places:
        raise InvalidInput("sensor", sensor, f"must be one of {', '.join(places)}")
    centre = skin.sensors[0] if sensor is None else places[sensor]
    lines = np.zeros(len(frequency_hz))
    names = ("indenter_radius_mm", "preload_n", "offset_x_mm", "offset_y_mm")
    further = [name for name in ("dynamic_force_n", "dwell_s", "load_cycles") if name in columns]
    rows = zip(*(columns[name].tolist() for name in (*names, *further)), strict=True)
    recordings = [
        FrfRecording(
            id=f"row {number}",
            sensor=centre.id,
            indenter_radius_mm=radius,
            preload_n=preload,
            position_mm=(centre.x_mm + x, centre.y_mm + y),
            frequency_hz=frequency_hz,
            frf_re_pc_per_n=lines,
            frf_im_pc_per_n=lines,
            **({"dynamic_force_n": 0.0} | dict(zip(further, more, strict=True))),
        )
        for number, (radius, preload, x, y, *more) in enumerate(rows)
    ]
    return Campaign("rows", skin, tuple(recordings))


def _require_centred(campaign: Campaign) -> None:
    """Of a misalignment in an unknown direction, only presses at the sensors' centres show the same."""
    beside = offsets(campaign).any(axis=1)
    if beside.any():
        entry = frf_recordings(campaign)[int(np.argmax(beside))]
        allowed = "must be the sensor's centre: the adopted model knows how far presses miss it, not in which direction"
        raise InvalidInput(f"recordings[{entry.id}].position_mm", entry.position_mm, allowed)


def _needed(mechanism: str) -> str:
    return f"is required: the adopted model has {mechanism}"


def _acts_on_lines(mechanism: Mechanism) -> bool:
    return type(mechanism).on_lines is not Mechanism.on_lines


def _on_fit(parameter: Parameter, value: float) -> float:
    """Within the bounds, which rounding may have left."""
    return float(np.clip(parameter.to_fit(value), *parameter.bounds))


def _with_one_line(campaign: Campaign) -> Campaign:
    one = np.array([1.0])
    recordings = [
        replace(_without_lines(entry), frequency_hz=one, frf_re_pc_per_n=one, frf_im_pc_per_n=one)
        for entry in frf_recordings(campaign)
    ]
    return replace(campaign, recordings=tuple(recordings))


def _with_lines(entry: FrfRecording) -> FrfRecording:
    """With its lines in place of its time series, those that are finite."""
    measured = lines_of(entry)
    good = np.isfinite(measured.values)
    return replace(
        _without_lines(entry),
        frequency_hz=measured.frequency[good],
        frf_re_pc_per_n=1e12 * measured.values.real[good],
        frf_im_pc_per_n=1e12 * measured.values.imag[good],
        coherence=None if measured.coherence is None else measured.coherence[good],
    )


def _without_lines(entry: FrfRecording) -> FrfRecording:
    return replace(entry, sample_rate_hz=None, force_n=None, charge_pc=None, coherence=None)


def _times(entry: FrfRecording, factor: Complexes) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    lines = (entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n) * factor
    return replace(entry, frf_re_pc_per_n=lines.real, frf_im_pc_per_n=lines.imag)
