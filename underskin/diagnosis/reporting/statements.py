"""Sentences and entries of a report: location, shape of the residual, rivals, next recordings, d33.

Written for experimenters: percentages and values with units, no further statistics. `next_experiment` is the plan of
recordings as the report has it; `StatedD33` says whether d33 is to be quoted, and what would change it without showing
in these recordings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.data.dataset import WORDS
from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.localisation import (
    ALONG_CURVES,
    AxisResult,
    EffectSize,
    FormKind,
    Shape,
    ShapeForm,
    Undecidable,
)
from underskin.diagnosis.planning.optimal_design import WRONG_MODULUS, NextRecordings
from underskin.diagnosis.reporting import numbers
from underskin.diagnosis.reporting.unlisted_law import LeadingLaw
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE, Answer, Search
from underskin.diagnosis.validation.cross_validation import REACHES_NOISE
from underskin.diagnosis.validation.signatures import Confounding, HiddenShift, Likeness
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits, in_percent
from underskin.prediction import plausibility

_MOST_UNLISTED = P_NOT_IN_MODEL_SPACE + 1e-3  # largest probability of none_of_these where no unlisted law shows
_IN_PERCENT = 90.0  # beyond it an effect is given as a factor


def shape_clause(shape: Shape | None) -> str:
    """A clause on the residual that no mechanism describes; empty where it was not analysed."""
    if shape is None:
        return ""
    form = "has no simple form over one axis" if shape.form is None else f"looks like {_form(shape.form, shape)}"
    if not shape.beyond:
        return f"what remains {form}"
    explain = "explains" if len(shape.beyond) == 1 else "explain"
    return f"{in_words(shape.beyond)} {explain} part of the misfit; what remains {form}"


def _form(form: ShapeForm, shape: Shape) -> str:
    axis_words, unit = ALONG_CURVES[form.axis] if shape.of_curves else (_form_axis(form), WORDS[form.axis][1])
    words = _FORMS[form.kind].format(at=form.at, unit=f" {unit}" if unit else "")
    of = " of the largest force" if shape.of_curves else ""
    return f"{words}, up to {in_digits(form.size, 2)} %{of} over {axis_words}"


_FORMS: Mapping[FormKind, str] = {
    FormKind.POWER_LAW: "a power law",
    FormKind.DRIFT: "a drift",
    FormKind.STEP: "a step at {at:.4g}{unit}",
    FormKind.PERIODIC: "a periodic change of period {at:.3g}{unit}",
    FormKind.PEAK: "a peak or notch at {at:.3g}{unit}",
    FormKind.BUMP: "a bump at {at:.3g}{unit}",
}


def _form_axis(form: ShapeForm) -> str:
    words = WORDS[form.axis][0]
    return words if form.component is None else f"{words} ({'xy'[form.component]})"


def why_not(answer: Answer, leader: Answer) -> str:
    """Why an answer is less probable than the leading one."""
    if answer.probability > 0.25 * leader.probability:
        return "the recordings hardly tell it from the leading explanation"
    if answer.explanation is None and answer.probability < _MOST_UNLISTED:
        return "nothing in the recordings asks for it; a small share always stays for what nobody thought of"
    if answer.explanation is None:
        return "unlisted laws explain the recordings less well, or no better though they are freer"
    if leader.explanation is None:
        return "what it leaves of the misfit is not noise"
    less = leader.explanation.log_evidence - answer.explanation.log_evidence
    if less > 1:
        factor = f"about {_round(np.exp(less))}" if less < np.log(1e6) else "more than a million"
        return f"the recordings are {factor} times less probable under it"
    return "it explains no more and is less probable beforehand" if less > -1 else "it is less probable beforehand"


def _round(value: float) -> str:
    return f"{float(f'{value:.1g}'):.0f}" if value >= 10 else f"{value:.1g}"


_UNDECIDABLE: Mapping[Undecidable, str] = {
    Undecidable.FEW_EXCHANGEABLE: "too few recordings that could be exchanged",
    Undecidable.FEW_RECORDINGS: "too few recordings to tell it from the other axes",
    Undecidable.ALIASED: "the other axes together determine it in this design",
    Undecidable.FEW_SIGNS: "fewer than 6 recordings, whose signs could be changed",
}


_DETERMINING = {"recorded_at": "the time of recording", "sensor": "the sensor"}  # others as in `WORDS`


def undecidable(result: AxisResult) -> str:
    """Why it cannot be decided whether the residual depends on an axis; empty where it can."""
    if not result.determined_by:
        return "" if result.reason is None else _UNDECIDABLE[result.reason]
    named = listed([_DETERMINING.get(name, WORDS[name][0]) for name in result.determined_by])
    determine = "determines" if len(result.determined_by) == 1 else "together determine"
    return f"{named} {determine} it in this design"


CONFOUNDED: Mapping[Likeness, str] = {
    Likeness.NOISE: "at a typical strength it stays within the noise here",
    Likeness.TAKEN_UP: "at a typical strength it looks here like another d33, E or h within their tolerances",
    Likeness.IMITATED: "what {mechanism} typically does to these recordings, {other} can do as well",
    Likeness.IMITATES: "what {other} typically does to these recordings, {mechanism} can do as well",
    Likeness.FITS_AS_WELL: "{other} explains these recordings about as well as {mechanism}",
}


def location_statement(
    axes: Sequence[AxisResult],
    region: Mapping[str, Sequence[float | str]],
    reaches_all: Mapping[str, bool],
    effect: EffectSize,
    *,
    agrees: bool = False,
) -> str:
    """The location of the misfit in one sentence.

    `reaches_all` says for each axis of the region whether the region spans all of it, `agrees` that recordings and
    model agree within the noise.
    """
    unknown = [WORDS[result.axis][0] for result in axes if result.p_value is None]
    tail = f"; whether it depends on {listed(unknown)}, this design cannot tell" if unknown else ""
    if len(unknown) == len(axes) and unknown:
        return f"Whether the misfit depends on {listed(unknown)}, this design cannot tell."
    beyond_chance = [result for result in axes if result.significant]
    if not beyond_chance:
        return f"The misfit changes with nothing that was varied, beyond chance{tail}."
    telling = [result for result in beyond_chance if result.telling]
    named = sorted(telling or beyond_chance, key=lambda result: result.p_value or 0.0)
    names = listed([WORDS[result.axis][0] for result in named])
    if not telling and not agrees:
        return (
            f"The misfit changes with {names} beyond chance, but no more than a trace of it goes along with that{tail}."
        )
    if agrees:
        return (
            f"What is left is within the noise, though more of it goes along with {names} than chance would give{tail}."
        )
    return f"The misfit depends on {names}; {_where(region, reaches_all)}, where {_size(effect)}{tail}."


def _where(region: Mapping[str, Sequence[float | str]], reaches_all: Mapping[str, bool]) -> str:
    """The ranges that hold most of the misfit, and the sensor or day where it is largest."""
    ranges: list[str] = []
    levels: list[str] = []
    for name, ends in region.items():
        if not reaches_all[name]:
            (levels if isinstance(ends[0], str) else ranges).append(_range(name, ends))
    parts = [f"most of it lies at {listed(ranges)}"] if ranges else []
    parts += [f"it is largest at {listed(levels)}"] if levels else []
    return listed(parts) if parts else "it is spread over all of the recordings"


def _size(effect: EffectSize) -> str:
    low, high = sorted((abs(effect.low), abs(effect.high)))
    if not effect.signed:
        return (
            f"the response is off by {in_digits(effect.percent, 3)} % (root mean square: above the model in parts, "
            f"below it in others; 95 %: {in_digits(low, 3)} to {in_digits(high, 3)} %)"
        )
    if abs(effect.percent) > _IN_PERCENT:
        return _times(effect)
    side = "above" if effect.percent > 0 else "below"
    span = (
        f"{effect.low:+.2g} to {effect.high:+.2g}"
        if effect.low * effect.high < 0
        else f"{in_digits(low, 3)} to {in_digits(high, 3)}"
    )
    return f"the response is {in_digits(abs(effect.percent), 3)} % {side} the model (95 %: {span} %)"


def _times(effect: EffectSize) -> str:
    """A large effect as a factor; more than 100 % below means the opposite sign."""
    factor, low, high = (1 + percent / 100 for percent in (effect.percent, effect.low, effect.high))
    span = f"{in_digits(low, 2)} to {in_digits(high, 2)}"
    if factor >= 0:
        return f"the response is {in_digits(factor, 2)} times the model's (95 %: {span})"
    return f"the response has the other sign than the model's, {in_digits(factor, 2)} times it (95 %: {span})"


def _range(axis: str, ends: Sequence[float | str]) -> str:
    words, unit = WORDS[axis]
    values = [value if isinstance(value, str) else in_digits(value) for value in ends]
    text = " to ".join(dict.fromkeys(values))
    return f"{words} {text} {unit}".rstrip()


def listed(names: Sequence[str]) -> str:
    """Names joined with commas and a final "and"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


_STIFFENING = "strain_stiffening"
_VARIED = {  # axes of curves; others as in `WORDS`
    "displacement_mm": "depth",
    "force_n": "largest force",
    "sample_diameter_mm": "diameter of the sample",
    "sample_height_mm": "height of the sample",
    "time_s": "speed and the time of a hold",
}


def next_experiment(plan: NextRecordings | None) -> dict[str, Any]:
    """The plan as the report has it, in lab units; empty where nothing needs to be planned."""
    if plan is None:
        return {}
    return {
        "recordings": _recordings(plan),
        "separates": [list(names) for names in plan.rivals],
        "probability_of_deciding": round(plan.probability, 3),
        "without_it": round(plan.without, 3),
        "minutes": round(plan.minutes, 1),
        "statement": _statement(plan) if plan.recordings else _why_none(plan),
    }


def _recordings(plan: NextRecordings) -> list[dict[str, Any]]:
    documents = []
    for recording in dict.fromkeys(plan.recordings):
        names = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n")
        described = {name: getattr(recording, name) for name in names}
        described |= {"position_mm": list(recording.position_mm or ()), "dwell_s": recording.dwell_s}
        given = {name: value for name, value in described.items() if value is not None}
        documents.append({**given, "repeats": plan.recordings.count(recording)})
    return documents


def _statement(plan: NextRecordings) -> str:
    first = plan.first
    assert first is not None
    beyond = " It goes beyond what this campaign did: check that the rig can." if plan.beyond else ""
    contact = f"with the sphere of {first.indenter_radius_mm:g} mm radius at {first.preload_n:g} N"
    several = f"{len(plan.recordings)} recordings, of which that {contact} tells most,"
    return (
        f"{several if len(plan.recordings) > 1 else f'One recording {contact}'} should tell whether "
        f"it is {_rivals(plan)}, with a probability of {in_percent(plan.probability)}.{beyond}{_block(plan)}"
    )


def _block(plan: NextRecordings) -> str:
    """A sentence on a compressed block or an indentation, where that promises to decide."""
    if plan.block is None:
        return ""
    stiffens = any(_STIFFENING in names for names in plan.rivals)
    also = "; compressed by a fifth of its height, a block shows strain stiffening too" if stiffens else ""
    clause = f"whether it is {in_words([WRONG_MODULUS])}, with a probability of {in_percent(plan.block)}{also}"
    return f" A compressed block or an indentation of the same elastomer would tell E, and so {clause}."


def _why_none(plan: NextRecordings) -> str:
    if plan.outside:
        return (
            f"No recordings within these limits can be planned to tell whether it is {_rivals(plan)}: the tables hold "
            f"none of their contacts; choose spheres and preloads nearer to those of the campaign.{_block(plan)}"
        )
    statement = f"No recordings within these limits are likely to tell whether it is {_rivals(plan)}."
    if plan.differ_on:
        words = sorted(_VARIED[axis] if axis in _VARIED else WORDS[axis][0] for axis in plan.differ_on)
        statement += f" They differ in what they depend on: vary the {listed(words)} more widely than here."
    return statement + _block(plan)


def _rivals(plan: NextRecordings) -> str:
    """The explanations in words, joined by "or", and the mechanisms of each by "with"."""
    *others, last = [" with ".join(in_words([name]) for name in names) for names in plan.rivals]
    return f"{', '.join(others)} or {last}" if others else last


_LARGEST_FLOOR = 20.0  # % of the response: noise above which no d33 is quoted
_MOST_NAMED = 2  # mechanisms that would not show, named with a value to quote
_ANSWERS = "several answers remain"
BY_NUISANCES = ("d33", "noise")  # confounders of mechanisms that d33, E, h or the noise hide


@dataclass(frozen=True)
class StatedD33:
    """The report's `d33` and whether it is to be quoted.

    `document` is None for curves. `findings`: one where no PVDF has such a value. `hidden`: mechanisms that would not
    show here and move d33 beyond its interval; those that are wrong declared numbers prevent quoting it. `why_not`:
    further reasons against quoting it, in words. `skin_pc_per_n`: the skin's declared d33, None where it declares none.
    """

    document: Mapping[str, Any] | None
    findings: Sequence[Finding] = ()
    hidden: Sequence[HiddenShift] = ()
    why_not: Sequence[str] = ()
    skin_pc_per_n: float | None = None

    @property
    def deciding(self) -> list[HiddenShift]:
        """Hidden mechanisms that prevent quoting d33, the largest first: wrong declared numbers and what would change
        d33 as much; none where no declared number does."""
        least = min((abs(shift.log_factor) for shift in self.hidden if shift.declared), default=np.inf)
        chosen = [shift for shift in self.hidden if abs(shift.log_factor) >= least]
        return sorted(chosen, key=lambda shift: -abs(shift.log_factor))

    def clause(self) -> str:
        """A clause on the value to quote, or on why none is quoted; empty where there is no d33."""
        if self.document is None:
            return ""
        if self.document["quotable"]:
            return f"d33 to quote: {self.quoted()}"
        return f"d33 is not to be quoted: {self.interval()}"

    def quoted(self) -> str:
        """The value with its interval, and the hidden mechanisms that would change it most beyond that."""
        assert self.document is not None
        value, low, high = (f"{self.document[key]:.3g}" for key in ("value", "low", "high"))
        largest = sorted(self.hidden, key=lambda shift: -abs(shift.log_factor))[:_MOST_NAMED]
        named = " or ".join(f"{in_words([shift.mechanism])} ({_percent(shift)})" for shift in largest)
        hides = f", provided that no {named} hides" if named else ""
        interval = f"95 %: {low} to {high}{self._relative_interval()}"
        return f"{value} {self.document['unit']} ({interval}){self._over_declared()}{hides}"

    def _relative_interval(self) -> str:
        """The interval without the tolerances of the declared values."""
        assert self.document is not None
        low, high = (f"{self.document['relative'][key]:.3g}" for key in ("low", "high"))
        return f" with what declared values may be off, {low} to {high} to compare sensors or dates"

    def _over_declared(self) -> str:
        """The ratio to the skin's declared d33, where the interval excludes it: a peak-to-peak force or charge taken
        for an amplitude halves or doubles every FRF, which nothing else in the recordings reveals."""
        assert self.document is not None
        declared = self.skin_pc_per_n
        if declared is None or self.document["low"] <= declared <= self.document["high"]:
            return ""
        return f", {self.document['value'] / declared:.2g} times the declared {declared:g} {self.document['unit']}"

    def interval(self) -> str:
        """The interval of d33, and why it is not to be quoted."""
        assert self.document is not None
        low, high = (f"{self.document[key]:.3g}" for key in ("low", "high"))
        lies = f"it lies from {low} to {high} {self.document['unit']}{self._over_declared()}"
        deciding = [f"{in_words([shift.mechanism])} by {_percent(shift)}" for shift in self.deciding[:_MOST_NAMED]]
        if deciding:
            return f"{lies}, but what would not show here would change it, {listed(deciding)}"
        over = " over the answers that remain" if _ANSWERS in self.why_not else ""
        others = " and ".join(words for words in self.why_not if words != _ANSWERS)
        return f"{lies}{over}" + (f", {'and' if over else 'but'} {others}" if others else "")

    @property
    def reasons(self) -> list[str]:
        """Reasons against quoting d33; empty where it is to be quoted."""
        if self.document is None:
            return list(self.why_not) or ["no answer explains its recordings"]
        hidden = in_words([shift.mechanism for shift in self.deciding[:_MOST_NAMED]])
        return [*self.why_not, *([f"{hidden} would change it without showing"] if hidden else [])]

    def not_identifiable(self, confounded: Sequence[Confounding]) -> list[dict[str, str]]:
        """The report's entries, with the change of d33 by each beyond its interval."""
        hidden = {shift.mechanism: shift for shift in self.hidden}
        mechanisms = {
            confounding.mechanism for confounding in confounded if confounding.confounded_with in BY_NUISANCES
        }
        further = [Confounding(shift.mechanism, "d33", Likeness.TAKEN_UP) for shift in self.hidden]
        return [
            {
                "mechanism": confounding.mechanism,
                "confounded_with": confounding.confounded_with,
                "reason": _reason(confounding, hidden.get(confounding.mechanism)),
            }
            for confounding in (*confounded, *(other for other in further if other.mechanism not in mechanisms))
        ]


def stated_d33(
    search: Search,
    problem: FittingProblem,
    fit: Mapping[str, Any],
    shifts: Sequence[HiddenShift],
    *,
    stands: bool,
    contradictory: bool,
    at_bounds: Sequence[str],
    law: LeadingLaw | None,
    unsure: float,
    skin_pc_per_n: float | None,
) -> StatedD33:
    """The d33 averaged over all answers.

    It is quotable if one answer `stands`, kinds of recordings are not `contradictory`, no parameter is at the bound of
    its search (`at_bounds`, in words), no unlisted `law` acts within the band, d33 is plausible, the answer fits the
    recordings to their noise, which is a fifth of the response at most, and no wrong declared number that would not
    show here would move d33 beyond its interval. `unsure`: relative uncertainty of all FRFs due to noise in their
    channels. `skin_pc_per_n`: the skin's declared d33.
    """
    d33 = None if problem.lines.curves else numbers.d33(search, problem, unsure)
    if d33 is None:
        return StatedD33(None)
    half_width = float(np.log(d33["high"] / d33["low"])) / 2
    hidden = [shift for shift in shifts if abs(shift.log_factor) > half_width]
    implausible = plausibility.implausibility(d33["value"])
    floor, error = fit["noise_floor_percent"], fit["after"]["rmse_percent"]
    against = {
        _ANSWERS: not stands,
        "kinds of recordings contradict each other": contradictory,
        " and ".join(at_bounds): bool(at_bounds),
        "a law that is in no list acts on it": law is not None and not _acts_outside_band(law),
        "no PVDF has such a value": implausible is not None,
        f"the error in the recordings, {in_digits(error, 2)} %, is well above their noise": not (
            error <= REACHES_NOISE * floor
        ),
        f"noise alone is {in_digits(floor, 2)} % of the response": not floor <= _LARGEST_FLOOR,
    }
    why_not = [words for words, holds in against.items() if holds]
    finding = Finding(Reason.D33_FITTED, "", "d33_pc_per_n", {"d33_pc_per_n": d33["value"], "kind": implausible})
    findings = [finding] if implausible else []
    # Hidden mechanisms matter only where there is no other reason against quoting d33.
    quotable = {**d33, "quotable": not why_not}
    stated = StatedD33(quotable, findings, () if why_not else hidden, why_not, skin_pc_per_n)
    return replace(stated, document={**d33, "quotable": False}) if stated.deciding else stated


def _acts_outside_band(law: LeadingLaw) -> bool:
    """Whether an unlisted law leaves the magnitude over most of the band unchanged: a peak, a notch, or a change of
    phase over frequency."""
    return law.law.description.axis == "frequency_hz" and (law.is_phase or law.law.description.form == "peak")


def _reason(confounding: Confounding, hidden: HiddenShift | None) -> str:
    reason = CONFOUNDED[confounding.why].format(mechanism=confounding.mechanism, other=confounding.confounded_with)
    if hidden is None or confounding.confounded_with not in BY_NUISANCES:
        return reason
    return f"{reason}; d33 would then be {_percent(hidden)} too {'large' if hidden.log_factor > 0 else 'small'}"


def _percent(hidden: HiddenShift) -> str:
    return f"{in_digits(abs(hidden.percent), 2)} %"
