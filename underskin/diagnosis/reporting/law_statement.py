"""The statement of a report in words, three sentences at most.

First what decides how far the answer can be trusted and the verdict, then what is missing and its rivals, last what to
quote. `HINTS` says which physics usually causes an unlisted law, by the quantity that it acts on and the axis that it
follows; docs/unlisted.md has the same table.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, SIMPLEST, in_words
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.diagnosis.reporting.unlisted_law import SHOWN_AS_HOURS, LeadingLaw
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.validation.signatures import Power
from underskin.findings.codes import FindingCode
from underskin.findings.english import lacking
from underskin.findings.formatting import in_digits, in_percent
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.base import Kind, Mechanism, Stage
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.expressions import TURN, CurveLaw
from underskin.mechanisms.unlisted.grammar import FrequencyLaw
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.mechanisms.unlisted.vocabulary import ACTS_ON, acted_on, followed
from underskin.recordings.readers.calendar_times import time_zone

_END = re.compile(r"([.?!]) +(?=[\"'(]?[A-Z])")  # end of a sentence within a clause
_END_OR_STOP = re.compile(r"([.?!]) +")
_STOP = re.compile(r"\. +")
_NAME = re.compile(r"\w+('s|s')")  # Hertz's, Mullins': keeps its capital
_SYMBOLS = ("d33",)  # keep their small letter at the beginning of a sentence


def of_clauses(*sentences: Sequence[str], names: Sequence[str] = ()) -> str:
    """One sentence from the clauses of each of `sentences`; empty clauses, and sentences without any, are left out.

    Within a sentence no full stop is followed by a space, so that the sentences can be split again. `names` of
    campaigns and skins are not split: "Palm 2. Upper" is no end of a sentence.

    >>> of_clauses(["one slip: given in µm? Left out", "apart from that, all agrees"], [], ["d33 to quote: 14 pC/N"])
    'One slip: given in µm? – left out; apart from that, all agrees. d33 to quote: 14 pC/N.'
    """
    protected_names = {name: _END_OR_STOP.sub("\\1\N{NO-BREAK SPACE}", name) for name in names}

    def as_clause(text: str) -> str:
        for name, protected in protected_names.items():
            text = text.replace(name, protected)
        return clause(text)

    filled = ([as_clause(text) for text in clauses if text] for clauses in sentences)
    return " ".join(f"{capital('; '.join(map(small, clauses)))}." for clauses in filled if clauses)


def clause(text: str) -> str:
    """A text of one or several sentences as part of a sentence, without a full stop at its end."""
    first, *parts = _END.split(text.strip().rstrip("."))
    for mark, following in zip(parts[::2], parts[1::2], strict=True):
        first += f"{'; ' if mark == '.' else f'{mark} – '}{small(following)}"
    return _STOP.sub(".\N{NO-BREAK SPACE}", first)


def capital(text: str) -> str:
    """The text with a capital at its beginning, unless it begins with a symbol."""
    return text if text.startswith(_SYMBOLS) else text[:1].upper() + text[1:]


def small(text: str) -> str:
    """The text with a small letter at its beginning, unless it begins with a symbol or a name."""
    plain = text[1:2].islower() or text.startswith("A ")
    return text[:1].lower() + text[1:] if plain and not _NAME.match(text) else text


_WORTH_NAMING = 0.02
_FAR_ABOVE = 2.0  # times the noise: a held-out error that the first sentence mentions
_INSUFFICIENT = "The recordings cannot tell anything: "
_TO_CORRECT = "Nothing can be told before a correction: "
_CORRECTED = (Lack.CURVES_CONTRADICT, Lack.IMPOSSIBLE_DECLARATION)  # more recordings would not help
_SMALL = 5.0  # % of the response
_STATED = 3  # mechanisms whose strengths are given


@dataclass(frozen=True)
class StatementContext:
    """Clauses of a statement apart from the answer itself.

    `slips` and `contradictions` decide how far any answer can be trusted, `reserves` are what this answer leaves open;
    `quoted` are on d33, and on E by kind of recording.
    """

    slips: Sequence[str] = ()
    contradictions: Sequence[str] = ()
    reserves: Sequence[str] = ()
    quoted: Sequence[str] = ()

    def first(self, verdict: str, *reserve: str) -> list[str]:
        """The clauses of the first sentence: contradictions and errors in the recordings come before the verdict."""
        decides = [*self.contradictions, *self.slips]
        return [*decides, f"apart from that, {verdict}" if decides else verdict, *reserve, *self.reserves]


@dataclass(frozen=True)
class AnswerFacts:
    """Facts on the leading answer apart from its probability.

    `groups` are the report's `presence`, the most probable first, `idle` the mechanisms that may as well have no
    effect, `at_bounds` the parameters at a bound of their search, `mechanisms` those of the report, and `meanings` what
    their values mean together.
    """

    groups: Sequence[Mapping[str, Any]] = ()
    idle: Sequence[str] = ()
    at_bounds: Sequence[str] = ()
    mechanisms: Sequence[Mapping[str, Any]] = ()
    meanings: Sequence[str] = ()


_NO_CONTEXT, _NO_FACTS = StatementContext(), AnswerFacts()


def answer_statement(
    answers: Sequence[Answer],
    verdict: str,
    kind: Kind = "frf",
    fit: Mapping[str, Any] | None = None,
    around: StatementContext = _NO_CONTEXT,
    of_answer: AnswerFacts = _NO_FACTS,
    shape: str = "",
    power: Sequence[Power] = (),
) -> str:
    """The statement of a report: three sentences at most.

    First the verdict, after what decides how far it can be trusted; then what is missing, its rivals, or the `shape` of
    the residual; last what to quote, or, where nothing is missing, what would have shown (`power`). `fit` is the
    report's; of curves it has the modulus under the stated answer, or the residual of the base model.
    """
    model = SIMPLEST[kind]
    stated, *means = _answer(answers, verdict, model, of_answer, all_used=not around.slips)
    reserve = _reserve(fit) if fit is not None and verdict in ("explained", "no_mismatch") else ""
    of_curves = fit is not None and "youngs_modulus" in fit["before"]
    modulus = ""
    if fit is not None and of_curves and verdict != "unexplained":
        settled = verdict != "ambiguous"
        how = "under this answer" if settled else f"with {in_words(fit['mechanisms'])}, which is not settled"
        modulus = _modulus_clause(fit["after"], how)
    quoted = [*around.quoted, modulus]
    first = around.first(stated, reserve)
    if verdict == "no_mismatch":
        return of_clauses(first, [*means, *quoted], [power_clause(power, kind)])
    misfit = [misfit_clause(fit, model)] if fit is not None and of_curves and verdict == "unexplained" else []
    return of_clauses(first, [*means, shape, *misfit, *of_answer.meanings], quoted)


def _answer(
    answers: Sequence[Answer], verdict: str, model: str, of_answer: AnswerFacts, *, all_used: bool
) -> tuple[str, ...]:
    """The verdict as a clause, and further clauses on its meaning."""
    leader = answers[0]
    percent = in_percent(leader.probability)
    rivals = [answer for answer in answers[1:4] if answer.probability > _WORTH_NAMING]
    listed = _answers_in_words(rivals)
    mentioned = dict.fromkeys(name for answer in (leader, *rivals) for name in answer.names if name in CATALOGUE)
    if verdict == "no_mismatch":
        agree = f"recordings and {model} agree within the noise (probability {percent})"
        if leader.probability >= EXPLAINED or not rivals:
            return (f"{agree}, and nothing needs to be added{'' if all_used else ' for those that were used'}",)
        return f"{agree}, but they do not rule out: {listed}", _law(tuple(mentioned))
    if verdict == "unexplained":
        return (f"something is missing that none of the known mechanisms describes (probability {percent})",)
    by_sets = f"by sets: {_answers_in_words([leader, *rivals])}" if rivals else ""
    if verdict == "explained":
        lacking, by_mechanism = _lacking(leader, of_answer)
        means = _law(leader.names) or _strengths(of_answer.mechanisms)
        return f"{model} lacks {lacking}", *([by_sets] if by_mechanism else []), means
    idle = of_answer.idle
    certain = [group for group in of_answer.groups if group["probability"] >= EXPLAINED]
    if certain and not idle and not of_answer.at_bounds:
        named = " and ".join(_group_in_words(group) for group in certain)
        if any(len(group["mechanisms"]) > 1 for group in certain):
            return f"{named}: these recordings cannot tell which", by_sets
        return f"{model} lacks {named}, but these recordings cannot tell what else", by_sets, _law(tuple(mentioned))
    but = list(of_answer.at_bounds)
    but += [f"the 95 % intervals of {in_words(idle)} hold the values at which nothing changes"] if idle else []
    but += [f"these rivals remain: {listed}"] if listed else []
    but = but or [f"many rivals remain, each below {in_percent(_WORTH_NAMING)}"]
    doubtful = bool(idle or of_answer.at_bounds) and leader.names != (NOTHING_MISSING,)
    misfit = f"what is certain is that {model} does not describe the recordings" if doubtful else ""
    lead = f"best explained by {in_words(leader.names)} ({percent})"
    if rivals and rivals[0].probability > leader.probability:  # as all sets of known mechanisms together lead
        total = sum(answer.probability for answer in answers if answer.kind == leader.kind)
        lead = (
            f"known mechanisms explain this ({in_percent(total)} together), best {in_words(leader.names)} ({percent})"
        )
    return (
        f"{lead}, but {', and '.join(but)}",
        misfit,
        _law(tuple(mentioned)),
    )


def _lacking(leader: Answer, of_answer: AnswerFacts) -> tuple[str, bool]:
    """The mechanisms of the leading set, and whether each has its own probability instead of that of the set.

    It has where it is also in other sets, or these hold an indistinguishable one in its place.
    """
    group, least = next(iter(of_answer.groups), None), leader.probability + _WORTH_NAMING
    twins = group is not None and len(group["mechanisms"]) > 1 and set(leader.names) < set(group["mechanisms"])
    if group is not None and twins and group["probability"] > least:
        return f"{_group_in_words(group)}, rather {in_words(leader.names)} ({in_percent(leader.probability)})", True
    present = {mechanism["name"]: mechanism["probability"] for mechanism in of_answer.mechanisms}
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
    """The first parameter of each of a few mechanisms."""
    strengths = [
        (in_words([mechanism["name"]]), parameter_in_words(mechanism["parameters"][0]))
        for mechanism in mechanisms[:_STATED]
        if mechanism["parameters"]
    ]
    return ", ".join(f"{name} has {'an' if strength[0] in 'aeiou' else 'a'} {strength}" for name, strength in strengths)


def parameter_in_words(parameter: Mapping[str, Any]) -> str:
    """Name, value and interval of a parameter: "tip mass of 6.02 g (5.9 to 6.1)"."""
    value, low, high = (in_digits(parameter[key], 3) for key in ("value", "low", "high"))
    unit = "" if parameter["unit"] == "-" else f" {parameter['unit']}"
    interval = "at or beyond the end of its search" if parameter.get("at_bound") else f"{low} to {high}"
    return f"{parameter['name'].replace('_', ' ')} of {value}{unit} ({interval})"


def _reserve(fit: Mapping[str, Any]) -> str:
    """A reserve where held-out recordings are predicted far worse than the noise."""
    missed, floor = fit["after"]["heldout_rmse_percent"], fit["noise_floor_percent"]
    if missed is None or floor is None or missed <= _FAR_ABOVE * floor:
        return ""
    return f"but what was held out is missed by {in_digits(missed, 2)} %, where noise gives {in_digits(floor, 2)} %"


def insufficient_statement(what: Lacking | None, slips: Sequence[str]) -> str:
    """The statement on a campaign from which nothing can be concluded."""
    assert what is not None
    return of_clauses([f"{_TO_CORRECT if what.lack in _CORRECTED else _INSUFFICIENT}{lacking(what)}"], slips)


# For the layout of a stored report's statement on its page only.
def lacking_part(statement: str) -> str:
    """What is lacking or wrong, with its full stop, from a statement of `insufficient_statement`."""
    return statement.removeprefix(_INSUFFICIENT).removeprefix(_TO_CORRECT)


def first_and_rest(statement: str) -> tuple[str, str]:
    """The first sentence of a statement, the verdict, without its full stop, and the other sentences."""
    first, _, rest = statement.partition(". ")
    return first.rstrip("."), rest


def _modulus_clause(after: Mapping[str, Any], how: str) -> str:
    """A clause on E of curves, and on the answer under which it holds."""
    modulus = after["youngs_modulus"]
    if modulus.get("at_bound"):
        bound = f"{modulus['value']:.3g} {modulus['unit']}"
        return f"Young's modulus {how} lies at or beyond {bound}, where its search ends: no result"
    interval = f"95 %: {modulus['low']:.3g} to {modulus['high']:.3g}"
    return f"Young's modulus {how}: {modulus['value']:.3g} {modulus['unit']} ({interval})"


def misfit_clause(fit: Mapping[str, Any], model: str, law: Sequence[str] | None = None) -> str:
    """A clause on the residual of curves under the base model, and under the best set of mechanisms.

    With `law`, the latter is an unlisted law together with these mechanisms.
    """
    before, after, names = fit["before"], fit["after"], fit["mechanisms"]
    modulus = before.get("least_squares_modulus_mpa")
    base_words = f"{model} alone" + (f", with Young's modulus {modulus:.3g} MPa," if modulus else "")
    sentence = f"{base_words} leaves {in_digits(before['rmse_percent'], 2)} % of the force (root mean square)"
    added = in_words(names) if names else ""
    if law is not None:
        added = f"this law and {in_words(law)}" if law else "this law"
    addition = f", with {added} {in_digits(after['rmse_percent'], 2)} %" if added else ""
    modulus = _modulus_clause(after, f"with {added}") if added and "youngs_modulus" in after else ""
    return f"{sentence}{addition}" + (f"; {modulus}" if modulus else "")


def power_clause(power: Sequence[Power], kind: Kind) -> str:
    """A clause on the mechanisms that the recordings would have shown."""
    all_of_them = sum(kind in mechanism.kinds for mechanism in CATALOGUE.values())
    shown = [limit.mechanism for limit in power if limit.smallest_visible_percent <= _SMALL]
    if not shown:
        return f"none of the {all_of_them} known mechanisms would have shown with {_SMALL:g} % of the response"
    which = f"these {len(shown)} would each have shown with {_SMALL:g} % of the response"
    return f"of the {all_of_them} known mechanisms {which}: {', '.join(in_words([name]) for name in shown)}"


_ANY = ""
TURNED = "time_s, on the way back"
CONSTANT_PHASE = "frequency_hz, the same angle"
HINTS: Mapping[tuple[str, str], str] = {
    ("modulus", "recorded_at"): "A skin that warms up, cures on or swells would do this; note its temperature.",
    ("modulus", "time_of_day"): "The temperature of the room would do this; at equal temperature it should vanish.",
    ("modulus", "order"): "A skin that warms up or softens with use would do this; repeat in another order.",
    ("modulus", "previous_preload_n"): "Softening by the press before (Mullins' effect) would do this; wait longer "
    "between recordings, or come to each preload from the same one.",
    ("modulus", "load_cycles"): "Fatigue or Mullins' effect would do this.",
    ("modulus", "dwell_s"): "Relaxation that the known creep does not follow would do this.",
    ("modulus", "x_mm"): "Uneven mixing or curing along x would do this.",
    ("modulus", "y_mm"): "Uneven mixing or curing along y would do this.",
    ("modulus", "preload_n"): "Stiffening or softening by another exponent than the known law's would do this.",
    ("thickness", "recorded_at"): "Swelling or shrinking would do this; measure the thickness again.",
    ("thickness", "order"): "Swelling, shrinking or a skin that is replaced would do this.",
    ("thickness", "x_mm"): "A mould that is not level gives a wedge along x; measure the thickness at both ends.",
    ("thickness", "y_mm"): "A mould that is not level gives a wedge along y; measure the thickness at both ends.",
    ("contact_radius", "preload_n"): "A contact that grows with another power of the force than Hertz's would do this: "
    "roughness, a worn sphere.",
    ("contact_radius", "order"): "A sphere that was changed, worn or dirty from then on would do this; look at it.",
    ("contact_radius", "recorded_at"): "A sphere that was changed or wears would do this; look at it.",
    ("force", "preload_n"): "Friction in the guide takes a constant part of the force; a cell below the skin would "
    "show it.",
    ("force", "previous_preload_n"): "Friction or hysteresis of the stage would do this; come to each preload from "
    "the same side.",
    ("force", "recorded_at"): "A cell whose zero drifts would do this; set it to zero before each recording.",
    ("force", "time_of_day"): "A cell whose zero follows the temperature would do this.",
    ("force", "order"): "A cell whose zero drifts would do this; set it to zero before each recording.",
    ("gain", "recorded_at"): "An amplifier that drifts, or d33 that follows the temperature, would do this; repeat the "
    "first recording at the end.",
    ("gain", "time_of_day"): "Temperature or humidity of the room would do this; at equal temperature it should "
    "vanish.",
    ("gain", "order"): "An amplifier or a plug that was changed on the way would do this; repeat the first recording.",
    ("gain", "previous_preload_n"): "A film that remembers the press before would do this; wait longer in between.",
    ("gain", "x_mm"): "A film that was drawn or poled unevenly along x would do this.",
    ("gain", "y_mm"): "A film that was drawn or poled unevenly along y would do this.",
    ("gain", "dynamic_force_n"): "A film or an amplifier that is not linear in the force would do this.",
    ("gain", "preload_n"): "A film whose d33 depends on the stress otherwise than the known law has it would do this.",
    ("gain", "load_cycles"): "Ageing by another law than the known one would do this.",
    ("position", "order"): "A stage that loses steps or runs round would do this; return to its zero now and then.",
    ("position", "recorded_at"): "A frame that creeps or warms up would do this.",
    ("position", "time_of_day"): "A frame that follows the temperature would do this.",
    ("position", "previous_preload_n"): "Play of the stage would do this; come to each place from the same side.",
    ("modulus", "displacement_mm"): "A body that is not the same at all depths, or another law of stress and strain "
    "than the known one, would do this; press with a sphere of another radius.",
    ("modulus", "time_s"): "Relaxation that the known creep does not follow would do this, or a body that dries; hold "
    "longer, and at two speeds.",
    ("gain", "force_n"): "A cell or a cantilever that is not linear would do this; calibrate it at several forces.",
    ("force", "time_s"): "A cell whose zero drifts otherwise than straight would do this; record longer in the air, "
    "before and after.",
    ("force", "displacement_mm"): "Something that touches on the way, or a screw with a periodic error, would do "
    "this; record in the air.",
    ("position", "displacement_mm"): "A surface that is rough or dirty, a tip that is no sphere, or an encoder with a "
    "periodic error would do this; look at the tip, and press elsewhere.",
    ("position", "time_s"): "A frame that warms up or creeps, or a surface that does not come back, would do this; "
    "press a stiff block in its place.",
    ("modulus", TURNED): "A body that softens as it is pressed, or friction that turns with the sphere, would do this; "
    "press again at the same place.",
    ("force", TURNED): "Friction in the guide would do this; move through the air and back.",
    (
        "position",
        TURNED,
    ): "Play of the stage, or a surface that does not come back, would do this; press a stiff block.",
    ("frequency_response", "frequency_hz"): "A resonance of the frame, an electronic filter or a cable would do this; "
    "record a stiff steel block in place of the skin.",
    (
        "frequency_response",
        CONSTANT_PHASE,
    ): "The reference phase of a lock-in amplifier, or a sensor's loss angle, would "
    "do this; record a stiff steel block in place of the skin.",
    ("frequency_response", "dynamic_force_n"): "Friction that grows with the amplitude would do this; record at "
    "several dynamic forces.",
    ("frequency_response", "preload_n"): "Losses in the contact that grow with the preload would do this.",
    ("frequency_response", "recorded_at"): "A clock or filter that drifts would do this.",
    ("frequency_response", _ANY): "Electronics or a frame that follow this axis would do this.",
}
OF_BLOCKS: Mapping[tuple[str, str], str] = {  # instead of `HINTS`, where a sample is compressed or pulled
    (
        "modulus",
        "displacement_mm",
    ): "Another law of stress and strain than the known one, or a sample that slips in its "
    "grips or at its platens, would do this; measure the strain on the sample itself.",
    (
        "modulus",
        "force_n",
    ): "Another law of stress and strain than the known one, or a sample that slips in its grips or "
    "at its platens, would do this; measure the strain on the sample itself.",
    (
        "position",
        "displacement_mm",
    ): "Ends that are not even, grips that slip, or an encoder with a periodic error would do "
    "this; measure the strain on the sample itself.",
    (
        "modulus",
        TURNED,
    ): "A sample that softens as it is strained, or friction at its platens, would do this; repeat the cycle.",
    (
        "position",
        TURNED,
    ): "Play of the machine, or a sample that does not come back, would do this; compress a stiff block.",
}


def hint(acts_on: str, axis: str, kind: Kind) -> str:
    """The physics that usually causes such a law, as a sentence; empty where none is known."""
    if kind == "compression" and (acts_on, axis) in OF_BLOCKS:
        return OF_BLOCKS[acts_on, axis]
    return HINTS.get((acts_on, axis), HINTS.get((acts_on, _ANY), ""))


_SLIPS = (
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
    *(FindingCode.FORCE_SATURATES, FindingCode.PERIODIC_ERROR),
    *(
        FindingCode.UNITS_OFF_BY_1000,
        FindingCode.CHANNELS_SWAPPED,
        FindingCode.SIGN_FLIPPED,
        FindingCode.MAINS_IN_CHARGE,
        FindingCode.OUT_OF_DOMAIN,
    ),
    *(FindingCode.CONTACTS_KEPT, FindingCode.DUPLICATED_RECORDING),
)
_RESERVES = (
    *(FindingCode.TIP_SHAPE, FindingCode.THICKNESS_UNKNOWN, FindingCode.IMPLAUSIBLE_D33, FindingCode.REMAINDER),
    *(FindingCode.HELD_OUT_NO_BETTER, FindingCode.UNUSUAL_SCATTER),
)
_MOST = 2  # findings that are quoted; the others are counted


def slips(findings: Sequence[Mapping[str, str]]) -> list[str]:
    """Clauses on errors in the recordings: the most important ones are quoted, the others counted."""
    return _clauses(findings, _SLIPS)


def reserves(findings: Sequence[Mapping[str, str]]) -> list[str]:
    """Clauses on what the stated answer leaves open: a remainder, a held-out error, an implausible d33."""
    return _clauses(findings, _RESERVES)


def _clauses(findings: Sequence[Mapping[str, str]], decisive: Sequence[FindingCode]) -> list[str]:
    chosen = sorted(
        (finding for finding in findings if finding["code"] in decisive),
        key=lambda finding: decisive.index(FindingCode(finding["code"])),
    )
    further = Counter(finding["code"].replace("_", " ") for finding in chosen[_MOST:])
    counted = [f"{count} of {code}" for code, count in further.items()]
    more = [f"further findings: {', '.join(counted)}"] if counted else []
    return [*map(_quoted, chosen[:_MOST]), *more]


def _quoted(finding: Mapping[str, str]) -> str:
    text = clause(finding["statement"])
    return f"recording {finding['recording']!r}: {text}" if finding["recording"] else text


def not_tried(unsupported: Mapping[str, str], kind: Kind) -> list[str]:
    """Clauses on the mechanisms of curves that their recordings do not support, and why: one of them may be missing.

    Mechanisms of other kinds of recordings are not included.
    """
    return [
        f"{name.replace('_', ' ')} was not tried: {reason}"
        for name, reason in unsupported.items()
        if kind != "frf" and name in CATALOGUE and kind in CATALOGUE[name].kinds and _is_physics(CATALOGUE[name])
    ]


def _is_physics(mechanism: Mechanism) -> bool:
    """Whether it is more than another value of a declared quantity, which is free for curves without a declared one."""
    return mechanism.stage is not Stage.DECLARED


_HERTZ = ("preload_n", "indenter_radius_mm")  # Hertz's contact radius grows with their cube roots
_DELAY = 0.5  # exponent of a phase above which it is more like a delay than a loss angle


def statement(
    probability: float,
    leading: LeadingLaw,
    document: Mapping[str, Any],
    floor: float,
    around: StatementContext,
    misfit: str,
) -> str:
    """The statement on an unlisted law: three sentences at most.

    First that no known mechanism describes this, after what decides how far that can be trusted; then the law, with its
    size and held-out errors; last its rivals, the usual cause, and what to quote. `misfit` is the clause on the
    residual of curves.
    """
    law = leading.law
    acts_on = law.description.acts_on
    other_names = tuple(name for name in leading.explanation.names if name != law.name)
    with_others = f" beside {_listed(other_names)}" if other_names else ""
    held = document["heldout_rmse_percent"]
    worth = _worth(held, floor, _held_out(law), f" and {_listed(other_names)}" if other_names else "")
    altered = [*_altered(law, document), *_order(law, document)]
    missing = [f"what is missing{with_others} {_does(leading)}{_follows(leading)}: {_size(leading)}", worth, *altered]
    rivals = [
        f"{acted_on(rival['acts_on'], rival['axis'])} over {followed(rival['axis'])}, {rival['form']} "
        f"({in_percent(rival['probability'])} of it)"
        for rival in document["rivals"][:2]
    ]
    also = [f"in these recordings this may also be {', or '.join(rivals)}"] if rivals else []
    certain = probability * _share_of_quantity(document) >= EXPLAINED
    hint_text = ""
    if certain and not (altered or leading.is_constant):
        hint_text = hint(acts_on, _hinted(leading), leading.explanation.best.hypothesis.lines.kind)
    verdict = f"no known mechanism describes this (probability {in_percent(probability)})"
    return of_clauses(around.first(verdict), missing, [*also, hint_text, misfit, *around.quoted])


def _share_of_quantity(document: Mapping[str, Any]) -> float:
    """The share of laws of any form that act on the same quantity along the same axis."""
    same = (document["acts_on"], document["axis"])
    rivals = (rival["probability"] for rival in document["rivals"] if (rival["acts_on"], rival["axis"]) == same)
    return float(document["probability"] + sum(rivals))


def _hinted(leading: LeadingLaw) -> str:
    """The axis of the law, as the key of `HINTS`."""
    law = leading.law
    if isinstance(law, CurveLaw) and law.shape.variant == TURN:
        return TURNED
    return CONSTANT_PHASE if leading.is_constant_phase else law.description.axis


def _listed(names: Sequence[str]) -> str:
    return " and ".join(name.replace("_", " ") for name in names)


def _altered(law: UnlistedLaw, document: Mapping[str, Any]) -> list[str]:
    """That a power law is a known one with another exponent."""
    if law.description.form != "power":
        return []
    parameters = {parameter["name"]: parameter for parameter in document["parameters"]}
    if isinstance(law, RecordingLaw) and law.description.acts_on == "contact_radius" and law.axis.name in _HERTZ:
        value, low, high = (1 / 3 + parameters["change"][name] for name in ("value", "low", "high"))
        power = f"{value:.2f} ({low:.2f} to {high:.2f}) in place of 1/3"
        grows = f"the contact radius grows with {followed(law.axis.name)} to the power {power}"
        return [f"this is Hertz's law with another exponent: {grows}"]
    exponent = parameters.get("exponent")
    if isinstance(law, FrequencyLaw) and law.variant == "phase" and exponent and exponent["value"] > _DELAY:
        power = f"{exponent['value']:.2f} ({exponent['low']:.2f} to {exponent['high']:.2f}) in place of 1"
        return [f"this is a delay with another exponent: its phase grows with frequency to the power {power}"]
    return []


def _order(law: UnlistedLaw, document: Mapping[str, Any]) -> list[str]:
    """The order of a high pass that makes lines fall off towards low frequencies."""
    if not (isinstance(law, FrequencyLaw) and law.variant == "high_pass"):
        return []
    parameters = {parameter["name"]: parameter for parameter in document["parameters"]}
    value, low, high = (parameters["exponent"][name] for name in ("value", "low", "high"))
    if value < 0:
        return []
    return [f"this is a high pass of order {value:.2f} ({low:.2f} to {high:.2f}), where an amplifier's is of order 1"]


def _held_out(law: UnlistedLaw) -> str:
    return "samples" if isinstance(law, CurveLaw) else "recordings"


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
    law = leading.law
    where = f" {location}" if (location := _where(leading, at)) else ""
    half = SDS_OF_95 * deviation
    if law.description.acts_on in ("force", "position"):
        unit = "N" if law.description.acts_on == "force" else "mm"
        return f"{size:+.3g} {unit} ({size - half:+.3g} to {size + half:+.3g}){where}"
    if isinstance(law, LagLaw) and law.kind == "corner":
        hz = [law.lowest_hz * (size + way * half) for way in (0, -1, 1)]
        return f"lines below a corner of {hz[0]:.3g} Hz ({hz[1]:.3g} to {hz[2]:.3g}) fall off{where}"
    if leading.is_phase or (isinstance(law, LagLaw) and law.kind != "power"):
        turned = np.degrees([size, size - half, size + half]) * (1 if leading.is_phase else -1)
        low, high = sorted(turned[1:])
        return f"the phase by {turned[0]:+.3g}° ({low:+.3g} to {high:+.3g}){where}"
    if isinstance(law, LagLaw):
        return f"by a power of frequency of {-size:+.3g} ({-size - half:+.3g} to {-size + half:+.3g}){where}"
    return f"{100 * size:+.3g} % ({100 * (size - half):+.3g} to {100 * (size + half):+.3g}){where}"


def _where(leading: LeadingLaw, at: float) -> str:
    axis = leading.axis
    if leading.is_constant or leading.is_constant_phase:
        return ""
    if isinstance(leading.law, CurveLaw) and leading.law.shape.variant == TURN:
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


def _worth(held: Mapping[str, float | None], floor: float, what: str, others: str) -> str:
    noise = f" (noise {in_digits(floor, 2)} %)" if np.isfinite(floor) else ""
    if held["before"] is None or held["after"] is None:
        return f"too few {what} to hold any out"
    after, before = in_digits(held["after"], 2), in_digits(held["before"], 2)
    if held["after"] >= held["before"]:
        return f"it predicts {what} held out no better: to {after} % instead of {before} %{noise}"
    return f"with it{others}, {what} held out are predicted to {after} % instead of {before} %{noise}"
