"""The ledger's campaigns by part: what is diagnosed, what is true, and what a right answer is.

Drawn campaigns have seeds that no part of the proof uses, because the ledger is looked at daily.
"""

import importlib.util
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

from proof import joint, judge, slips
from proof.cases import DrawnCase, DrawnCurves
from proof.ledger.answer import OPEN, RIGHT, WRONG, distinguishable_slips, graded
from proof.results import data_folder
from proof.stored import diagnosed, diagnosed_by
from proof.unlisted import judged as judged_by_law
from rig.draw import record
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.identifiable import THRESHOLD
from rig.joint import WHAT, joint_campaigns
from rig.joint_campaign import Hidden, Joint
from rig.joint_truth import that_show
from rig.truth import truth_of_curves, truth_of_lines
from rig.visible_curves import THRESHOLD as CURVE_THRESHOLD

Report = Mapping[str, Any]
Truth = dict[str, Any]

FRF_SEED, CURVE_SEED, JOINT_SEED, SLIP_SEED = 51763, 51764, 51765, 51766
FRFS, CURVES, JOINT, SLIPS = 150, 60, 30, 60
_HIDDEN_IN_CURVES = ("single", "pair", "unknown", "single", "none")  # in turn
_CAMPAIGNS, _RECORDINGS = "UNDERSKIN_CAMPAIGNS", "UNDERSKIN_RECORDINGS"
# What the judge of real recordings says of an answer
_GRADES = {
    RIGHT: ("right", "right: no listed law"),
    OPEN: ("partly", "honest", "refused"),
    WRONG: ("right, E off", "honest, E off", "wrong", "confidently wrong"),
}
_SOLVED_GRADES = {"right": RIGHT, "equivalent": RIGHT, "partly": OPEN, "honest": OPEN, "wrong": WRONG}


@cache
def _read(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text(encoding="utf-8")))


@dataclass(frozen=True)
class Item:
    """One campaign of the ledger, or several to be judged together; small, so that it can be sent to any process."""

    name: str
    needs: ClassVar[str] = ""  # the setting that names the folder of its data

    def documents(self) -> list[dict[str, Any]]:
        """What the diagnosis is given."""
        raise NotImplementedError

    def diagnosed(self, documents: Sequence[dict[str, Any]]) -> Report:
        """The report on them."""
        return diagnosed(documents[0])

    def truth(self) -> Truth:
        """What is hidden (`effects`), which of it shows (`shows`), and the true `d33` or `youngs_modulus`."""
        raise NotImplementedError

    def grade(self, report: Report, truth: Truth, /) -> str:
        """`right`, `open` or `wrong`."""
        return graded(report, truth["effects"], truth["shows"])


@dataclass(frozen=True)
class DrawnFrf(Item):
    """FRFs of the virtual rig, of its usual mixture of what is hidden."""

    number: int

    @property
    def _case(self) -> DrawnCase:
        return DrawnCase(FRF_SEED, self.number)

    def documents(self) -> list[dict[str, Any]]:
        """One campaign."""
        return [self._case.document()]

    def truth(self) -> Truth:
        """By the rig's own fit."""
        facts = truth_of_lines(record(self._case.description))
        return {**_identifiable_effects(facts, THRESHOLD), "d33": facts["d33_pc_per_n"]}


@dataclass(frozen=True)
class DrawnRawCurves(Item):
    """Raw indentation curves of the virtual rig."""

    number: int

    @property
    def _case(self) -> DrawnCurves:
        return DrawnCurves(CURVE_SEED, self.number, _HIDDEN_IN_CURVES[self.number % len(_HIDDEN_IN_CURVES)])

    def documents(self) -> list[dict[str, Any]]:
        """One campaign."""
        return [self._case.document()]

    def truth(self) -> Truth:
        """By the rig's own fit."""
        facts = truth_of_curves(*drawn_curves(CURVE_SEED, self.number, INDENTATION, self._case.what))
        return {
            **_identifiable_effects(facts, CURVE_THRESHOLD),
            "youngs_modulus": facts["youngs_modulus_mpa"],
        }


@dataclass(frozen=True)
class DrawnJoint(Item):
    """FRFs with curves, dates of a skin, or skins of one batch, judged together."""

    number: int

    @property
    def _what(self) -> str:
        return WHAT[self.number % len(WHAT)]

    @property
    def _joint(self) -> Joint:
        return joint_campaigns(JOINT_SEED, self.number, self._what)

    def documents(self) -> list[dict[str, Any]]:
        """All that are judged together."""
        return [document.campaign() for document in self._joint.documents]

    def diagnosed(self, documents: Sequence[dict[str, Any]]) -> Report:
        """Of several campaigns one report."""
        return diagnosed_by(joint.DIAGNOSED[self._what], documents)

    def truth(self) -> Truth:
        """What shows in all together: effects, of skins those that depart."""
        drawn = self._joint
        effects, shows = ([self._named(drawn, one) for one in some] for some in (drawn.hidden, that_show(drawn)))
        return {"what": self._what, "effects": sorted(filter(None, effects)), "shows": sorted(filter(None, shows))}

    def _named(self, drawn: Joint, hidden: Hidden) -> str:
        if self._what != "skins":
            return hidden.effect
        return drawn.documents[hidden.documents[0]].skin if hidden.departs else ""

    def grade(self, report: Report, truth: Truth, /) -> str:
        """Of skins by which depart, otherwise by the set of mechanisms."""
        if self._what != "skins":
            return super().grade(report, truth)
        return RIGHT if joint.departing(report) == set(truth["shows"]) else WRONG


@dataclass(frozen=True)
class Slips(Item):
    """A campaign of the virtual rig without slips, and with each slip of a lab."""

    number: int

    def documents(self) -> list[dict[str, Any]]:
        """The campaign as it is."""
        return [slips.document(SLIP_SEED, self.number)]

    def diagnosed(self, documents: Sequence[dict[str, Any]]) -> Report:
        """What the screening names in it without a slip, and with each."""
        del documents  # drawn again, since slips are judged by the rig's equations
        return slips.judged_campaign(SLIP_SEED, self.number)

    def truth(self) -> Truth:
        """The slips themselves are the truth."""
        return {}

    def grade(self, report: Report, _truth: Truth, /) -> str:
        """Right where every slip that can be told is named and none without one."""
        named, distinguishable = distinguishable_slips(report)
        if report["false"]:
            return WRONG
        return RIGHT if named == distinguishable else OPEN


@dataclass(frozen=True)
class Concealed(Item):
    """A campaign of another rig, from a folder of `UNDERSKIN_CAMPAIGNS`, with its truth in a file."""

    folder: str
    truths: str
    needs: ClassVar[str] = _CAMPAIGNS

    def documents(self) -> list[dict[str, Any]]:
        """One campaign."""
        return [json.loads((data_folder(_CAMPAIGNS) / self.folder / f"{self.name}.json").read_text(encoding="utf-8"))]

    @property
    def recorded_truth(self) -> Truth:
        """Its entry in the file of truths."""
        return dict(_read(data_folder(_CAMPAIGNS) / self.truths)[self.name])

    def truth(self) -> Truth:
        """Effects, and whether they show."""
        facts = self.recorded_truth
        value = {"d33": "d33_pc_per_n", "youngs_modulus": "youngs_modulus_mpa"}
        values = {name: facts[field] for name, field in value.items() if field in facts}
        return {
            **_identifiable_effects(facts, CURVE_THRESHOLD if "youngs_modulus" in values else THRESHOLD),
            **values,
        }


@dataclass(frozen=True)
class UnlistedLaw(Concealed):
    """The same with a law in no catalogue."""

    def truth(self) -> Truth:
        """The law, and whether it shows."""
        facts = self.recorded_truth
        law = f"{facts['law']['acts_on']} over {facts['law']['axis']}"
        return {
            "effects": [law],
            "shows": [law] if facts["identifiable"] else [],
            "d33": facts["d33_pc_per_n"],
        }

    def grade(self, report: Report, truth: Truth, /) -> str:
        """Right where it is recognised as unlisted and placed; open where it is recognised or left open."""
        judged = judged_by_law(self.name, self.recorded_truth, report)
        if not truth["shows"]:
            return RIGHT if report["verdict"] in judge.QUIET or judged["recognised"] else WRONG
        if judged["recognised"]:
            return RIGHT if judged["placed"] else OPEN
        return OPEN if report["verdict"] in ("ambiguous", "insufficient_data") else WRONG


@dataclass(frozen=True)
class Solved(Concealed):
    """A campaign made by solving the physics, judged by the scorer beside it."""

    def truth(self) -> Truth:
        """The effect, and the true d33 or E."""
        facts = self.recorded_truth
        quantity = "youngs_modulus" if "case" in facts else "d33"
        value = facts["youngs_modulus_mpa" if "case" in facts else "d33_pc_per_n"]
        return {"effects": [facts["effect"]], "shows": [], quantity: value}

    def grade(self, report: Report, _truth: Truth, /) -> str:
        """By the scorer's classes."""
        scorer = _module(data_folder(_CAMPAIGNS) / "solved-open" / "score.py")
        facts = self.recorded_truth
        judged = (scorer.grade_curve if "case" in facts else scorer.grade)(facts, report)
        return _SOLVED_GRADES[judged["cls"]]


@dataclass(frozen=True)
class Real(Item):
    """A real recording of `UNDERSKIN_RECORDINGS`, with what its owner says of it, judged by the judge beside it."""

    needs: ClassVar[str] = _RECORDINGS

    @property
    def recorded_truth(self) -> Truth:
        """Its entry in the file of truths."""
        return dict(_read(data_folder(_RECORDINGS) / "real" / "open" / "truth.json")[self.name])

    def documents(self) -> list[dict[str, Any]]:
        """Its files as text: what they are read as belongs to the answer."""
        facts = self.recorded_truth
        folder = data_folder(_RECORDINGS) / "real" / "open" / facts["folder"]
        paths = [folder / name for name in (*facts["files"], *([facts["rig"]] if facts["rig"] else []))]
        return [{"name": path.name, "content": path.read_bytes().hex()} for path in paths]

    def diagnosed(self, documents: Sequence[dict[str, Any]]) -> Report:
        """Read as the command line reads it; no report where it is refused."""
        from underskin import diagnose, diagnose_together, read_file
        from underskin.errors import UnderskinError
        from underskin.recordings.rig_description import parse

        contents = {one["name"]: bytes.fromhex(one["content"]) for one in documents}
        facts = self.recorded_truth
        try:
            rig = parse(contents[facts["rig"]], facts["rig"]) if facts["rig"] else None
            readings = [read_file(contents[name], name, rig) for name in facts["files"]]
            report = diagnose(readings[0]) if len(readings) == 1 else diagnose_together(readings, self.name)
        except UnderskinError as error:
            return {"verdict": "refused", "probability": 0.0, "statement": str(error), "mechanisms": []}
        return report.document

    def truth(self) -> Truth:
        """What its owner says."""
        return {
            "effects": self.recorded_truth["required"],
            "shows": self.recorded_truth["required"],
            "says": self.recorded_truth["truth"],
        }

    def grade(self, report: Report, _truth: Truth, /) -> str:
        """By the judge's words."""
        word = self.word(None if report["verdict"] == "refused" else report)
        return next(grade for grade, words in _GRADES.items() if word in words)

    def word(self, report: Report | None) -> str:
        """What the judge says of a report; None where the recording was refused."""
        judging = _module(data_folder(_RECORDINGS) / "real" / "judge.py")
        return str(judging.judge(self.recorded_truth, report)[0])


def _concealed(kind: type[Concealed], folder: str, truths: str) -> list[Item]:
    names = sorted(_read(data_folder(_CAMPAIGNS) / truths))
    return [kind(name, folder, truths) for name in names]


PARTS: dict[str, Callable[[], list[Item]]] = {
    "frf": lambda: [DrawnFrf(f"{FRF_SEED}-{number:03d}", number) for number in range(FRFS)],
    "curves": lambda: [DrawnRawCurves(f"{CURVE_SEED}-{number:03d}", number) for number in range(CURVES)],
    "joint": lambda: [DrawnJoint(f"{JOINT_SEED}-{number:03d}", number) for number in range(JOINT)],
    "slips": lambda: [Slips(f"{SLIP_SEED}-{number:03d}", number) for number in range(SLIPS)],
    "open": lambda: _concealed(Concealed, "open", "open-truth.json"),
    "curves-open": lambda: _concealed(Concealed, "curves-open", "curves-open-truth.json"),
    "unlisted-open": lambda: _concealed(UnlistedLaw, "unlisted-open", "unlisted-open-truth.json"),
    "solved-frf": lambda: _concealed(Solved, "solved-open/frf", "solved-open/truth_frf.json"),
    "solved-curves": lambda: _concealed(Solved, "solved-open/curves", "solved-open/truth_curves.json"),
    "real": lambda: [Real(name) for name in sorted(_read(data_folder(_RECORDINGS) / "real" / "open" / "truth.json"))],
}  # fmt: skip
NEEDS = {name: _CAMPAIGNS for name in PARTS if name.endswith("-open") or name.startswith("solved")} | {
    "open": _CAMPAIGNS,
    "real": _RECORDINGS,
}


def _identifiable_effects(facts: Mapping[str, Any], threshold: float) -> Truth:
    """The effects, and the visible ones: all together gain in χ² over the base model, and each over the others.

    All of them if the single gains are unknown; two effects that cancel each other are not visible.
    """
    effects = list(facts["effects"])
    if not effects or not facts["identifiable"]:
        return {"effects": sorted(effects), "shows": []}
    gains = list(facts.get("chi2_gain_of_each") or [])
    if isinstance(facts.get("chi2_gain_of_each"), Mapping):
        gains = list(facts["chi2_gain_of_each"].values())
    if len(effects) == 1 or len(gains) != len(effects):
        return {"effects": sorted(effects), "shows": sorted(effects)}
    seen = [effect for effect, gain in zip(effects, gains, strict=True) if gain is None or gain > threshold]
    return {"effects": sorted(effects), "shows": sorted(seen)}


@cache
def _module(path: Path) -> ModuleType:
    """A Python file that lies beside the data."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
