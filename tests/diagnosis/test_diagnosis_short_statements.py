"""Statements have three sentences at most, whatever there is to say; what they leave out stands elsewhere."""

import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from proof.slip_kinds import SLIPS, Case
from rig.draw import drawn, record
from rig.drawn_campaign import documents_and_truth
from rig.joint import drawn_joint
from rig.recorded import campaign as rig_campaign
from tests.support.cases import first
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.html_report import page
from underskin.diagnosis.reporting.sentences import clause, of_clauses, small
from underskin.diagnosis.several.campaigns import diagnose_together
from underskin.diagnosis.several.fleet import diagnose_fleet
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, from_dict, parse
from underskin.surrogate.sigma_table import SigmaTable

SEED = 940501
SEVERAL = 2 if SOAK else 1
TOGETHER = ("dates", "compression", "skins")
CURVES = {"indentation": [0, 1, 2], "compression": [1, 0, 2]}  # of those first run, one brings long statements

# Those that make the longest statements, one of each kind, stand first.
TELLING = [
    "charge peak-to-peak", "sensor at a tenth", "cables exchanged", "dead sensor", "warm-up, rising",
    "polarity at random", "force rms", "a third conjugated",
]  # fmt: skip

Report = dict[str, Any]
Making = Callable[[SigmaTable], Iterator[Report]]


def sentences(statement: str) -> list[str]:
    """Split after a mark that ends a sentence: before a capital, and after any full stop with a space behind it."""
    return re.split(r"(?<=[.!?]) +(?=[\"'(]?[A-Z])|(?<=\.) +", statement)


def of_lines(table: SigmaTable) -> Iterator[Report]:
    for number in first(1, [2, 0, 1, 3]):
        for hidden in ("none", "single", "pair", "unknown"):
            yield diagnosis_report(parse(rig_campaign(record(drawn(SEED, number, hidden)))), table)


def with_slips(table: SigmaTable) -> Iterator[Report]:
    for number in first(1, [2, 1]):
        recorded = record(drawn(SEED, number, "single"))
        made, _ = from_dict(rig_campaign(recorded))
        case = Case(made, recorded, np.full(len(recorded.exact), 0.02))
        for slip in first(6, [*TELLING, *sorted(SLIPS.keys() - TELLING)]):
            wrong = SLIPS[slip][0](case, np.random.default_rng(3))
            if wrong is not None:
                report = diagnosis_report(wrong.campaign, table)
                yield {**report, "campaign": slip}


def of_curves(table: SigmaTable) -> Iterator[Report]:
    for kind, numbers in CURVES.items():
        for number in first(1, numbers):
            ((document,), _) = documents_and_truth(SEED, number, kind, None)
            yield diagnosis_report(parse(document), table)


def of_several(table: SigmaTable) -> Iterator[Report]:
    for number in range(SEVERAL):
        for what in first(2, TOGETHER):
            campaigns = [parse(document) for document in drawn_joint(SEED, number, what)[0]]
            if what == "dates":
                yield diagnose_together(campaigns, table, what)
            elif what == "skins":
                yield diagnose_fleet(by_skin(campaigns), table, what)
            else:
                yield diagnosis_report(campaigns[0], table)


def by_skin(campaigns: list[Campaign]) -> dict[str, list[Campaign]]:
    return {str(one.skin.id): [other for other in campaigns if other.skin.id == one.skin.id] for one in campaigns}


@pytest.fixture(scope="module")
def made(table: SigmaTable) -> Callable[[Making], list[Report]]:
    """The reports of one of the functions above, which several tests read and none changes."""
    return cache(lambda making: list(making(table)))


@pytest.mark.slow
@pytest.mark.parametrize("making", [of_lines, with_slips, of_curves, of_several])
def test_a_statement_has_three_sentences_at_most(making: Making, made: Callable[[Making], list[Report]]) -> None:
    seen = made(making)
    assert len(seen) >= (6 if SOAK else 2)
    long = [report["statement"] for report in seen if not 1 <= len(sentences(report["statement"])) <= 3]
    assert long == []


@pytest.mark.slow
def test_a_slip_that_decides_comes_before_the_verdict(made: Callable[[Making], list[Report]]) -> None:
    begun = [report for report in made(with_slips) if report["verdict"] != "insufficient_data"]
    decided = [report for report in begun if "apart from that, " in sentences(report["statement"])[0]]
    assert len(decided) >= 5
    for report in decided:
        before = small(sentences(report["statement"])[0].partition("; apart from that, ")[0])
        assert any(clause(entry["statement"])[:40] in before for entry in report["findings"]), report["statement"]


@pytest.mark.slow
def test_what_a_statement_does_not_say_stands_on_the_page(made: Callable[[Making], list[Report]]) -> None:
    for report in made(of_lines):
        shown = " ".join(re.sub(r"<[^>]+>", " ", page(report)).replace("&#39;", "'").replace("&#34;", '"').split())
        assert all(" ".join(CATALOGUE[entry["name"]].plain.split()) in shown for entry in report["mechanisms"])
        if report["d33"] is not None:
            assert f"{report['d33']['value']:.4g}" in shown


def test_several_sentences_become_one_and_names_stay_as_they_are() -> None:
    said = clause("The cable is loose. Hertz's law lacks it. Was it in kN? Left out, see Nr. 3.")
    assert said == "The cable is loose; Hertz's law lacks it; was it in kN? – left out, see Nr.\N{NO-BREAK SPACE}3"
    assert (
        of_clauses(["d33 fell", "A cell drifts"], [], [""], ["E from FRFs"]) == "d33 fell; a cell drifts. E from FRFs."
    )
    assert len(sentences(of_clauses([said], [said]))) == 2


def test_names_with_full_stops_stay_whole_within_a_sentence() -> None:
    names = ["Palm 2. Upper", "Was it 3.5? No", "May"]
    said = of_clauses([f"a layer in {names[0]} alone"], [f"d33 fell between {names[1]} and {names[2]}"], names=names)
    assert len(sentences(said)) == 2
    shown = said.replace("\N{NO-BREAK SPACE}", " ")
    assert all(name in shown for name in names)
    assert said.startswith("A layer in Palm 2.\N{NO-BREAK SPACE}Upper alone. ")
