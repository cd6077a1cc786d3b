"""`report/1` in the OpenAPI document describes every field of every report, whatever its verdict and its recordings."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import orjson
import pytest

from tests.support.cases import first
from tests.support.diagnosed import report, table
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.document_schemas import report_validator
from tests.support.kinds_campaigns import BLOCK, curves, lines
from tests.support.lean_reports import BESIDE_SKINS, COSTLY, beside, lean_report
from tests.support.mechanism_campaigns import compression_campaign, indentation_campaign
from underskin import diagnose
from underskin.recordings.campaign import Campaign, FrfRecording, parse

MADE = Made(sensors=3, repeats=2)
VALID = report_validator()


def notched() -> Campaign:
    """A response that has lost what no mechanism takes."""

    def without(entry: FrfRecording) -> FrfRecording:
        assert entry.frequency_hz is not None
        assert entry.frf_re_pc_per_n is not None
        depth = 1 - 0.3 / (1 + ((entry.frequency_hz - 20.0) / 3.0) ** 2)
        return replace(entry, frf_re_pc_per_n=entry.frf_re_pc_per_n * depth)

    whole = campaign(replace(MADE, lines=40), table())
    kept = [without(entry) for entry in whole.recordings if isinstance(entry, FrfRecording)]
    return replace(whole, recordings=tuple(kept))


def handled() -> Campaign:
    """A gain that follows a word of the lab's own."""
    whole = campaign(replace(MADE, lines=20, repeats=3), table())
    operators, gains = ("ab", "cd", "ef"), (1.0, 1.15, 0.9)
    changed = []
    for number, entry in enumerate(whole.recordings):
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        who = int(np.random.default_rng(number).integers(3))
        changed.append(
            replace(entry, frf_re_pc_per_n=entry.frf_re_pc_per_n * gains[who], conditions={"operator": operators[who]})
        )
    return replace(whole, recordings=tuple(changed))


def with_block() -> Campaign:
    """FRFs of a skin whose modulus is declared wrongly, and a block that tells."""
    whole = lines(9.0)
    return parse({**whole, "recordings": [*whole["recordings"], *curves("compression", BLOCK, 9.0)]})


FEW = beside("modulus_error", "moving_contact_edge", "strain_stiffening", "preload_dependent_d33")
ALIKE = replace(MADE, mechanisms=("modulus_error",), parameters=(1.3,), preloads_n=(0.5, 1.0, 2.0), spheres_mm=(10.0,))
CAMPAIGNS: dict[str, Callable[[], Campaign]] = {
    "insufficient_data": lambda: replace(whole := campaign(MADE, table()), recordings=whole.recordings[:1]),
    "unexplained": notched,
    "ambiguous": lambda: campaign(ALIKE, table()),
    "no_mismatch": lambda: campaign(MADE, table()),
}
KINDS: dict[str, Callable[[], Campaign]] = {
    "FRFs and a block": with_block,
    "compression": compression_campaign,
    "words": handled,
    "indentation": indentation_campaign,
}


def require_described(made: Mapping[str, Any]) -> None:
    VALID.validate(orjson.loads(orjson.dumps(made, option=orjson.OPT_SERIALIZE_NUMPY)))


@pytest.mark.slow
@pytest.mark.parametrize("verdict", first(2, CAMPAIGNS))
def test_a_report_of_every_verdict_is_described(verdict: str) -> None:
    made = diagnose(CAMPAIGNS[verdict](), table(), without=FEW).document
    assert made["verdict"] == verdict
    require_described(made)


@pytest.mark.slow
@pytest.mark.parametrize("kind", first(2, KINDS))
def test_a_report_on_every_kind_of_recording_is_described(kind: str) -> None:
    require_described(
        lean_report(KINDS[kind](), table(), *(BESIDE_SKINS if kind in ("words", "FRFs and a block") else COSTLY))
    )


SPOILT: tuple[tuple[tuple[Any, ...], Any], ...] = (
    (("verdict",), "perhaps"),
    (("probability",), "high"),
    (("mechanisms", 0, "parameters", 0, "low"), "small"),
    (("findings", 0, "code"), "no_such_code"),
    (("fit", "before", "nonsense"), 1.0),
    (("d33", "quotable"), None),
)


@pytest.mark.slow
def test_other_documents_are_not_reports() -> None:
    VALID.validate(report())
    for place, value in SPOILT:
        entry = changed = orjson.loads(orjson.dumps(report()))
        for step in place[:-1]:
            entry = entry[step]
        entry[place[-1]] = value
        assert not VALID.is_valid(changed), place
