"""Diagnoses in processes and on a cluster: the same reports, to the byte."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bench.soak import SOAK
from tests.support.dask_cluster import local_cluster
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside
from underskin.cli.app import app
from underskin.recordings.campaign import to_dict
from underskin.surrogate.sigma_table import load_table

RESONANT = Made(
    mechanisms=("contact_resonance",), parameters=(6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0, sensors=2
)
ALONE = Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,))


@pytest.mark.soak
def test_reports_and_pages_are_the_same_on_a_dask_cluster_and_in_processes(tmp_path: Path) -> None:
    files = [tmp_path / f"palm-{number}.json" for number in range(2)]
    for file, made in zip(files, (replace(RESONANT, sensors=1, lines=10, preloads_n=(0.6, 2.4)), ALONE), strict=True):
        file.write_text(json.dumps(to_dict(campaign(made, load_table()))), encoding="utf-8")
    torn = tmp_path / "torn.json"
    torn.write_text("{", encoding="utf-8")
    left_out = [word for name in beside("contact_resonance", "ageing") for word in ("--without", name)]
    given = ["diagnose", *map(str, files), str(torn), "--html", *left_out]

    def written(folder: str, *options: str) -> dict[str, bytes]:
        result = CliRunner().invoke(app, [*given, "--output-dir", str(tmp_path / folder), *options])
        assert result.exit_code == 2
        assert "torn.json" in result.stderr
        return {file.name: file.read_bytes() for file in (tmp_path / folder).iterdir()}

    here = written("here", "--workers", "1")
    with local_cluster() as cluster:
        there = written("there", "--scheduler", cluster.scheduler_address)
    assert sorted(here) == ["palm-0.html", "palm-0.json", "palm-1.html", "palm-1.json"]
    assert there == here
    if SOAK:
        assert written("processes", "--workers", "2") == here


@pytest.mark.slow
def test_a_single_file_is_diagnosed_with_one_blas_thread(tmp_path: Path) -> None:
    """As it is in a process of many: so that its report is the same on any machine."""
    file = tmp_path / "palm.json"
    file.write_text(json.dumps(to_dict(campaign(ALONE, load_table()))), encoding="utf-8")
    code = (
        "import threadpoolctl\nfrom underskin.cli.app import app\n"
        f"app(['diagnose', {str(file)!r}, '--output-dir', {str(tmp_path)!r} + '/reports'], standalone_mode=False)\n"
        "print({pool['num_threads'] for pool in threadpoolctl.threadpool_info()})"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "{1}"


@pytest.mark.slow
def test_a_cluster_that_does_not_answer_is_named(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="the cluster extra is not installed")
    address = "tcp://127.0.0.1:1"
    file = tmp_path / "palm.json"
    file.write_text("{}", encoding="utf-8")
    result = CliRunner().invoke(
        app, ["diagnose", str(file), "--output-dir", str(tmp_path / "reports"), "--scheduler", address]
    )
    assert isinstance(result.exception, Exception)
    assert address in str(result.exception)
