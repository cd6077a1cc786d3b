"""The d33 of a report: whether it is to be quoted, and what would change it that these recordings do not show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.reporting import averaged
from underskin.diagnosis.reporting.statements import CONFOUNDED, listed
from underskin.diagnosis.reporting.unnamed_law import LeadingLaw
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.validation.hidden_shift import HiddenShift
from underskin.diagnosis.validation.identifiability import Confounding, Likeness
from underskin.diagnosis.validation.residual_noise import REACHES_NOISE
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.prediction import plausibility

_LARGEST_FLOOR = 20.0  # % of the response: beyond it, recordings say too little of a level to quote it
_MOST_NAMED = 2  # mechanisms that would not show, beside a value to quote
_ANSWERS = "several answers remain"
BY_NUISANCES = ("d33", "noise")  # what a mechanism is confounded with that does not show beside d33, E and h


@dataclass(frozen=True)
class StatedD33:
    """The report's `d33` (None of curves), a finding where no PVDF has it, and the mechanisms that would not show here
    and move it beyond its interval; those that are wrong declared numbers keep it from being quoted. `why_not`: what
    else does, in words. `skin_pc_per_n`: the skin's declared d33, None where it declares none."""

    document: Mapping[str, Any] | None
    findings: Sequence[Finding] = ()
    hidden: Sequence[HiddenShift] = ()
    why_not: Sequence[str] = ()
    skin_pc_per_n: float | None = None

    @property
    def deciding(self) -> list[HiddenShift]:
        """What keeps d33 from being quoted: hidden wrong declared numbers, and what would change it as much, the
        largest first; none where no declared number does."""
        least = min((abs(entry.log_factor) for entry in self.hidden if entry.declared), default=np.inf)
        chosen = [entry for entry in self.hidden if abs(entry.log_factor) >= least]
        return sorted(chosen, key=lambda entry: -abs(entry.log_factor))

    def clause(self) -> str:
        """The value to quote, or why none is; empty where there is no d33."""
        if self.document is None:
            return ""
        if self.document["quotable"]:
            return f"d33 to quote: {self.quoted()}"
        return f"d33 is not to be quoted: {self.interval()}"

    def quoted(self) -> str:
        """The value with its interval, and which physics that would not show would change it most beyond that."""
        assert self.document is not None
        value, low, high = (f"{self.document[key]:.3g}" for key in ("value", "low", "high"))
        largest = sorted(self.hidden, key=lambda entry: -abs(entry.log_factor))[:_MOST_NAMED]
        named = " or ".join(f"{in_words([one.mechanism])} ({_percent(one)})" for one in largest)
        hides = f", provided that no {named} hides" if named else ""
        return f"{value} {self.document['unit']} (95 %: {low} to {high}{self._apart()}){self._beside_declared()}{hides}"

    def _apart(self) -> str:
        """The interval without what the declared values may be off by."""
        assert self.document is not None
        low, high = (f"{self.document['relative'][key]:.3g}" for key in ("low", "high"))
        return f" with what declared values may be off, {low} to {high} to compare sensors or dates"

    def _beside_declared(self) -> str:
        """How many times the skin's declared d33 it is, where the interval leaves that out: a peak-to-peak force or
        charge taken for an amplitude halves or doubles every FRF, which nothing else in the recordings tells."""
        assert self.document is not None
        declared = self.skin_pc_per_n
        if declared is None or self.document["low"] <= declared <= self.document["high"]:
            return ""
        return f", {self.document['value'] / declared:.2g} times the declared {declared:g} {self.document['unit']}"

    def interval(self) -> str:
        """Where it lies, and why it is not to be quoted."""
        assert self.document is not None
        low, high = (f"{self.document[key]:.3g}" for key in ("low", "high"))
        lies = f"it lies from {low} to {high} {self.document['unit']}{self._beside_declared()}"
        deciding = [f"{in_words([one.mechanism])} by {_percent(one)}" for one in self.deciding[:_MOST_NAMED]]
        if deciding:
            return f"{lies}, but what would not show here would change it, {listed(deciding)}"
        over = " over the answers that remain" if _ANSWERS in self.why_not else ""
        others = " and ".join(words for words in self.why_not if words != _ANSWERS)
        return f"{lies}{over}" + (f", {'and' if over else 'but'} {others}" if others else "")

    @property
    def reasons(self) -> list[str]:
        """Why it is not to be quoted; none where it is."""
        if self.document is None:
            return list(self.why_not) or ["no answer explains its recordings"]
        hidden = in_words([one.mechanism for one in self.deciding[:_MOST_NAMED]])
        return [*self.why_not, *([f"{hidden} would change it without showing"] if hidden else [])]

    def not_identifiable(self, confounded: Sequence[Confounding]) -> list[dict[str, str]]:
        """The report's entries, with what each would do to d33 beyond its interval."""
        hidden = {entry.mechanism: entry for entry in self.hidden}
        known = {entry.mechanism for entry in confounded if entry.confounded_with in BY_NUISANCES}
        further = [Confounding(one.mechanism, "d33", Likeness.TAKEN_UP) for one in self.hidden]
        return [
            {
                "mechanism": entry.mechanism,
                "confounded_with": entry.confounded_with,
                "reason": _reason(entry, hidden.get(entry.mechanism)),
            }
            for entry in (*confounded, *(one for one in further if one.mechanism not in known))
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

    `quotable`: one answer `stands`, kinds of recordings are not `contradictory`, no parameter is at the bound of its
    search (`at_bounds`, in words), no unlisted `law` acts within the band, d33 is plausible, the answer fits the
    recordings to their noise, which is a fifth of the response at most, and no wrong declared number that would not
    show here would move d33 beyond its interval. `unsure`: the relative uncertainty of all FRFs that noise in their
    channels leaves. `skin_pc_per_n`: the skin's declared one.
    """
    d33 = None if problem.lines.curves else averaged.d33(search, problem, unsure)
    if d33 is None:
        return StatedD33(None)
    half_width = float(np.log(d33["high"] / d33["low"])) / 2
    hidden = [entry for entry in shifts if abs(entry.log_factor) > half_width]
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
    # Beside other reasons not to quote it, a hidden one would not be what decides.
    quotable = {**d33, "quotable": not why_not}
    stated = StatedD33(quotable, findings, () if why_not else hidden, why_not, skin_pc_per_n)
    return replace(stated, document={**d33, "quotable": False}) if stated.deciding else stated


def _acts_outside_band(law: LeadingLaw) -> bool:
    """Whether an unlisted law leaves the size of the response as it is over most of the band: a peak, a notch, and a
    turn of the phase over frequency."""
    return law.law.spoken.axis == "frequency_hz" and (law.is_phase or law.law.spoken.form == "peak")


def _reason(entry: Confounding, hidden: HiddenShift | None) -> str:
    reason = CONFOUNDED[entry.why].format(mechanism=entry.mechanism, other=entry.confounded_with)
    if hidden is None or entry.confounded_with not in BY_NUISANCES:
        return reason
    return f"{reason}; d33 would then be {_percent(hidden)} too {'large' if hidden.log_factor > 0 else 'small'}"


def _percent(hidden: HiddenShift) -> str:
    return f"{in_digits(abs(hidden.percent), 2)} %"
