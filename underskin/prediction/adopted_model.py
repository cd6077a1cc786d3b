"""An explained diagnosis as the model of its skin: what its mechanisms predict for new recordings.

The mechanisms have the parameter values of the report; modulus and thickness are as declared. FRF = d33 · response,
since every mechanism is linear in d33. A response is that of one line; its level is the same without the mechanisms
that act line by line (resonance, delays, high pass), as a plateau would show it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.special import ndtri

from underskin.errors import InvalidInput, conflicting
from underskin.mechanisms.base import NEEDED_FIELDS, Mechanism, Stage
from underskin.mechanisms.laws import misalignment
from underskin.mechanisms.models.composed import forward_model
from underskin.mechanisms.models.composition import chosen, parameters_together
from underskin.mechanisms.registry import CATALOGUE, current_name
from underskin.mechanisms.unlisted.grammar import CAMPAIGN_SPECIFIC_AXES, Grammar, bound_to
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.prediction.forward_model import needed_fields, require_fields
from underskin.recordings import plausibility
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, SkinDescription, frf_of, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Complexes, Indices, Mask, to_si

_DECLARED = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
NOT_ADOPTED = {
    "ambiguous": "several explanations remain, and only one can serve. Make the recordings that it plans, or where it "
    "plans none, vary what these held fixed; send them together with these, and diagnose that",
    "unexplained": "none of the known mechanisms describes what is missing, and no law over one axis that holds for "
    "other recordings stands for it. Look at the rig where the report says that the misfit lies, and record it again",
    "no_mismatch": "nothing is missing, so that there is nothing to adopt; the paper's model serves",
    "insufficient_data": "it cannot tell what is missing. Correct what it says is wrong, or record what it says is "
    "lacking and send it together with these recordings; then diagnose that",
}  # by verdict: why it is rejected, and what to do
UNLISTED_LAW = "a law without a name"  # the name of an adopted one in messages
_SAME = 1e-9  # relative
_ANY_LINE = np.array([1.0])  # Hz
_REPORTED_SDS = 2 * float(ndtri(0.975))  # width of a report's interval


@dataclass(frozen=True)
class Response:
    """FRF over d33 [-], one row a line: recordings one behind another, as in the campaign."""

    value: Complexes  # (rows,)
    recording: Indices  # (rows,)
    inside: Mask  # (rows,) False where the contact lies beyond the table


@dataclass(frozen=True)
class AdoptedModel:
    """The skin that was diagnosed, and the value of each parameter of each mechanism, by name.

    `unsure` is the relative standard deviation of the diagnosed d33, that by the parameters included: the uncertainty
    of responses within the range of that campaign.
    """

    skin: SkinDescription
    parameters: Mapping[str, Mapping[str, float]]
    unsure: float
    law: UnlistedLaw | None = None  # the unlisted law of the diagnosis
    of_law: Mapping[str, float] = field(default_factory=dict)  # its parameters

    @property
    def mechanisms(self) -> list[Mechanism]:
        """The mechanisms that affect predictions, in order of composition."""
        return [mechanism for mechanism in chosen(list(self.parameters), CATALOGUE) if mechanism.moves_predictions]

    @property
    def of_lines(self) -> list[str]:
        """Names of the mechanisms that act line by line."""
        names = [mechanism.name for mechanism in self.mechanisms if mechanism.stage is Stage.LINES]
        return [*names, *([UNLISTED_LAW] if self.law is not None and self.law.stage is Stage.LINES else [])]

    @property
    def needs(self) -> dict[str, str]:
        """Fields of a recording needed for predictions besides sphere, preload and lines, each with what needs it."""
        needed = needed_fields(self.mechanisms)
        if isinstance(self.law, RecordingLaw | LagLaw) and self.law.axis.name in NEEDED_FIELDS:
            needed.setdefault(self.law.axis.name, UNLISTED_LAW)
        return needed

    def require_skin(self, declared: Mapping[str, Any]) -> None:
        """Raise InvalidInput where a skin is declared otherwise than the diagnosed one.

        The diagnosis may concern these values, such as a wrong modulus.
        """
        for name in _DECLARED:
            diagnosed = getattr(self.skin, name)
            stated = np.atleast_1d(np.asarray(declared[name], dtype=float))
            if not np.allclose(stated, diagnosed, rtol=_SAME, atol=0):
                differing = stated[~np.isclose(stated, diagnosed, rtol=_SAME, atol=0)][0]
                raise conflicting(
                    name, float(differing), f"must be {diagnosed:g}, as the skin was declared when it was diagnosed"
                )

    def response(self, conditions: Conditions, table: SigmaTable, *, level: bool = False) -> Response:
        """The response of each line of FRFs under these conditions; with `level` one row a recording instead.

        Raises InvalidInput where a recording lacks what a mechanism needs.
        """
        mechanisms = self.mechanisms
        if level:
            mechanisms = [mechanism for mechanism in mechanisms if mechanism.stage is not Stage.LINES]
            conditions = _levels(conditions)
        require_fields(self.mechanisms, conditions, "the adopted model")
        values: dict[str, float] = {}
        for mechanism in mechanisms:
            values |= self.parameters[mechanism.name]
        if misalignment.Misalignment.name in self.parameters:
            values |= misalignment.transfer(self.parameters[misalignment.Misalignment.name], conditions)
        inside = np.ones(len(frf_of(conditions)), dtype=bool)
        if self.law is not None:
            law, inside = bound_to(self.law, conditions, table)
            if not (level and law.stage is Stage.LINES):
                mechanisms = [*mechanisms, law]
                values |= self.of_law
        model = forward_model(mechanisms, conditions, table, "frf")
        fit = [parameter.to_fit(values.get(parameter.name, 1.0)) for parameter in model.parameters]
        bounds = np.array([parameter.bounds for parameter in model.parameters])
        predicted = model.predict(np.clip(fit, *bounds.T))  # against rounding
        return Response(
            value=predicted.value.astype(np.complex128) / float(to_si("d33_pc_per_n", 1.0)),
            recording=model.recording,
            inside=model.valid & predicted.inside & inside[model.recording],
        )

    def as_base_model(self, campaign: Campaign, table: SigmaTable) -> tuple[Campaign, list[str]]:
        """The campaign as the base model would show it, for methods limited to that; and the recordings left out.

        Each line is multiplied by the base model's response over this one's. Recordings beyond the table, lines that
        are not finite, and recordings of other kinds are left out. Raises InvalidInput.
        """
        self.require_skin(vars(campaign.skin))
        finite = replace(campaign, recordings=tuple(map(_finite_lines, frf_recordings(campaign))))
        adopted_response = self.response(finite, table)
        base_response = AdoptedModel(self.skin, {}, 0.0).response(finite, table)
        ratio = base_response.value / adopted_response.value
        recordings, omitted = [], []
        for index, recording in enumerate(frf_recordings(finite)):
            rows = adopted_response.recording == index
            if adopted_response.inside[rows].all() and base_response.inside[rows].all():
                recordings.append(_times(recording, ratio[rows]))
            else:
                omitted.append(recording.id)
        return replace(campaign, recordings=tuple(recordings)), omitted


def adopted(report: Mapping[str, Any], campaign: Campaign, table: SigmaTable | None = None) -> AdoptedModel:
    """The model of a `report/1` and its campaign; raises InvalidInput where it cannot be used."""
    why_not = not_adopted(report)
    if why_not is not None:
        raise InvalidInput(
            "diagnosis_id", f"a diagnosis of verdict {report['verdict']}", f"must be explained: {why_not}"
        )
    reason = implausible_d33(report, units_checked=campaign.units_checked)
    if reason is not None:
        raise InvalidInput("diagnosis_id", "a diagnosis", f"its d33 cannot be right: {reason}")
    if not campaign.of(FrfRecording):
        raise InvalidInput("diagnosis_id", "a diagnosis of curves", "must be of a campaign with recordings of kind frf")
    parameters = {
        current_name(stated["name"]): {
            current_name(parameter["name"]): float(parameter["value"]) for parameter in stated["parameters"]
        }
        for stated in report["mechanisms"]
        if stated["name"] not in CATALOGUE or CATALOGUE[stated["name"]].acts_on_frfs
    }
    if report["mechanisms"] and not parameters:
        allowed = "must be of mechanisms that act on FRFs: those of curves alone predict none"
        raise InvalidInput("diagnosis_id", report["mechanisms"][0]["name"], allowed)
    frf = [mechanism for name, mechanism in CATALOGUE.items() if name in parameters and mechanism.acts_on_frfs]
    current = parameters_together(frf, campaign, "frf")
    for name, values in parameters.items():
        # Parameters that move no prediction are not used; those of older reports may be others.
        matches = name in current and (
            not CATALOGUE[name].moves_predictions or set(values) == {parameter.name for parameter in current[name]}
        )
        if not matches:
            allowed = "must be of mechanisms that this version knows, with the parameters that it knows"
            raise InvalidInput("diagnosis_id", name, allowed)
    d33 = report["d33"]
    relative_deviation = float(np.log(d33["high"] / d33["low"])) / _REPORTED_SDS
    model = AdoptedModel(campaign.skin, parameters, relative_deviation)
    return model if report["verdict"] in ("explained", "ambiguous") else replace(model, **_law(report, campaign, table))


def not_adopted(report: Mapping[str, Any]) -> str | None:
    """Why a diagnosis cannot be used as a model, by its verdict; None where it can.

    An unlisted law can where it is certain and its axis applies to other recordings; so can one of several answers with
    equal predictions.
    """
    if report["verdict"] == "explained" or (
        report["verdict"] == "ambiguous" and report.get("provenance", {}).get("alike")
    ):
        return None
    law = report.get("unnamed")
    if law is None or report["d33"] is None or law["axis"] in CAMPAIGN_SPECIFIC_AXES:
        return NOT_ADOPTED[report["verdict"]]
    return None


def _law(report: Mapping[str, Any], campaign: Campaign, table: SigmaTable | None) -> dict[str, Any]:
    """The law of a report, and its parameters."""
    stored = report["provenance"]["unnamed"]
    lines = np.concatenate([lines_of(recording).frequency for recording in frf_recordings(campaign)])
    grammar = Grammar.of(campaign, lines, load_table() if table is None else table, ())
    law = next((candidate for candidate in grammar.laws if candidate.name == stored["law"]), None)
    if law is None or {parameter.name for parameter in law.parameters_stated} != set(stored["parameters"]):
        raise InvalidInput("diagnosis_id", stored["law"], "must be a law that this version knows")
    return {"law": law, "of_law": dict(stored["parameters"])}


def implausible_d33(report: Mapping[str, Any], *, units_checked: bool) -> str | None:
    """Why the d33 of a `report/1`, the middle of its interval, is impossible for PVDF; None where it is possible, and
    where the units of another are checked."""
    interval = report["d33"] or {}
    if not {"low", "high"} <= set(interval):
        return None
    d33 = float(np.sqrt(interval["low"] * interval["high"]))
    implausible = plausibility.implausibility(d33, units_checked=units_checked)
    return None if implausible is None else f"{d33:.4g} pC/N, {implausible.words}"


def _levels(conditions: Conditions) -> Conditions:
    """Each FRF at one line: without the mechanisms that act line by line, any frequency shows the level."""
    recordings = [recording.without_measurements(frequency_hz=_ANY_LINE) for recording in frf_of(conditions)]
    return Conditions(conditions.name, conditions.skin, tuple(recordings))


def _finite_lines(recording: FrfRecording) -> FrfRecording:
    """The recording with its finite lines instead of its time series."""
    measured = lines_of(recording)
    good = np.isfinite(measured.values)
    coherence = None if measured.coherence is None else measured.coherence[good]
    return FrfRecording.of_lines(recording, measured.frequency[good], measured.values[good], coherence)


def _times(recording: FrfRecording, factor: Complexes) -> FrfRecording:
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    lines = (recording.frf_re_pc_per_n + 1j * recording.frf_im_pc_per_n) * factor
    return replace(recording, frf_re_pc_per_n=lines.real, frf_im_pc_per_n=lines.imag)
