"""The facts of a report: the results of a diagnosis, and every number that documents and sentences need, made once.

`DiagnosisResult` holds the results of all steps, `Facts` what follows from them: the verdict, errors before and after
in sample and on held-out groups, mechanisms with their parameters, d33 and whether it is to be quoted, findings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, SIMPLEST, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.localisation import AxisResult, EffectSize
from underskin.diagnosis.planning.optimal_design import NextRecordings
from underskin.diagnosis.reporting import kinds, numbers
from underskin.diagnosis.reporting.numbers import parameters_of, rounded
from underskin.diagnosis.reporting.quantities import (
    BY_NUISANCES,
    SEVERAL_ANSWERS,
    StatedD33,
    d33_over_answers,
    modulus_over_answers,
    modulus_under,
)
from underskin.diagnosis.reporting.unlisted_law import LeadingLaw, law_document
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.search import KindsTogether
from underskin.diagnosis.validation import cross_validation
from underskin.diagnosis.validation.signatures import Confounding, HiddenShift, Power
from underskin.findings.codes import FindingCode, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits, listed
from underskin.mechanisms.base import Stage
from underskin.mechanisms.laws import contact_creep, liquid_drag, strain_stiffening
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.expressions import CurveLaw
from underskin.mechanisms.unlisted.laws import UnlistedLaw, in_plain_words
from underskin.recordings import plausibility
from underskin.recordings.campaign import Campaign

_STIFFENS = ("layered_contact", "strain_stiffening", "compressible_layer")  # as a layer on a stiff base, with depth
_ALONG_CURVE = ("displacement_mm", "force_n")  # axes along which the contact's force grows itself
_LARGEST_FLOOR = 20.0  # % of the response: noise above which no d33 is quoted


@dataclass(frozen=True)
class DiagnosisResult:
    """The results of all steps on one campaign; `search` is None where the data were too few."""

    name: str
    findings: Sequence[Finding]
    provenance: Mapping[str, Any]
    skin_d33_pc_per_n: float | None = None  # as the skin declares it
    level_unsure: float = 0.0  # relative uncertainty of all FRFs due to noise in their channels
    lacking: Lacking | None = None  # of a campaign from which nothing can be concluded
    search: Search | None = None
    few: Search | None = None  # instead of `search` where recordings agree with the model but are too few to say so
    problem: FittingProblem | None = None
    axes: Sequence[AxisResult] = ()
    region: Mapping[str, list[float | str]] = field(default_factory=dict)
    effect: EffectSize | None = None
    groups: Sequence[cross_validation.HeldOut] = ()
    confounded: Sequence[Confounding] = ()
    power: Sequence[Power] = ()
    shifts: Sequence[HiddenShift] = ()
    plan: NextRecordings | None = None
    curves: Campaign | None = None  # with every sample, where curves were diagnosed
    joined: KindsTogether | None = None  # with recordings of other kinds; not None where there is a search

    def with_findings(self, *further: Finding) -> "DiagnosisResult":
        """The same result with further findings appended."""
        return replace(self, findings=(*self.findings, *further))


class Facts:
    """What follows from a diagnosis that has a search.

    `base` is the explanation without mechanisms, `shown` that behind the leading answer.
    """

    def __init__(self, diagnosis: DiagnosisResult) -> None:
        """Of a diagnosis with a search."""
        assert diagnosis.search is not None
        assert diagnosis.problem is not None
        assert diagnosis.joined is not None
        self.diagnosis, self.search, self.problem = diagnosis, diagnosis.search, diagnosis.problem
        self.joined = diagnosis.joined
        self.leader = self.search.answers[0]
        self.base = self.search.null
        self.shown = self.search.fit_behind(self.leader)
        self.traits = kinds.KINDS[self.problem.kind]

    @cached_property
    def verdict(self) -> str:
        """The verdict by the probabilities, as docs/diagnosis.md explains it.

        A set of mechanisms explains nothing if one of them may as well have no effect, or has a parameter at the bound
        of its search; nor does the base model with d33 or a free modulus at a bound, or any answer to curves whose
        moduli contradict each other.
        """
        if self.leader.explanation is None:
            return "unexplained"
        if self.bounds or self.curves_differ:
            return "ambiguous"
        if self.leader.names == (NOTHING_MISSING,):
            return "no_mismatch"
        certain = self.leader.probability >= EXPLAINED and not self.idle and not self.doubts
        return "explained" if certain else "ambiguous"

    @cached_property
    def bounds(self) -> dict[str, Finding]:
        """Parameters at bounds: why each is no result, and the finding."""
        return numbers.at_bounds(self.shown)

    @cached_property
    def idle(self) -> list[str]:
        """Mechanisms of a set that may as well have no effect, and are not supported by recordings of another kind."""
        if self.leader.explanation is None:
            return []
        names = self.shown.names
        return [name for name in numbers.without_effect(self.shown) if not self.joined.shows_on_curves(name, names)]

    @property
    def curves_differ(self) -> list[str]:
        """Clauses on curves whose moduli contradict each other, or that may be of a pulled or of a pressed sample."""
        reasons = (Reason.CURVES_DIFFER, Reason.SPECIMENS_DIFFER, Reason.PULLED_OR_PRESSED)
        return [finding.statement for finding in self.diagnosis.findings if finding.reason in reasons]

    @property
    def doubts(self) -> list[str]:
        """Clauses on what speaks against the leading set: `curves_differ`, a layer of another thickness than the
        declared one that the curves show as well, or held-out parts that the set predicts no better than the base
        model, and far from their noise."""
        _, after = cross_validation.total(self.diagnosis.groups)
        is_far = after.recordings and after.rmse_percent > cross_validation.FAR_ABOVE * after.floor_percent
        return self.curves_differ + [
            finding.statement
            for finding in self.diagnosis.findings
            if finding.reason == Reason.THICKNESS_DIFFERS or (finding.reason == Reason.HELD_OUT_NO_BETTER and is_far)
        ]

    @cached_property
    def leading(self) -> LeadingLaw | None:
        """The unlisted law behind an answer that no known mechanism gives."""
        return LeadingLaw.of(self.problem, self.shown) if self.verdict == "unexplained" else None

    @cached_property
    def law(self) -> dict[str, Any] | None:
        """The report's `unnamed`."""
        leading = self.leading
        return None if leading is None else law_document(self.search, self.problem, leading, self.diagnosis.groups)

    @cached_property
    def scores(self) -> tuple[cross_validation.PredictionScore, cross_validation.PredictionScore]:
        """Of the recordings that were fitted, before and after."""
        before, after = (cross_validation.in_sample(self.problem, fitted) for fitted in (self.base, self.shown))
        return before, after

    @cached_property
    def fit(self) -> dict[str, Any]:
        """Errors before and after, held-out groups, the fitted noise; and the modulus of curves, under the base model
        and over all answers."""
        groups, named = self.diagnosis.groups, self.problem.lines.mechanisms.named
        outside = cross_validation.total(groups)
        levels = self.shown.best.levels
        floor = (outside[1] if outside[1].recordings else self.scores[1]).floor_percent
        before = self._errors(self.base, self.scores[0], outside[0])
        after = self._errors(self.shown, self.scores[1], outside[1])
        if self.problem.lines.curves:
            before["youngs_modulus"] = modulus_under(self.problem, self.base)
            modulus = modulus_over_answers(self.search, self.problem, self.shown)
            is_no_better = outside[1].recordings and outside[1].rmse_percent >= outside[0].rmse_percent
            if modulus is not None and not (
                self._is_open(modulus, before["youngs_modulus"]) or (self.leading is not None and is_no_better)
            ):
                after["youngs_modulus"] = modulus
        return {
            "before": before,
            "after": after,
            "mechanisms": [name for name in self.shown.names if name in named],  # also where more is unexplained
            "noise_floor_percent": rounded(floor),
            "groups": [
                {
                    "group": group.group,
                    "chosen": [self._plainly(name) for name in group.chosen] or [NOTHING_MISSING],
                    "before_rmse_percent": rounded(group.before.rmse_percent),
                    "after_rmse_percent": rounded(group.after.rmse_percent),
                    "noise_floor_percent": rounded(group.after.floor_percent),
                }
                for group in groups
            ],
            "noise": {
                "gain_percent": rounded(100 * levels.gain),
                "position_mm": rounded(1e3 * levels.position),
                "line_level": rounded(levels.level),
                "smooth_percent": rounded(100 * levels.smooth),
            },
        }

    def _is_open(self, modulus: Mapping[str, Any], base: Mapping[str, Any]) -> bool:
        """Whether the curves do not determine E: they may be of a sample that is pulled or pressed, or held by platens
        or not, or a force that an unlisted law adds along the depth has taken up part of the contact's own: E by
        that law then is one of many, and its interval excludes that of the base model."""
        are_open = (Reason.PULLED_OR_PRESSED, Reason.SPECIMENS_DIFFER)
        if any(finding.reason in are_open for finding in self.diagnosis.findings):
            return True
        law = self.leading
        if law is None or law.combination[0] != "force" or law.combination[1] not in _ALONG_CURVE:
            return False
        return bool(modulus["high"] < base["low"] or modulus["low"] > base["high"])

    def _errors(
        self,
        explanation: Explanation,
        inside: cross_validation.PredictionScore,
        outside: cross_validation.PredictionScore,
    ) -> dict[str, Any]:
        """Of indentations the error and the modulus of a plain least-squares fit of the same law as well [%, MPa]."""
        lines, error = self.problem.lines, rounded(inside.rmse_percent)
        errors: dict[str, Any] = {"rmse_percent": error}
        if lines.kind == "indentation":
            fit, residual_percent = explanation.least_squares
            index = explanation.index("youngs_modulus")
            declared = lines.campaign.skin.youngs_modulus_mpa or 1.0  # the parameter is a factor on it
            modulus_mpa = declared * explanation.model.parameters[index].from_fit(float(fit[index]))
            errors = {
                "rmse_percent": rounded(residual_percent),
                "least_squares_modulus_mpa": rounded(float(modulus_mpa)),
            }
        return {
            **errors,
            **({"correlated_rmse_percent": error} if lines.curves else {}),
            "heldout_rmse_percent": rounded(outside.rmse_percent),
            "log_score": rounded(outside.log_score / outside.recordings) if outside.recordings else None,
        }

    def _plainly(self, name: str) -> str:
        """A mechanism's name; of an unlisted law the quantity it acts on, its axis and its form."""
        law = self.problem.lines.mechanisms[name]
        if not isinstance(law, UnlistedLaw):
            return name
        return f"unnamed: {law.description.acts_on} over {law.description.axis}, {law.description.form}"

    @cached_property
    def present(self) -> dict[str, float]:
        """The posterior of each mechanism."""
        return numbers.present(self.search)

    @cached_property
    def presence(self) -> list[dict[str, Any]]:
        """The report's `presence`: groups of mechanisms that these recordings cannot tell apart."""
        return numbers.presence(self.search, self.present)

    @cached_property
    def mechanisms(self) -> list[dict[str, Any]]:
        """The report's `mechanisms`: those of the stated answer, and those that act on other kinds' curves alone."""
        if self.verdict == "unexplained" and self.leading is None:
            return []
        named = self.problem.lines.mechanisms.named
        own = [
            {
                "name": name,
                "of": named[name].of,
                "probability": self._probability(name),
                "parameters": parameters_of(self.shown, name),
                "explains_percent": self._explains_percent(name),
            }
            for name in self.shown.names
            if name in named
        ]
        on_curves = kinds.mechanisms_of_curves(self.joined, self.leader.alone, self.shown.names)
        return own + [{**mechanism, "probability": self._probability(mechanism["name"])} for mechanism in on_curves]

    def _probability(self, name: str) -> float:
        return round(self.present.get(name, 0.0), 3)

    def _explains_percent(self, name: str) -> float | None:
        """Share of the base model's misfit beyond noise that returns where the mechanism is left out of its set [%].

        None where the misfit without it is within noise: an effect that only many recordings together show. A mechanism
        that adds variance reduces no misfit; of mains pick-up q it is the share in the lines' variance, n being a
        line's own noise: Σ q² · q²/(q² + n²) / Σ q².
        """
        problem, best = self.problem, self.shown.best
        parameters = problem.lines.mechanisms[name].parameters(problem.lines.campaign, problem.kind)
        if any(parameter.acts_on == "line_variance" for parameter in parameters):
            pickup = best.pickup_variance
            noise = (best.levels.level * best.hypothesis.lines.deviation) ** 2
            return round(100 * float((pickup**2 / (pickup + noise)).sum() / pickup.sum()), 1)
        rest = tuple(other for other in self.shown.names if other != name)
        fitted = [candidate for candidate in (*self.search.explanations, *self.search.laws) if candidate.names == rest]
        without = fitted[0] if fitted else problem.explain(Request(rest))
        assert without is not None  # a single request is never pruned
        scores = (*self.scores, cross_validation.in_sample(problem, without))
        floor = self.scores[1].noise / self.scores[1].size
        before, after, left = (score.square / score.size - floor for score in scores)
        if left <= 0:
            return None
        share = (left - max(after, 0.0)) / max(before, left)
        return round(100 * float(np.clip(share, 0.0, 1.0)), 1)

    @property
    def meanings(self) -> list[str]:
        """The joint meaning of each mechanism's parameters, where a single value does not show it."""
        meanings = [
            _MEANINGS[mechanism["name"]](
                {parameter["name"]: parameter["value"] for parameter in mechanism["parameters"]},
                self.problem.lines.campaign,
            )
            for mechanism in self.mechanisms
            if mechanism["name"] in _MEANINGS
        ]
        return [meaning for meaning in meanings if meaning]

    @cached_property
    def by_kind(self) -> list[dict[str, Any]]:
        """The report's `by_kind`."""
        return kinds.by_kind(self.joined, self.shown.names)

    @cached_property
    def contradictions(self) -> list[dict[str, Any]]:
        """The report's `contradictions`."""
        return kinds.contradictions(self.joined)

    @cached_property
    def alike(self) -> dict[str, Any] | None:
        """Answers to FRFs that predict them alike."""
        floor = float(self.fit["noise_floor_percent"] or 0.0)
        return numbers.alike(self.search, self.problem, floor) if self.traits.measured == "d33" else None

    @cached_property
    def d33(self) -> StatedD33:
        """d33 over all answers, and whether it is to be quoted.

        It is if one answer stands, kinds of recordings do not contradict each other, no parameter is at the bound of
        its search, no unlisted law acts within the band, d33 is plausible, the answer fits the recordings to their
        noise, which is a fifth of the response at most, and no wrong declared number that would not show here would
        move d33 beyond its interval.
        """
        diagnosis, law = self.diagnosis, self.leading
        unsure = diagnosis.level_unsure
        d33 = d33_over_answers(self.search, self.problem, unsure) if self.traits.measured == "d33" else None
        if d33 is None:
            return StatedD33(None)
        stands = self.verdict in ("explained", "no_mismatch") or law is not None
        floor, error = self.fit["noise_floor_percent"], self.fit["after"]["rmse_percent"]
        against = {
            SEVERAL_ANSWERS: not stands or self.leader.probability < EXPLAINED,
            "kinds of recordings contradict each other": bool(self.contradictions),
            " and ".join(self.bounds): bool(self.bounds),
            "a law that is in no list acts on it": law is not None and not law.is_outside_band,
            "its force acts at the mains alone": self._holds_for_all(Reason.EXCITED_AT_MAINS),
            "its gain changes within the recordings": self._holds_for_all(Reason.GAIN_STEP, Reason.GAIN_DRIFTS),
            "its gain changes over frequency": any(
                finding.reason is Reason.GAIN_OVER_FREQUENCY and not finding.arguments["left_out"]
                for finding in diagnosis.findings
            ),
            self._by_other_sensors: bool(self._by_other_sensors),
            "no PVDF has such a value": plausibility.implausibility(
                d33["value"], units_checked=self.problem.lines.campaign.units_checked
            )
            is not None,
            f"the error in the recordings, {in_digits(error, 2)} %, is well above their noise": not (
                error <= cross_validation.REACHES_NOISE * floor
            ),
            f"noise alone is {in_digits(floor, 2)} % of the response": not floor <= _LARGEST_FLOOR,
        }
        why_not = [words for words, holds in against.items() if holds]
        half_width = float(np.log(d33["high"] / d33["low"])) / 2
        # Hidden mechanisms matter only where there is no other reason against quoting d33.
        shifts = () if why_not else diagnosis.shifts
        hidden = [shift for shift in shifts if abs(shift.log_factor) > half_width]
        return StatedD33(d33, hidden, why_not, diagnosis.skin_d33_pc_per_n)

    @cached_property
    def _by_other_sensors(self) -> str:
        """What d33 is by the other of two groups of sensors, either of which may be right; empty without groups."""
        for finding in self.diagnosis.findings:
            if finding.reason == Reason.TWO_GROUPS:
                lower, higher, factor = (finding.arguments[name] for name in ("lower", "higher", "factor"))
                is_lower = len(lower) >= len(higher)  # of the two that d33 is taken from
                times, others = (factor, higher) if is_lower else (1 / factor, lower)
                return f"by the sensors {listed(others)} it is {times:.3g} times that"
        return ""

    def _holds_for_all(self, *reasons: Reason) -> bool:
        """Whether a finding for one of the reasons affects all recordings."""
        affecting = [finding.arguments for finding in self.diagnosis.findings if finding.reason in reasons]
        return any(arguments["affected"] == arguments["recordings"] for arguments in affecting)

    @property
    def power(self) -> list[Power]:
        """Detection limits, without mechanisms that would not show at a typical strength: they are not ruled out."""
        unseen = {entry.mechanism for entry in self.diagnosis.confounded if entry.confounded_with in BY_NUISANCES}
        unseen |= {shift.mechanism for shift in self.d33.hidden}
        return [limit for limit in self.diagnosis.power if limit.mechanism not in unseen]

    @cached_property
    def findings(self) -> list[dict[str, str]]:
        """The report's `findings`: those of the recordings, then those on the fit and on d33."""
        further = [*self._fit_findings(), *self._contacts_kept(), *self._thickness_unknown()]
        number = self.d33.number
        if number is not None:
            checked = self.problem.lines.campaign.units_checked
            further += plausibility.of_array(Reason.D33_FITTED, number["value"], units_checked=checked)
        return [finding.in_report() for finding in (*self.diagnosis.findings, *further)]

    def _fit_findings(self) -> list[Finding]:
        """Parameters at bounds, contacts beyond the tables, and noise larger than the lines' own."""
        best, lines = self.shown.best, self.problem.lines
        outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside]).tolist()
        answer = {"answer": self._answer(self.shown.names) or SIMPLEST[lines.kind]}
        ids = [recording.id for recording in lines.campaign.recordings]
        beyond = [Finding(Reason.OUT_OF_TABLES_FITTED, ids[index], "preload_n", answer) for index in outside]
        level = best.levels.level
        is_noisy = not lines.curves and level >= cross_validation.FAR_ABOVE
        noisy = [Finding(Reason.LINE_NOISE_LEVEL, "", "frf_re_pc_per_n", {"level": level})] if is_noisy else []
        return [*self.bounds.values(), *beyond, *noisy]

    def _answer(self, names: Sequence[str]) -> str:
        return in_words([in_plain_words(self.problem.lines.mechanisms[name]) for name in names])

    def _contacts_kept(self) -> list[Finding]:
        """Contacts of FRFs that lie within the tables with the fitted modulus, and beyond them with the declared."""
        best, model, skin = self.shown.best, self.shown.model, self.problem.lines.campaign.skin
        contacts = len(np.unique(best.hypothesis.lines.recording[best.prediction.inside & ~model.valid]))
        if not contacts:
            return []
        assert skin.youngs_modulus_mpa is not None  # as of all FRFs, which alone can be beyond tables as declared
        fit = dict(zip([parameter.name for parameter in model.parameters], self.shown.point.fit, strict=True))
        fitted_mpa = None
        if _FACTOR in fit:
            fitted_mpa = skin.youngs_modulus_mpa * float(np.exp(fit[_FACTOR] + fit["youngs_modulus"]))
        arguments = {
            "contacts": contacts,
            "recordings": self.problem.lines.recordings,
            "declared_mpa": skin.youngs_modulus_mpa,
            "found_mpa": fitted_mpa,
            "answer": self._answer(self.shown.names),
        }
        return [Finding(Reason.CONTACTS_KEPT, "", "skin.youngs_modulus_mpa", arguments)]

    def _thickness_unknown(self) -> list[Finding]:
        """A thickness inferred from curves alone."""
        mechanisms, campaign = self.problem.lines.mechanisms, self.problem.lines.campaign
        stiffening = [
            name
            for name in self.shown.names
            if name in _STIFFENS
            or (isinstance(law := mechanisms[name], CurveLaw) and law.description.axis in _ALONG_CURVE)
        ]
        if self.problem.kind != "indentation" or campaign.skin.thickness_mm is not None or not stiffening:
            return []
        is_tried = "layered_contact" in mechanisms.named
        arguments = {"answer": self._answer(stiffening), "is_tried": is_tried}
        return [Finding(Reason.THICKNESS_UNKNOWN, "", "thickness_mm", arguments)]

    @cached_property
    def untried(self) -> list[str]:
        """Clauses on the mechanisms of curves that their recordings do not support, where they could explain a
        residual: one of them may be missing.

        Other values of declared quantities are not among them: they are free for curves without a declared one.
        """
        remains = self.verdict in ("unexplained", "ambiguous")
        remains = remains or any(finding["code"] == FindingCode.REMAINDER for finding in self.findings)
        if not remains or not self.traits.lists_untried:
            return []
        return [
            f"{name.replace('_', ' ')} was not tried: {reason}"
            for name, reason in self.search.unsupported.items()
            if name in CATALOGUE
            and self.problem.kind in CATALOGUE[name].kinds
            and CATALOGUE[name].stage is not Stage.DECLARED
        ]


_FACTOR = "modulus_factor"  # of modulus_error
_MEANINGS = {
    contact_creep.ContactCreep.name: contact_creep.meaning,
    liquid_drag.LiquidDrag.name: liquid_drag.meaning,
    strain_stiffening.StrainStiffening.name: strain_stiffening.meaning,
}
