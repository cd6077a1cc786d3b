"""Parameters of an explanation that lie at a bound of their search: at that value or beyond, and so no result.

A set of mechanisms that holds one explains nothing, and its d33 is not to be quoted. A bound beyond which there is
nothing, or at which a mechanism does nothing, is none (`Parameter.ends_search`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.reporting.numbers import multiple_of
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.unnamed.laws import in_plain_words

_MEASURED = ("d33", "youngs_modulus")  # that belong to no mechanism, where they are free


@dataclass(frozen=True)
class AtBound:
    """A parameter at an end of its search, `low` to `high` in `unit`; `mechanism` in plain words, or the base model."""

    mechanism: str
    parameter: str
    low: float
    high: float
    unit: str
    end: float

    @property
    def words(self) -> str:
        """As the reason why something is no result: "timing delay: delay at or beyond 5000 µs"."""
        value = f"{in_digits(self.end, 3)} {self.unit.strip('-')}".rstrip()
        called = self.parameter.replace("_", " ")
        return f"{self.mechanism.replace('_', ' ')}: {called} at or beyond {value}, where its search ends"

    @property
    def finding(self) -> Finding:
        """The same among the findings."""
        arguments = {"mechanism": self.mechanism, "parameter": self.parameter}
        bounds = {"low": self.low, "high": self.high, "unit": self.unit}
        return Finding(Reason.PARAMETER_AT_BOUND, "", self.parameter, {**arguments, **bounds})


def at_bounds(explanation: Explanation) -> Sequence[AtBound]:
    """Those of an explanation's mechanisms, and of d33 and a modulus that nobody declared."""
    places = own_places(explanation.names, explanation.best.hypothesis.lines)
    known = explanation.best.hypothesis.lines.mechanisms
    owner = {index: known[name] for name, place in places.items() for index in range(place.start, place.stop)}
    found = []
    for index, (entry, fit) in enumerate(zip(explanation.model.parameters, explanation.point.fit, strict=True)):
        if index not in owner and (entry.name not in _MEASURED or entry.unit == "-"):
            continue
        side = entry.ends_search(float(fit))
        if side is not None:
            called = in_plain_words(owner[index]) if index in owner else "base model"
            found.append(_at_bound(explanation, entry, called, side))
    return found


def _at_bound(explanation: Explanation, entry: Parameter, mechanism: str, side: str) -> AtBound:
    scale = multiple_of(explanation, entry)
    low, high = scale * entry.low, scale * entry.high
    end = low if side == "low" else high
    return AtBound(mechanism, entry.name.removeprefix("law_"), low, high, entry.unit, end)
