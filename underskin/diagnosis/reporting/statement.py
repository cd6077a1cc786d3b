"""The statement of a report in words, three sentences at most.

First what decides how far the answer can be trusted and the verdict, then what is missing and its rivals, last what to
quote. Of an unlisted law: that no known mechanism describes this; then the law, with its size and held-out errors; last
its rivals, the usual cause, and what to quote.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import (
    EXPLAINED,
    MOST_NAMED,
    MOST_QUOTED,
    NAMED,
    NOTHING_MISSING,
    SIMPLEST,
    in_words,
    quantity_in_words,
)
from underskin.diagnosis.reporting import kinds, numbers
from underskin.diagnosis.reporting.entries import stage_clause
from underskin.diagnosis.reporting.facts import Facts
from underskin.diagnosis.reporting.unlisted_law import SHOWN_AS_HOURS, LeadingLaw
from underskin.diagnosis.selection.answers import Answer, remainder
from underskin.diagnosis.selection.other_kinds import may_hide
from underskin.diagnosis.validation.cross_validation import FAR_ABOVE
from underskin.diagnosis.validation.signatures import Power
from underskin.findings.codes import FindingCode, Lack, Lacking, Reason
from underskin.findings.finding import lacking
from underskin.findings.formatting import clause, in_digits, in_percent, of_clauses, small
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.mechanisms.base import Kind
from underskin.mechanisms.models.curves import CurveModel
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.expressions import TURN, CurveLaw
from underskin.mechanisms.unlisted.grammar import FrequencyLaw
from underskin.mechanisms.unlisted.hints import CONSTANT_PHASE, TURNED, hint
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw
from underskin.mechanisms.unlisted.vocabulary import ACTS_ON, acted_on, followed
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import IndentationRecording
from underskin.recordings.readers.text import time_zone
from underskin.units import Floats

_INSUFFICIENT = "The recordings cannot tell anything: "
_TO_CORRECT = "Nothing can be concluded before a correction: "
_CORRECTED = (Lack.CURVES_CONTRADICT, Lack.IMPOSSIBLE_DECLARATION)  # more recordings would not help
_SMALL = 5.0  # % of the response
_OVER_ANSWERS = "over the answers that remain"


def statement(facts: Facts) -> str:
    """The statement of a report.

    Contradictions and errors in the recordings come before the verdict, what the answer leaves open after it. Last is
    what to quote, or, where nothing is missing, what would have shown.
    """
    verdict, fit, alike = facts.verdict, facts.fit, facts.alike
    slips = [*_clauses(facts.findings, SLIPS), numbers.outlying_sensors(facts.problem, facts.shown)]
    slips = [words for words in slips if words]
    decides = [*(contradiction["statement"] for contradiction in facts.contradictions), *slips]
    apart = bool(decides)
    of_tried = verdict == "unexplained" and bool(facts.untried)
    doubts = (*facts.bounds, *facts.doubts) if verdict == "ambiguous" else ()
    reserves = [finding for finding in facts.findings if finding["statement"] not in doubts]
    open_questions = [*_clauses(reserves, _RESERVES), *facts.untried]
    if of_tried:  # first, since a mechanism that was not tried may be what is missing
        open_questions = [*facts.untried, *_clauses(reserves, _RESERVES)]
    quoted = [
        kinds.moduli_clause(facts.joined, facts.by_kind),
        _depths_clause(facts),
        "" if alike is None else numbers.alike_clause(alike),
        facts.d33.clause(),
    ]
    model, of_curves = SIMPLEST[facts.problem.kind], "youngs_modulus" in fit["before"]
    if facts.leading is not None and facts.law is not None:
        which = "none of the mechanisms that were tried" if of_tried else "no known mechanism"
        first = f"{which} describes this (probability {in_percent(facts.leader.probability)})"
        second, further = _law_clauses(facts, facts.leading, facts.law)
        last = [*further, _misfit_clause(fit, model, "this law") if of_curves else "", *quoted]
    else:
        first, *second = _answer_clauses(facts, doubts, all_used=not slips, all_tried=not of_tried)
        last = quoted
        if verdict in ("explained", "no_mismatch"):
            open_questions.insert(0, _reserve(fit))
        if verdict == "unexplained":
            second += [_misfit_clause(fit, model)] if of_curves else []
        elif of_curves:
            settled = verdict != "ambiguous"
            how = "over all answers" if settled else _OVER_ANSWERS
            plan = facts.diagnosis.plan
            stage = "" if settled or plan is None else stage_clause(plan.rivals)
            last = [*quoted, _modulus_clause(fit["after"], how), _platens_clause(facts), stage]
        second += facts.meanings
        if verdict == "no_mismatch":
            second, last = [*second, *last], [_power_clause(facts.power, facts.problem.kind)]
    return of_clauses([*decides, f"apart from that, {first}" if apart else first, *open_questions], second, last)


def insufficient_statement(what: Lacking | None, findings: Sequence[Mapping[str, str]]) -> str:
    """The statement on a campaign from which nothing can be concluded."""
    assert what is not None
    beginning = _TO_CORRECT if what.lack in _CORRECTED else _INSUFFICIENT
    return of_clauses([beginning + lacking(what)], _clauses(findings, SLIPS))


# For the layout of a stored report's statement on its page only.
def lacking_part(text: str) -> str:
    """What is lacking or wrong, with its full stop, from a statement of `insufficient_statement`."""
    return text.removeprefix(_INSUFFICIENT).removeprefix(_TO_CORRECT)


def _answer_clauses(facts: Facts, doubts: Sequence[str], *, all_used: bool, all_tried: bool) -> list[str]:
    """The verdict as a clause, and further clauses on its meaning.

    `doubts`: what speaks against the set, such as a parameter at the bound of its search; `all_used` says that no
    recording was left out or corrected, `all_tried` that no mechanism that might explain what is left was not tried.
    """
    answers, verdict, model = facts.search.answers, facts.verdict, SIMPLEST[facts.problem.kind]
    presence, mechanisms, idle = facts.presence, facts.mechanisms, facts.idle
    base_may_hold = any(finding.reason is Reason.SPECIMENS_DIFFER for finding in facts.diagnosis.findings)
    leader = answers[0]
    percent = in_percent(leader.probability)
    rivals = [answer for answer in answers[1:4] if answer.probability > NAMED]
    listed = _answers_in_words(rivals)
    mentioned = list(dict.fromkeys(name for answer in (leader, *rivals) for name in answer.names if name in CATALOGUE))
    if verdict == "no_mismatch":
        left = None if leader.explanation is None else remainder(leader.explanation)
        within = "the noise" if left is None else f"{100 * left[0]:.2g} % of the largest force"
        agree = f"recordings and {model} agree within {within} (probability {percent})"
        if leader.probability >= EXPLAINED or not rivals:
            added = "nothing needs to be added" if left is None else "no known mechanism needs to be added"
            return [f"{agree}, and {added}{'' if all_used else ' for those that were used'}"]
        return [f"{agree}, but they do not rule out: {listed}", _law(mentioned)]
    if verdict == "unexplained":
        which = "known mechanisms" if all_tried else "mechanisms that were tried"
        return [f"something is missing that none of the {which} describes (probability {percent})"]
    others = sum(answer.probability for answer in answers[1:]) - sum(answer.probability for answer in rivals)
    further = f", or other sets, {in_percent(others)} in total" if others > NAMED else ""
    listed += further if listed else ""
    by_sets = f"the sets of mechanisms are: {_answers_in_words([leader, *rivals])}{further}" if rivals else ""
    if verdict == "explained":
        missing, by_mechanism = _lacking(leader, presence, mechanisms)
        means = _law(leader.names) or _strengths(mechanisms)
        return [f"{model} lacks {missing}", *([by_sets] if by_mechanism else []), means]
    certain = [group for group in presence if group["probability"] >= EXPLAINED]
    if certain and not idle and not doubts:
        named = " and ".join(_group_in_words(group) for group in certain)
        if any(len(group["mechanisms"]) > 1 for group in certain):
            return [f"{named}: these recordings cannot tell which", by_sets]
        alone = {group["mechanisms"][0] for group in certain}
        strengths = _strengths([mechanism for mechanism in mechanisms if mechanism["name"] in alone])
        missing = f"{model} lacks {named}, but these recordings cannot tell what else"
        return [missing, strengths, by_sets, _law(mentioned)]
    but = list(doubts)
    but += [f"the 95 % intervals of {in_words(idle)} hold the values at which nothing changes"] if idle else []
    but += [f"these rivals remain: {listed}"] if listed else []
    but = but or [f"many rivals remain, each below {in_percent(NAMED)}"]
    shared = [group for group in certain if group["probability"] > leader.probability + NAMED]
    common = " and ".join(map(_group_in_words, shared))
    doubtful = bool(idle or doubts) and leader.names != (NOTHING_MISSING,) and not base_may_hold
    misfit = f"what is certain is that {model} does not describe the recordings" if doubtful else ""
    lead = f"best explained by {in_words(leader.names)} ({percent})"
    if rivals and rivals[0].probability > leader.probability:  # as all sets of known mechanisms together lead
        total = in_percent(sum(answer.probability for answer in answers if answer.outcome == leader.outcome))
        lead = f"known mechanisms explain this ({total} together), best {in_words(leader.names)} ({percent})"
    all_answers = f"in most of the remaining answers: {common}" if common else ""
    return [f"{lead}, but {', and '.join(but)}", all_answers, misfit, _law(mentioned)]


def _lacking(
    leader: Answer, presence: Sequence[Mapping[str, Any]], mechanisms: Sequence[Mapping[str, Any]]
) -> tuple[str, bool]:
    """The mechanisms of the leading set, and whether each has its own probability instead of that of the set.

    It has where it is also in other sets, or these hold an indistinguishable one in its place.
    """
    group, least = next(iter(presence), None), leader.probability + NAMED
    twins = group is not None and len(group["mechanisms"]) > 1 and set(leader.names) < set(group["mechanisms"])
    if group is not None and twins and group["probability"] > least:
        return f"{_group_in_words(group)}, rather {in_words(leader.names)} ({in_percent(leader.probability)})", True
    present = {mechanism["name"]: mechanism["probability"] for mechanism in mechanisms}
    if not any(present.get(name, 0.0) > least for name in leader.names):
        return f"{in_words(leader.names)} (probability {in_percent(leader.probability)})", False
    single_groups = [{"mechanisms": [name], "probability": present[name]} for name in leader.names]
    return " and ".join(map(_group_in_words, single_groups)), True


def _group_in_words(group: Mapping[str, Any]) -> str:
    named = " or ".join(in_words([name]) for name in group["mechanisms"])
    return f"{named} ({in_percent(group['probability'])})"


def _answers_in_words(answers: Sequence[Answer]) -> str:
    return ", or ".join(f"{in_words(answer.names)} ({in_percent(answer.probability)})" for answer in answers)


def _law(names: Sequence[str]) -> str:
    """What a mechanism is; empty for several, which a page explains one by one."""
    return f"{in_words(names)}: {small(CATALOGUE[names[0]].plain)}" if len(names) == 1 else ""


def _strengths(mechanisms: Sequence[Mapping[str, Any]]) -> str:
    """Name, value and interval of the first parameter of each of a few mechanisms: "contact resonance has a tip mass of
    6.02 g (5.9 to 6.1)"."""
    strengths = []
    for mechanism in mechanisms[:MOST_NAMED]:
        for parameter in mechanism["parameters"][:1]:
            value, low, high = (in_digits(parameter[key], 3) for key in numbers.ENDS)
            unit = "" if parameter["unit"] == "-" else f" {parameter['unit']}"
            interval = "at or beyond the end of its search" if parameter.get("at_bound") else f"{low} to {high}"
            name = quantity_in_words(parameter["name"])
            article = "an" if name[0] in "aeiou" else "a"
            strengths.append(f"{in_words([mechanism['name']])} has {article} {name} of {value}{unit} ({interval})")
    return ", ".join(strengths)


def _reserve(fit: Mapping[str, Any]) -> str:
    """A reserve where held-out recordings are predicted far worse than the noise."""
    missed, floor = fit["after"]["heldout_rmse_percent"], fit["noise_floor_percent"]
    if missed is None or floor is None or missed <= FAR_ABOVE * floor:
        return ""
    return f"but what was held out is missed by {in_digits(missed, 2)} %, where noise gives {in_digits(floor, 2)} %"


def _depths_clause(facts: Facts) -> str:
    """A clause on the depth of indentation over radius and declared thickness; empty for other recordings."""
    model, campaign = facts.shown.model, facts.problem.lines.campaign
    curves = campaign.of(IndentationRecording)
    if not curves or not isinstance(model, CurveModel):
        return ""
    contacts = facts.shown.point.fit[model.contact_points].tolist()
    depths = [float(curve.displacement_mm.max()) - at for curve, at in zip(curves, contacts, strict=True)]
    over = max(depth / curve.indenter_radius_mm for depth, curve in zip(depths, curves, strict=True))
    whole = " (by the law of the whole sphere)" if over > PARABOLOID else ""
    thickness = campaign.skin.thickness_mm
    of_thickness = "" if thickness is None else f", {in_digits(max(depths) / thickness, 2)} of the thickness"
    return f"pressed to {in_digits(over, 2)} of the radius{whole}{of_thickness}"


def _modulus_clause(after: Mapping[str, Any], how: str) -> str:
    """A clause on E of curves, and on the answers under which it holds."""
    modulus = after.get("youngs_modulus")
    if modulus is None:
        return "Young's modulus: none that these curves determine"
    if modulus.get("at_bound"):
        bound = f"{modulus['value']:.3g} {modulus['unit']}"
        return f"Young's modulus {how} lies at or beyond {bound}, where its search ends: no result"
    if not numbers.is_known(modulus):
        low, high = (f"{modulus[end]:.3g}" for end in ("low", "high"))
        return f"Young's modulus {how} is not known: {low} to {high} {modulus['unit']} (95 %)"
    return f"Young's modulus {how}: {numbers.in_sentence(modulus)}"


def _platens_clause(facts: Facts) -> str:
    """A clause on the ends of blocks of one shape, which raise E unseen where the platens hold them."""
    shown = () if facts.shown is None else facts.shown.names
    hidden = may_hide(facts.problem.lines.campaign, facts.problem.lines.mechanisms.named)
    raised = [100 * np.expm1(max(values)) for name, values in hidden.items() if name not in shown]
    if not raised or raised[0] < _SMALL:
        return ""
    return (
        f"the interval allows for platens that hold the ends, which raise it by up to {in_digits(raised[0], 2)} % and "
        "do not show on samples of one shape: press one of another height"
    )


def _misfit_clause(fit: Mapping[str, Any], model: str, *law: str) -> str:
    """A clause on the residual of curves under the base model, and under the best set of mechanisms, with `law` an
    unlisted law among them."""
    before, after, added = fit["before"], fit["after"], in_words([*law, *fit["mechanisms"]])
    modulus = before.get("least_squares_modulus_mpa")
    base_words = f"{model} alone" + (f", with Young's modulus {modulus:.3g} MPa," if modulus else "")
    text = f"{base_words} leaves {in_digits(before['rmse_percent'], 2)} % of the force (root mean square)"
    if not added:
        return text
    left = in_digits(after["rmse_percent"], 2)
    return f"{text}, with {added} {left} %; {_modulus_clause(after, _OVER_ANSWERS)}"


def _power_clause(power: Sequence[Power], kind: Kind) -> str:
    """A clause on the mechanisms that the recordings would have shown."""
    all_of_them = sum(kind in mechanism.kinds for mechanism in CATALOGUE.values())
    shown = [limit.mechanism for limit in power if limit.smallest_visible_percent <= _SMALL]
    if not shown:
        return f"none of the {all_of_them} known mechanisms would have shown with {_SMALL:g} % of the response"
    names = ", ".join(in_words([name]) for name in shown)
    which = f"{len(shown)} would have shown with {_SMALL:g} % of the response"
    return f"of the {all_of_them} known mechanisms {which}: {names}"


SLIPS = (
    *(FindingCode.NO_RESPONSE, FindingCode.IMPOSSIBLE_GEOMETRY, FindingCode.NO_FINITE_LINE, FindingCode.REFUSED),
    *(FindingCode.IMPOSSIBLE_NUMBER, FindingCode.SERIES_NOT_USABLE, FindingCode.CURVE_NOT_USABLE),
    *(
        FindingCode.SENSORS_EXCHANGED,
        FindingCode.WEAK,
        FindingCode.STRONG,
        FindingCode.CONJUGATED,
        FindingCode.GAIN_STEPS,
    ),
    FindingCode.WARM_UP,
    *(FindingCode.FORCE_SATURATES, FindingCode.READING_STEPS, FindingCode.FORCE_STEPS, FindingCode.PERIODIC_ERROR),
    *(
        FindingCode.UNITS_OFF_BY_1000,
        FindingCode.CHANNELS_SWAPPED,
        FindingCode.SIGN_FLIPPED,
        FindingCode.MAINS_IN_CHARGE,
        FindingCode.OUT_OF_DOMAIN,
        FindingCode.FAR_CONTACTS,
    ),
    *(FindingCode.CONTACTS_KEPT, FindingCode.DUPLICATED_RECORDING),
)
_RESERVES = (
    *(
        FindingCode.TIP_SHAPE,
        FindingCode.THICKNESS_UNKNOWN,
        FindingCode.THICKNESS_DIFFERS,
        FindingCode.PULLED_OR_PRESSED,
        FindingCode.IMPLAUSIBLE_D33,
        FindingCode.REMAINDER,
    ),
    *(FindingCode.HELD_OUT_NO_BETTER, FindingCode.UNUSUAL_SCATTER),
)


def slip_clauses(findings: Sequence[Mapping[str, str]], stated: Collection[FindingCode] = ()) -> list[str]:
    """Clauses on the slips of a report, but for those `stated` elsewhere."""
    return _clauses(findings, [code for code in SLIPS if code not in stated])


def _clauses(findings: Sequence[Mapping[str, str]], decisive: Sequence[FindingCode]) -> list[str]:
    chosen = sorted(
        (finding for finding in findings if finding["code"] in decisive),
        key=lambda finding: decisive.index(FindingCode(finding["code"])),
    )
    further = Counter(finding["code"].replace("_", " ") for finding in chosen[MOST_QUOTED:])
    counted = [f"{count} of {code}" for code, count in further.items()]
    more = [f"further findings: {', '.join(counted)}"] if counted else []
    return [*map(_quoted, chosen[:MOST_QUOTED]), *more]


def _quoted(finding: Mapping[str, str]) -> str:
    text = clause(finding["statement"])
    return f"recording {finding['recording']!r}: {text}" if finding["recording"] else text


_HERTZ = ("preload_n", "indenter_radius_mm")  # Hertz's contact radius grows with their cube roots
_DELAY = 0.5  # exponent of a phase above which it is more like a delay than a loss angle


def _law_clauses(facts: Facts, leading: LeadingLaw, document: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """Clauses on an unlisted law with its size and held-out errors, and on its rivals and its usual cause; `document`
    is the report's `unnamed`."""
    law, others = leading.law, in_words(leading.other_names)
    acts_on, axis = law.description.acts_on, law.description.axis
    besides = f" besides {others}" if others else ""
    floor, held = facts.fit["noise_floor_percent"], document["heldout_rmse_percent"]
    worth = _worth(held, floor, facts.problem.lines.held_out, f" and {others}" if others else "")
    altered = _altered(leading, document)
    second = [f"what is missing{besides} {_does(leading)}{_follows(leading)}: {_size(leading)}", worth, altered]
    rivals = [
        f"{acted_on(rival['acts_on'], rival['axis'])} over {followed(rival['axis'])}, {rival['form']} "
        f"({in_percent(rival['probability'])} of it)"
        for rival in document["rivals"][:2]
    ]
    also = f"in these recordings this may also be {', or '.join(rivals)}" if rivals else ""
    # The share of laws of any form that act on the same quantity along the same axis
    same = (rival for rival in document["rivals"] if (rival["acts_on"], rival["axis"]) == (acts_on, axis))
    share = document["probability"] + sum(rival["probability"] for rival in same)
    if facts.leader.probability * share < EXPLAINED or altered or leading.is_constant:
        return second, [also]
    if leading.is_constant_phase:
        axis = CONSTANT_PHASE
    return second, [also, hint(acts_on, TURNED if _is_way_back(leading) else axis, facts.problem.kind)]


def _is_way_back(leading: LeadingLaw) -> bool:
    return isinstance(leading.law, CurveLaw) and leading.law.shape.variant == TURN


def _altered(leading: LeadingLaw, document: Mapping[str, Any]) -> str:
    """That a law is a known one with another exponent, or the order of a high pass that makes lines fall off towards
    low frequencies; empty otherwise."""
    law = leading.law
    stated = {parameter["name"]: [parameter[key] for key in numbers.ENDS] for parameter in document["parameters"]}
    change, exponent = stated.get("change"), stated.get("exponent")
    is_power = law.description.form == "power"
    of_radius = isinstance(law, RecordingLaw) and law.description.acts_on == "contact_radius"
    if change and is_power and of_radius and law.description.axis in _HERTZ:
        grows = f"the contact radius grows with {followed(law.description.axis)} to the power"
        value = _with_interval(1 / 3 + end for end in change)
        return f"this is Hertz's law with another exponent: {grows} {value} in place of 1/3"
    if not isinstance(law, FrequencyLaw) or not exponent:
        return ""
    if is_power and law.variant == "phase" and exponent[0] > _DELAY:
        grows = "its phase grows with frequency to the power"
        return f"this is a delay with another exponent: {grows} {_with_interval(exponent)} in place of 1"
    if law.variant == "high_pass" and exponent[0] >= 0:
        return f"this is a high pass of order {_with_interval(exponent)}, where an amplifier's is of order 1"
    return ""


def _with_interval(ends: Iterable[float]) -> str:
    value, low, high = ends
    return f"{value:.2f} ({low:.2f} to {high:.2f})"


def _does(leading: LeadingLaw) -> str:
    law = leading.law
    acts_on = law.description.acts_on
    of_curves = {
        "position": "moves the surface along the travel",
        "gain": "changes the gain of the cell",
        "force": "adds to the force that is read",
    }
    if leading.is_constant_phase:
        return "turns the frequency response"
    if isinstance(law, CurveLaw) and acts_on in of_curves:
        return of_curves[acts_on]
    return {
        "position": "moves the place of the contact",
        "frequency_response": "changes the frequency response",
        "gain": "changes the gain",
        "force": "changes the force on the skin",
    }.get(acts_on, f"changes the {ACTS_ON[acts_on][0]}")


def _follows(leading: LeadingLaw) -> str:
    if leading.is_constant_phase:
        return " by the same angle at all frequencies"
    return ", the same in all recordings" if leading.is_constant else f" with {_axis_words(leading)}"


def _axis_words(leading: LeadingLaw) -> str:
    words = followed(leading.law.description.axis)
    if leading.axis is not None and leading.axis.relative:
        return f"{words} over its own"
    if leading.law.description.axis in SHOWN_AS_HOURS:
        return f"{words} ({time_zone()})"
    return words


def _size(leading: LeadingLaw) -> str:
    """The largest change with its interval and where it occurs: "−8 % (−10 to −6) at 14:00"."""
    at, size, deviation = leading.largest()
    law, half = leading.law, SDS_OF_95 * deviation
    ends = np.array([size, size - half, size + half])
    where = f" {location}" if (location := _where(leading, at)) else ""
    if law.description.acts_on in ("force", "position"):
        return f"{_signed(ends, ' N' if law.description.acts_on == 'force' else ' mm')}{where}"
    if isinstance(law, LagLaw) and law.dispersion == "corner":
        value, low, high = law.lowest_hz * ends
        return f"lines below a corner of {value:.3g} Hz ({low:.3g} to {high:.3g}) fall off{where}"
    if isinstance(law, LagLaw) and law.dispersion == "power":
        return f"by a power of frequency of {_signed(-ends[[0, 2, 1]], '')}{where}"
    if leading.is_phase:
        return f"the phase by {_signed(np.degrees(ends), '°')}{where}"
    if isinstance(law, LagLaw):
        return f"the phase by {_signed(-np.degrees(ends[[0, 2, 1]]), '°')}{where}"
    return f"{_signed(100 * ends, ' %')}{where}"


def _signed(ends: Floats, unit: str) -> str:
    value, low, high = ends
    return f"{value:+.3g}{unit} ({low:+.3g} to {high:+.3g})"


def _where(leading: LeadingLaw, at: float) -> str:
    axis = leading.axis
    if leading.is_constant or leading.is_constant_phase:
        return ""
    if _is_way_back(leading):
        return "on the way back"
    if axis is None:
        return f"at {in_digits(at, 3)} Hz"
    if axis.words:
        return f"at {axis.words[round(at)]}"
    if axis.name == "time_of_day":
        return f"at {int(at):02d}:{int(60 * (at % 1)):02d}"
    if axis.name == "recorded_at":
        return f"{in_digits(at, 3)} h after the first midnight"
    if axis.name == "order":
        return f"at recording {in_digits(at + 1, 3)}"
    return f"at {in_digits(at, 3)}{'' if axis.unit == '-' else ' ' + axis.unit}"


def _worth(held: Mapping[str, float | None], floor: float | None, what: str, others: str) -> str:
    noise = "" if not floor else f" (noise {in_digits(floor, 2)} %)"
    if held["before"] is None or held["after"] is None:
        return f"too few {what} to hold any out"
    after, before = in_digits(held["after"], 2), in_digits(held["before"], 2)
    if held["after"] >= held["before"]:
        return f"it predicts {what} held out no better: to {after} % instead of {before} %{noise}"
    return f"with it{others}, {what} held out are predicted to {after} % instead of {before} %{noise}"
