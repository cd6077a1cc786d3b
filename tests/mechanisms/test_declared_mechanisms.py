"""Mechanisms that a lab declares in files: read by a whitelist, with derivatives, refused with line and reason."""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import underskin
from tests.support.declared_documents import refusal
from underskin.autodiff import Differentiated
from underskin.cli.mechanism import app
from underskin.errors import FileError, InvalidInput
from underskin.mechanisms.declared import saving
from underskin.mechanisms.declared.document import parse
from underskin.mechanisms.declared.mechanism import read, value_of
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable, load_table

WARM = """\
schema: mechanism/1
name: warm_skin
description: The skin softens as it warms up.
acts_on: modulus
axes: [temperature_c]
law: 1 - softening * (temperature_c - 23)
parameters:
  softening: {unit: 1/°C, low: 0, high: 0.1, prior: {mean: 0.01, sd: 0.01}, limit: 0}
source: Our own measurements.
"""


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    recordings = []
    for number, entry in enumerate(reference_campaign("frf").recordings):
        assert isinstance(entry, FrfRecording)
        recordings.append(replace(entry, conditions={"temperature_c": 20.0 + 0.7 * number}))
    return replace(reference_campaign("frf"), recordings=tuple(recordings))


@pytest.mark.parametrize(
    "law",
    [
        "__import__('os').system('true')",
        "softening.__class__",
        "(lambda: 1)()",
        "[softening for softening in (1,)]",
        "softening if temperature_c else 1",
        "softening < 1",
        "temperature_c[0]",
        "open",
        "'text'",
        "True * softening",
        "exp(softening, 1)",
        "exp(x=softening)",
        "1e300 * softening",
        "softening // 2",
        "softening @ 2",
        "not softening",
        "softening := 1",
        "f'{softening}'",
        "1 +",
        "(" * 300,
        "softening" + "+ 1" * 200,
        "0 - " * 90 + "softening ** " * 90 + "1",
    ],
)
def test_what_is_no_arithmetic_is_refused_with_its_line(law: str) -> None:
    error = refusal(WARM.replace("1 - softening * (temperature_c - 23)", json.dumps(law)))
    assert error.file == "lab.yaml"
    assert error.place == "line 6"
    assert error.reason.startswith("law")


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("mechanism/1", "mechanism/2", 1, "must be mechanism/1"),
        ("warm_skin", "Warm Skin", 2, "lower case"),
        ("acts_on: modulus", "acts_on: colour", 4, "must be one of gain"),
        ("axes: [temperature_c]", "axes: temperature_c", 5, "must be a list"),
        ("[temperature_c]", "[temperature_c, frequency_hz]", 5, "frequency_response only"),
        ("[temperature_c]", "[temperature_c, order]", 5, "is not in the law"),
        ("high: 0.1", "high: -1", 8, "must be above low"),
        ("sd: 0.01", "sd: 0", 8, "must be above 0"),
        ("limit: 0", "limits: 0", 8, "is no field"),
        ("low: 0,", "low: yes,", 8, "must be a number"),
        ("low: 0,", "low: 123456789012345678901234567890,", 8, "must be a number"),
        ("high: 0.1", "high: 1.0e-300", 8, "in magnitude"),
        ("low: 0, high: 0.1", "low: 0, high: 1.0e-20", 8, "must lie within"),
        (
            "softening: {unit: 1/°C, low: 0, high: 0.1, prior: {mean: 0.01, sd: 0.01}",
            "softening: {unit: 1/°C, low: 0, high: 1.0e-20",
            8,
            "must change the law",
        ),
        (
            "high: 0.1, prior: {mean: 0.01, sd: 0.01}",
            "high: 0.1, prior: {mean: 0.01, sd: 1.0e+10}",
            8,
            "1% of the prior",
        ),
        ("sd: 0.01", "sd: 1.0e-12", 8, "must be above 1e-06 of the range"),
        ("1/°C", '"\\0"', 8, "printable"),
        ("The skin softens as it warms up.", '"abc \\ud800"', 3, "description: the character U+D800"),
        ("The skin softens as it warms up.", '"abc \\a"', 3, "U+0007"),
        ("description: The", '"\\udfff": The', 3, "U+DFFF"),
        ("(temperature_c - 23)", "(temperature_c - 23) / (i - i)", 8, "must change the law"),
        ("source: Our own measurements.", "colour: red", 9, "is no field"),
        ("law: 1 -", "law: 1 - other *", 6, "must be one of"),
        ("schema: mechanism/1", "schema: [", 3, "not YAML"),
    ],
)
def test_a_bad_document_is_refused_with_line_and_reason(old: str, new: str, line: int, said: str) -> None:
    error = refusal(WARM.replace(old, new))
    assert error.place == f"line {line}"
    assert said in error.reason


def test_references_are_refused() -> None:
    assert "references" in refusal(WARM + "description2: &a text\nother: *a\n").reason


def test_expressions_and_their_derivatives_are_those_of_numpy() -> None:
    text = "exp(-x) + log(x) * sqrt(x) / x ** 2 - sin(x) * cos(x) + tanh(x) + max(x, 1) * min(x, 3) + step(x - 2) + pi"
    expression = read(text, "law", {"x"})

    def plain(x: float) -> float:
        return float(
            np.exp(-x) + np.log(x) * np.sqrt(x) / x**2 - np.sin(x) * np.cos(x) + np.tanh(x)
            + max(x, 1) * min(x, 3) + (x > 2) + np.pi
        )  # fmt: skip

    for x in (0.5, 1.7, 2.5, 4.0):
        found = value_of(expression, {"x": Differentiated(np.array([x]), np.ones((1, 1)))})
        assert isinstance(found, Differentiated)
        assert found.value[0] == pytest.approx(plain(x))
        assert found.slopes[0, 0] == pytest.approx((plain(x + 1e-6) - plain(x - 1e-6)) / 2e-6, abs=1e-6)
    power = value_of(read("2 ** n", "law", {"n"}), {"n": Differentiated(np.array([3.0]), np.ones((1, 1)))})
    assert isinstance(power, Differentiated)
    assert (power.value[0], power.slopes[0, 0]) == pytest.approx((8.0, 8.0 * np.log(2.0)))
    assert complex(np.asarray(value_of(read("exp(i * pi)", "law", set()), {}))) == pytest.approx(-1.0)


def test_a_declared_modulus_is_that_of_a_skin_so_much_softer(campaign: Campaign, table: SigmaTable) -> None:
    mechanism = parse(WARM.encode(), "lab.yaml").bind(campaign, table)
    assert mechanism.unsupported(campaign, "frf") is None
    model = FrfModel([mechanism], campaign, table)
    fit = np.array([entry.start for entry in model.parameters])
    fit[0] = 0.04
    found = model.predict(fit).value
    for number, entry in enumerate(campaign.recordings):
        factor = 1 - 0.04 * (20.0 + 0.7 * number - 23)
        skin = replace(campaign.skin, youngs_modulus_mpa=2.0 * factor)
        base = FrfModel((), replace(campaign, skin=skin, recordings=(entry,)), table)
        expected = base.predict(np.array([one.start for one in base.parameters])).value
        assert found[model.recording == number] == pytest.approx(expected, rel=2e-3)


def test_a_campaign_without_the_column_does_not_support_it(campaign: Campaign) -> None:
    bare = replace(campaign, recordings=tuple(replace(entry, conditions=None) for entry in campaign.recordings))
    reason = parse(WARM.encode(), "lab.yaml").unsupported(bare, "frf")
    assert reason is not None
    assert "temperature_c" in reason


def test_a_declared_response_follows_frequency_and_amplitude(campaign: Campaign, table: SigmaTable) -> None:
    text = """\
schema: mechanism/1
name: lossy_contact
description: Friction turns the phase by an angle that grows with the dynamic force.
acts_on: frequency_response
axes: [dynamic_force_n, frequency_hz]
law: exp(-i * loss * dynamic_force_n / 0.1 * (frequency_hz / 100) ** 0.1)
parameters:
  loss: {unit: "-", low: -1, high: 1, prior: {mean: 0, sd: 0.2}, limit: 0}
source: A bench.
"""
    mechanism = parse(text.encode(), "lab.yaml")
    model, plain = FrfModel([mechanism], campaign, table), FrfModel((), campaign, table)
    fit = np.array([entry.start for entry in model.parameters])
    fit[0] = 0.3
    ratio = model.predict(fit).value / plain.predict(fit[1:]).value
    for number, entry in enumerate(campaign.recordings):
        assert isinstance(entry, FrfRecording)
        assert entry.frequency_hz is not None
        expected = np.exp(-0.3j * entry.dynamic_force_n / 0.1 * (entry.frequency_hz / 100) ** 0.1)
        assert ratio[model.recording == number] == pytest.approx(expected)


def report_of(law: str, parameters: dict[str, float], **unnamed: Any) -> dict[str, Any]:
    document = {"acts_on": "modulus", "axis": "recorded_at", "form": "saturating", "expression": "E = …", **unnamed}
    return {
        "campaign": "c", "verdict": "unexplained", "unnamed": document,
        "provenance": {"unnamed": {"law": law, "parameters": parameters}},
    }  # fmt: skip


def test_the_law_of_a_report_is_kept_and_read_again() -> None:
    name = "unnamed_modulus__recorded_at__saturating"
    kept = report_of(name, {"law_change": -0.2, "law_approach": 3.0}, range={"recorded_at_h": [8.0, 18.0]})
    text = saving.document(kept, "warm_up")
    mechanism = parse(text.encode(), "warm_up.yaml")
    names = {"change", "approach", "recorded_at"}
    law = read(mechanism.laws[0].text, "law", names)
    value = value_of(law, {"change": -0.2, "approach": 3.0, "recorded_at": np.array([8.0, 18.0])})
    assert np.asarray(value) == pytest.approx([1.0, 0.8])


def test_what_no_expression_says_is_not_kept() -> None:
    free = report_of("unnamed_modulus__order__free", {"law_change_1": 1.0}, form="free", range={"order": [0, 9]})
    with pytest.raises(InvalidInput, match="smooth course"):
        saving.document(free, "course")
    with pytest.raises(InvalidInput, match="must hold a law"):
        saving.document({"verdict": "explained", "unnamed": None}, "none")


def test_the_commands_check_and_save(tmp_path: Path) -> None:
    good, bad, report = tmp_path / "good.yaml", tmp_path / "bad.yaml", tmp_path / "report.json"
    good.write_text(WARM)
    bad.write_text(WARM.replace("temperature_c - 23", "temperature_c < 23"))
    result = CliRunner().invoke(app, ["check", str(good), str(bad)])
    assert result.exit_code == 2
    assert "warm_skin can be used" in result.output
    assert "line 6" in result.output
    name = "unnamed_gain__y_mm__linear__low"
    kept = report_of(name, {"law_change": 0.2}, acts_on="gain", axis="y_mm", form="linear", range={"y_mm": [-12, 12]})
    report.write_text(json.dumps(kept))
    result = CliRunner().invoke(app, ["save", str(report), "drawn_film", "--folder", str(tmp_path / "lab")])
    assert result.exit_code == 0, result.output
    saved = (tmp_path / "lab" / "drawn_film.yaml").read_bytes()
    assert parse(saved, "drawn_film.yaml").name == "drawn_film"


def test_a_file_that_takes_long_to_parse_is_refused_in_another_process() -> None:
    """Brackets within brackets take the pure Python loader a time that grows with the square of their number."""
    began = time.process_time()
    assert "nested more than" in refusal("[" * 99_000).reason
    assert time.process_time() - began < 2


def test_json_is_read_with_all_its_characters() -> None:
    """A character beyond 16 bits is a pair of escapes in JSON."""
    document = {**yaml.safe_load(WARM), "description": "It is warm: \N{SUN WITH FACE}"}
    text = json.dumps(document)
    assert "\\ud83c" in text
    assert parse(text.encode(), "lab.json").plain == document["description"]


def test_a_file_of_the_folder_that_cannot_be_used_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The catalogue lists the others; no diagnosis is made without it."""
    (tmp_path / "a.yaml").write_text(WARM.replace("high: 0.1, prior: {mean: 0.01, sd: 0.01}", "high: 1.0e-300"))
    (tmp_path / "b.yaml").write_text(WARM)
    (tmp_path / "c.yaml").write_text(WARM)
    (tmp_path / "d.yaml").mkdir()
    monkeypatch.setenv("UNDERSKIN_MECHANISMS", str(tmp_path))
    CATALOGUE.reload()
    try:
        assert "warm_skin" in CATALOGUE
        refused = [(Path(error.file).name, error.place) for error in CATALOGUE.refused]
        assert refused == [("a.yaml", "line 8"), ("d.yaml", ""), ("c.yaml", "name")]
        listed = CliRunner().invoke(app, ["list"])
        assert (listed.exit_code, "warm_skin" in listed.output, "a.yaml: line 8" in listed.output) == (2, True, True)
        with pytest.raises(FileError, match=r"a\.yaml: line 8: parameters\.softening\.high"):
            underskin.diagnose(reference_campaign("frf"))
    finally:
        monkeypatch.undo()
        CATALOGUE.reload()
