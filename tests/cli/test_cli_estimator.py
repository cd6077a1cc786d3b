"""`--estimator` of the commands that read files themselves."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.commands import PRESSED, refused, run
from tests.support.cases import first
from tests.support.lean_reports import BESIDE_SKINS
from tests.support.store_server import campaign

RATE = 2000.0


def written(folder: Path, estimator: str | None = None) -> Path:
    """Two recordings of a sensor, as time series of 7 pC/N with noise of 30 % in the force alone, and one of lines."""
    random = np.random.default_rng(900_004)
    document: dict[str, Any] = campaign("shaken", sensors=1)
    lines = {**document["recordings"][0], "id": "lines"}
    for recording in document["recordings"]:
        force = 0.05 * random.standard_normal(8000)
        for field in ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence"):
            del recording[field]
        recording["sample_rate_hz"] = RATE
        recording["force_n"] = (2 + force + 0.015 * random.standard_normal(8000)).tolist()
        recording["charge_pc"] = (7 * force).tolist()
        if estimator is not None:
            recording["estimator"] = estimator
    document["recordings"].append(lines)
    file = folder / f"{estimator}.json"
    file.write_text(json.dumps(document))
    return file


def d33_of_series(output: str) -> float:
    """At 2 N, where there is a time series alone."""
    rows = csv.DictReader(io.StringIO(output))
    return next(float(row["d33_pc_per_n"]) for row in rows if (row["level"], row["preload_n"]) == ("cell", "2.0"))


@pytest.mark.slow
def test_command_says_counts_file_lines_left(tmp_path: Path) -> None:
    """What the command says counts for more than the file and lines are left."""
    file = written(tmp_path, "H1")
    by_file, chosen = run("d33", str(file), "--csv"), run("d33", str(file), "--csv", "--estimator", "H2")
    assert (by_file.returncode, chosen.returncode) == (0, 0), chosen.stderr
    assert d33_of_series(by_file.stdout) == pytest.approx(d33_of_series(chosen.stdout), rel=0.02)
    assert "makes H1 too small" in by_file.stderr
    assert "makes H1 too small" not in chosen.stderr
    assert "look at: H2 is for time series, which 1 of 3 recordings are not" in chosen.stderr
    assert "H2 is for time series" not in by_file.stderr


@pytest.mark.soak
def test_a_diagnosis_takes_it_too(tmp_path: Path) -> None:
    file = written(tmp_path)
    fewer = [part for name in BESIDE_SKINS for part in ("--without", name)]
    done = run("diagnose", str(file), *fewer, "--estimator", "Hv", "--output-dir", str(tmp_path / "reports"))
    assert done.returncode == 0, done.stderr
    assert "look at: Hv is for time series, which 1 of 3 recordings are not" in done.stderr
    reports = {}
    for name in first(1, ("H2", "H1")):
        done = run("diagnose", str(written(tmp_path, name)), *fewer, "--output-dir", str(tmp_path / name))
        given = run("diagnose", str(file), *fewer, "--estimator", name, "--output-dir", str(tmp_path / f"{name} given"))
        assert (done.returncode, given.returncode) == (0, 0), given.stderr
        reports[name] = [
            json.loads((tmp_path / folder / f"{stem}.json").read_text())["fit"]
            for folder, stem in ((name, name), (f"{name} given", "None"))
        ]
    by_hv = json.loads((tmp_path / "reports" / "None.json").read_text())["fit"]
    for of_the_file, given_fit in reports.values():
        assert of_the_file == given_fit != by_hv


@pytest.mark.slow
def test_columns_have_none(tmp_path: Path) -> None:
    columns = [part for name, value in PRESSED.items() for part in ("--" + name.replace("_", "-"), str(value))]
    line = refused("d33", *columns, "--preload-n", "1", "--frf-pc-per-n", "7", "--estimator", "Hv")
    assert line == "underskin: --estimator goes with FILE, and none is given"
    assert "'h1' is not one of" in refused("d33", str(written(tmp_path)), "--estimator", "h1")
