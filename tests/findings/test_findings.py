"""Findings are codes with arguments: the page explains each code, each reason has words, and no sentence is logic."""

import ast
import inspect
import re
import string
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.repository import ROOT
from underskin.array_stress.request import read_request
from underskin.errors import ErrorCode, FileError, InvalidInput, not_one_of, required, unequal_lengths, wrong_type
from underskin.findings.codes import FindingCode, Lack, Lacking, Reason
from underskin.findings.finding import ENGLISH, LACKING, OPTIONAL, Finding, Words, lacking, statement
from underskin.findings.sentences import ImplausibleD33, UnitGuess
from underskin.recordings.campaign import from_dict, parse
from underskin.units import checked

SOURCES = [
    path for package in ("underskin", "service") for path in sorted((ROOT / package).rglob("*.py")) if path.is_file()
]
PAGE = (ROOT / "docs" / "findings.md").read_text(encoding="utf-8")


def findings_made() -> Iterator[tuple[Path, ast.Call]]:
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "Finding(" in text else ():
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Finding":
                yield path, node


def names_of(words: Words) -> tuple[set[str], set[str]]:
    """The arguments that words need, and those that they may have."""
    if isinstance(words, str):
        fields = [(field, spec or "") for _, field, spec, _ in string.Formatter().parse(words) if field is not None]
        named = {field for field, _ in fields}.union(*(names_of(spec)[1] for _, spec in fields))
        return named - set(OPTIONAL), named
    parameters = inspect.signature(words).parameters.values()
    return {one.name for one in parameters if one.default is one.empty}, {one.name for one in parameters}


def test_the_page_explains_each_code_once() -> None:
    findings, _, errors = PAGE.partition("## Errors")
    for part, codes in ((findings, FindingCode), (errors, ErrorCode)):
        explained = re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE)
        assert sorted(explained) == sorted(codes)


def test_no_percent_is_less_than_nothing() -> None:
    assert "(0 % of the array's median)" in statement(Reason.DEAD, {"percent": -1e-3})


def test_each_code_has_a_reason_and_each_reason_words() -> None:
    assert {reason.code for reason in Reason} == set(FindingCode) - {FindingCode.SEATING}  # of stored reports
    assert set(ENGLISH) == set(Reason)
    assert set(LACKING) == set(Lack)


def test_each_reason_is_used() -> None:
    """As `Reason.NAME` somewhere beside the enumeration and the words."""
    own = {"codes.py", "finding.py"}
    text = "".join(path.read_text(encoding="utf-8") for path in SOURCES if path.name not in own)
    assert [reason.name for reason in Reason if f"Reason.{reason.name}" not in text] == []


def test_arguments_of_findings_are_those_that_their_words_need() -> None:
    """Where a finding is made with its arguments written out."""
    checked = 0
    for path, call in findings_made():
        reason, arguments = call.args[0], call.args[3] if len(call.args) > 3 else None
        if not isinstance(reason, ast.Attribute) or not isinstance(arguments, ast.Dict):
            continue
        given = {ast.literal_eval(key) for key in arguments.keys if key is not None}
        needed, possible = names_of(ENGLISH[Reason[reason.attr]])
        if None not in arguments.keys:
            assert needed <= given, f"{path}:{call.lineno}: {needed - given}"
        assert given <= possible or "arguments" in possible or "bounds" in possible, f"{path}:{call.lineno}"
        checked += 1
    assert checked > 25


def test_a_finding_states_its_arguments() -> None:
    finding = Finding(Reason.DUPLICATED_RECORDING, "b", "force_n", {"original": "a"})
    assert finding.in_report() == {
        "code": "duplicated_recording",
        "recording": "b",
        "field": "force_n",
        "statement": "the same numbers as recording 'a': left out",
    }
    assert finding.sentence == "recording b: the same numbers as recording 'a': left out"
    row = Finding(
        Reason.D33_OF_ROW, "", "d33_pc_per_n", {"d33_pc_per_n": -3.0, "kind": ImplausibleD33.NEGATIVE, "more": 2}, 4
    )
    assert row.in_columns() == {
        "code": "implausible_d33",
        "field": "d33_pc_per_n",
        "index": 4,
        "statement": "d33 is -3 pC/N, negative: is the sign of charge or force turned? (2 more rows like it)",
    }
    assert len({finding, Finding(Reason.DUPLICATED_RECORDING, "b", "force_n", {"original": "a"}), row}) == 2


@pytest.mark.parametrize(
    ("guess", "words"),
    [
        (UnitGuess(0.0, "mm"), "a dead sensor?"),
        (UnitGuess(2500.0, "mm", ((2.5, "µm"),)), "2500 µm is 2.5 mm: was it given in µm?"),
        (
            UnitGuess(1e5, "MPa", ((100.0, "kPa"), (0.1, "Pa"))),
            "100000 kPa is 100 MPa, 100000 Pa is 0.1 MPa: was it given in kPa or Pa?",
        ),
        (UnitGuess(1e7, "mm", ((10.0, ""),), off_by=6), "off by a factor of 10^6? 10 mm would be usual"),
        (UnitGuess(1e99, "mm"), "no unit that we know explains it"),
    ],
)
def test_a_guess_at_the_unit(guess: UnitGuess, words: str) -> None:
    assert str(guess) == words


def test_a_lack_says_what_was_refused_before() -> None:
    few = {"recordings": 1, "least": 2}
    assert lacking(Lacking(Lack.FEW_RECORDINGS, few)).startswith("usable recordings: 1; at least 2")
    refused = Lacking(Lack.NO_RECORDING, {}, refused_recordings=3, refused_fields=("preload_n", "force_n"))
    assert lacking(refused) == (
        "3 recording(s) were refused for their preload_n and force_n (see findings), which leaves no recording can be "
        "used"
    )


def test_errors_carry_codes_that_survive_a_new_name() -> None:
    with pytest.raises(InvalidInput) as unlikely:
        checked("thickness_mm", 2500.0)
    assert unlikely.value.code == ErrorCode.UNLIKELY_MAGNITUDE
    again = unlikely.value.at("skin.thickness_mm")
    assert (again.field, again.code, again.allowed) == (
        "skin.thickness_mm",
        ErrorCode.UNLIKELY_MAGNITUDE,
        unlikely.value.allowed,
    )
    assert FileError("a.tdms", "", "is empty").code == ErrorCode.UNREADABLE_FILE


def test_errors_of_one_kind_have_one_sentence_and_one_code() -> None:
    for error, code, text in (
        (required("preload_n"), ErrorCode.REQUIRED, "preload_n: required"),
        (wrong_type("x_mm", "a", index=2), ErrorCode.WRONG_TYPE, "x_mm[2] = 'a': must be a number"),
        (not_one_of("kind", "b", ("frf", "c")), ErrorCode.NOT_ONE_OF, "kind = 'b': must be one of frf, c"),
        (not_one_of("schema", "b", ("rig/1",)), ErrorCode.NOT_ONE_OF, "schema = 'b': must be rig/1"),
        (
            unequal_lengths("b", 2, 3, "a", "rows"),
            ErrorCode.UNEQUAL_LENGTHS,
            "b = '2 rows': must have 3 rows, as many as a",
        ),
        (FileError("a.json", "line 1", "no").of_field("rig", "r"), ErrorCode.UNREADABLE_FILE, "rig = 'r': line 1: no"),
    ):
        assert (error.code, str(error)) == (code, text)


def test_what_is_wrong_with_a_load_has_a_code() -> None:
    sensors = [{"id": "s0", "x_mm": 0.0, "y_mm": 0.0}]
    document = {"thickness_mm": 2.5, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0, "sensors": sensors}
    contact = {"x_mm": 0.0, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0}
    pressure = {"x_mm": [0.0, 1.0], "y_mm": [0.0, 1.0], "pressure_mpa": [[0.0, -1.0], [0.0, 0.0]]}
    for change, code in (
        ({"sensors": []}, ErrorCode.TOO_FEW),
        ({}, ErrorCode.REQUIRED),
        ({"contacts": [contact]}, ErrorCode.REQUIRED),
        ({"pressure_map": pressure}, ErrorCode.OUT_OF_RANGE),
    ):
        with pytest.raises(InvalidInput) as refusal:
            read_request({**document, **change})
        assert refusal.value.code == code, refusal.value


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"preload_n": None}, ErrorCode.REQUIRED),
        ({"preload_n": "1 N"}, ErrorCode.WRONG_TYPE),
        ({"preload_n": -1.0}, ErrorCode.OUT_OF_RANGE),
        ({"preload_n": 1e6}, ErrorCode.UNLIKELY_MAGNITUDE),
        ({"preload": 1.0}, ErrorCode.UNKNOWN_FIELD),
        ({"frequency_hz": [2.0, 1.0, 3.0]}, ErrorCode.NOT_INCREASING),
        ({"frf_re_pc_per_n": [1.0, 2.0]}, ErrorCode.UNEQUAL_LENGTHS),
        ({"frf_re_pc_per_n": [1.0, 2.0, float("nan")]}, ErrorCode.NOT_FINITE),
        ({"sample_rate_hz": 1000.0}, ErrorCode.CONFLICTING),
        ({"kind": "tension"}, ErrorCode.NOT_ONE_OF),
        ({"sensor": "s9"}, ErrorCode.NOT_ONE_OF),
    ],
)
def test_what_is_wrong_with_a_recording_has_a_code(change: dict[str, Any], code: ErrorCode) -> None:
    recording = {
        "id": "r",
        "sensor": "s0",
        "indenter_radius_mm": 5.0,
        "preload_n": 1.0,
        "dynamic_force_n": 0.1,
        "frequency_hz": [1.0, 2.0, 3.0],
        "frf_re_pc_per_n": [1.0, 1.0, 1.0],
        "frf_im_pc_per_n": [0.0, 0.0, 0.0],
        **change,
    }
    skin = {"thickness_mm": 2.5, "youngs_modulus_mpa": 3.0, "sensor_radius_mm": 1.5, "poisson_ratio": 0.5}
    sensors = [{"id": "s0", "x_mm": 0.0, "y_mm": 0.0}]
    document = {"schema": "campaign/1", "name": "c", "skin": {**skin, "sensors": sensors}, "recordings": [recording]}
    _, problems = from_dict(document)
    assert [problem.code for problem in problems] == [code]
    with pytest.raises(InvalidInput) as refusal:
        parse(document)
    assert refusal.value.code == code
