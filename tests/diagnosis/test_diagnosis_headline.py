"""The first sentence of a statement: mechanisms with their own probability, then the sets that hold them."""

from typing import Any

from tests.diagnosis.test_diagnosis_statements import answers_of
from underskin.diagnosis.reporting.answer_statement import OfAnswer, answer_statement
from underskin.diagnosis.selection.answers import Answer
from underskin.surrogate.sigma_table import SigmaTable


def present(**probabilities: float) -> list[dict[str, Any]]:
    return [
        {"mechanisms": names.split("_or_"), "name": names, "parameters": [], "probability": probability}
        for names, probability in probabilities.items()
    ]


def test_the_headline_is_by_mechanism_then_come_the_sets(table: SigmaTable) -> None:
    weights = {("adhesion",): 0.822, ("adhesion", "contact_creep"): 0.163}
    answers, there = answers_of(table, weights), present(adhesion=0.985, contact_creep=0.163)
    of_answer = OfAnswer(groups=there, mechanisms=there[:1])
    said = answer_statement(answers, "explained", kind="indentation", of_answer=of_answer)
    assert said.startswith(
        "Hertz's law lacks adhesion (98.5 %). By sets: adhesion (82.2 %), or contact creep and adhesion (16.3 %); "
        "adhesion: the skin sticks"
    )
    assert said.count(". ") == 1

    both = [Answer(answers[1].explanation, 0.82), Answer(answers[0].explanation, 0.16)]
    there = present(adhesion=0.98, contact_creep=0.82)
    said = answer_statement(both, "explained", of_answer=OfAnswer(groups=there, mechanisms=there))
    assert said.startswith(
        "The paper's model lacks contact creep (82 %) and adhesion (98 %). By sets: contact creep and "
    )


def test_what_every_rival_holds_is_stated_though_the_sets_are_ambiguous(table: SigmaTable) -> None:
    weights = {("ageing", "misalignment"): 0.5, ("ageing",): 0.48}
    answers = answers_of(table, weights)
    there = present(ageing=0.98, misalignment=0.5)
    said = answer_statement(answers, "ambiguous", of_answer=OfAnswer(groups=there, mechanisms=there))
    assert said.startswith(
        "The paper's model lacks ageing (98 %), but these recordings cannot tell what else. "
        "By sets: misalignment and ageing (50 %), or ageing (48 %)"
    )
    with_twins = present(ageing=0.98, adhesion_or_contact_creep=0.9)
    said = answer_statement(answers, "ambiguous", of_answer=OfAnswer(groups=with_twins))
    assert said.startswith("Ageing (98 %) and adhesion or contact creep (90 %): these recordings cannot tell which. ")


def test_a_leader_with_a_twin_is_named_with_it(table: SigmaTable) -> None:
    answers = answers_of(table, {("ageing",): 0.85, ("misalignment",): 0.13})
    twins = present(ageing_or_misalignment=0.98)
    said = answer_statement(answers, "explained", of_answer=OfAnswer(groups=twins))
    assert said.startswith("The paper's model lacks ageing or misalignment (98 %), rather ageing (85 %). By sets: ")
