"""What the commands `d33` and `diagnose` say of a file of everyday measurements, and what is right."""

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

_ARRAY = re.compile(r"d33 of the array\s+([-+.\de]+)")
_MODULUS = re.compile(
    r"^\s*\S.*?\s([-+.\de]+)\s+[-+.\de]+\s+(?:indentation|compression(?: and tension)?|tension):", re.MULTILINE
)


@dataclass(frozen=True)
class Outcome:
    """The text of a command (both streams), names of files in it, and the report of a diagnosis, {} of `d33`."""

    text: str
    names: tuple[str, ...] = ()
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """What is said, without the names of files, which say much themselves."""
        text = f"{self.text}\n{self.report.get('statement', '')}"
        for name in self.names:
            text = text.replace(name, "")
        return text

    @property
    def value(self) -> float | None:
        """d33 [pC/N] or E [MPa]; None where none is given."""
        if self.report:
            quoted = (
                self.report.get("d33")
                or ((self.report.get("fit") or {}).get("after") or {}).get("youngs_modulus")
                or {}
            )
            value = quoted.get("value")
            return None if value is None else float(value)
        found = _ARRAY.search(self.text) or _MODULUS.search(self.text)
        return float(found.group(1)) if found else None


@dataclass(frozen=True)
class Right:
    """What is right: a value (or none, where `or_none`; none at all, where `none`), verdicts, a set, words that stand
    in the text and words that do not.

    `parameter`: name of one of the set's parameters with the bounds of its value.
    """

    value: float | None = None
    within: float = 0.05
    or_none: bool = False
    none: bool = False
    verdicts: tuple[str, ...] = ()
    names: tuple[str, ...] | None = None
    parameter: tuple[str, float, float] | None = None
    says: str = ""
    never: str = ""

    def departures(self, outcome: Outcome) -> list[str]:
        """What is not right, in words."""
        wrong = ["a traceback"] if "Traceback" in outcome.text else []
        value = outcome.value
        if self.value is None:
            if value is not None and (self.none or not (self.says or self.verdicts)):
                wrong.append(f"gives {value:g} where no value is right")
        elif value is None:
            wrong += [] if self.or_none else [f"gives no value, {self.value:g} is right"]
        elif abs(value / self.value - 1) > self.within:
            wrong.append(f"gives {value:g}, {self.value:g} is right")
        words = outcome.words
        if self.says and not re.search(self.says, words, re.IGNORECASE):
            wrong.append(f"does not say {self.says!r}")
        if self.never and (false := re.search(self.never, words, re.IGNORECASE)):
            wrong.append(f"says {false.group()!r}")
        return [*wrong, *self._of_report(outcome.report)] if self._of_a_report else wrong

    @property
    def _of_a_report(self) -> bool:
        return bool(self.verdicts or self.names is not None or self.parameter)

    def _of_report(self, report: dict[str, Any]) -> list[str]:
        if not report:
            return ["no report"]
        wrong = []
        if self.verdicts and report["verdict"] not in self.verdicts:
            wrong.append(f"verdict {report['verdict']} ({report['probability']:.2f})")
        names = {entry["name"] for entry in report["mechanisms"]}
        if self.names is not None and names != set(self.names):
            wrong.append(f"names {sorted(names)}")
        if self.parameter is not None:
            name, low, high = self.parameter
            values = [
                one["value"] for entry in report["mechanisms"] for one in entry["parameters"] if one["name"] == name
            ]
            if not any(low <= value <= high for value in values):
                wrong.append(f"{name} {values}, {low:g} to {high:g} is right")
        return wrong


def report_in(folder: Path) -> dict[str, Any]:
    """The only report in a folder; {} where there is none."""
    files = list(folder.glob("*.json"))
    return json.loads(files[0].read_text()) if len(files) == 1 else {}
