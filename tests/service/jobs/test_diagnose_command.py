"""`underskin diagnose --campaign`: reports of campaigns that a service keeps."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.diagnosed import MOST, sent, small, small_report
from tests.support.store_server import Server
from underskin.cli.app import app


def test_reports_of_kept_campaigns_are_those_of_the_service(working: Server, tmp_path: Path) -> None:
    reports = tmp_path / "reports"
    kept, few = sent(working, small()), [word for name in MOST for word in ("--without", name)]
    given = ["--campaign", kept, "--campaign", "nowhere", "--url", str(working.http.base_url), *few]
    result = CliRunner().invoke(app, ["diagnose", *given, "--output-dir", str(reports), "--html"])
    assert result.exit_code == 2
    assert f"{kept}: Contact resonance" in result.stderr
    assert "nowhere: 404" in result.stderr
    assert json.loads((reports / f"{kept}.json").read_text(encoding="utf-8")) == small_report()
    assert "contact resonance" in (reports / f"{kept}.html").read_text(encoding="utf-8")
    assert len(list(reports.iterdir())) == 2


@pytest.mark.parametrize("given", [[], ["a/palm.json", "b/palm.json"]])
def test_what_to_diagnose_must_be_given_once(given: list[str], tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["diagnose", *given, "--output-dir", str(tmp_path / "reports")])
    assert result.exit_code == 2
    assert not (tmp_path / "reports").exists()


def test_a_report_never_overwrites_its_campaign(tmp_path: Path) -> None:
    file = tmp_path / "palm.json"
    file.write_text("{}", encoding="utf-8")
    result = CliRunner().invoke(app, ["diagnose", str(file), "--output-dir", str(tmp_path)])
    assert result.exit_code == 2
    assert "overwrite" in result.stderr
    assert file.read_text(encoding="utf-8") == "{}"
