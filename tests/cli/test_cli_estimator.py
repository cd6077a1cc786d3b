"""`--estimator` of the commands that read files themselves."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.commands import run
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
def test_what_the_command_says_counts_for_more_than_the_file_and_lines_are_left(tmp_path: Path) -> None:
    file = written(tmp_path, "H1")
    by_file, chosen = run("d33", str(file), "--csv"), run("d33", str(file), "--csv", "--estimator", "H2")
    assert (by_file.returncode, chosen.returncode) == (0, 0), chosen.stderr
    assert d33_of_series(by_file.stdout) == pytest.approx(d33_of_series(chosen.stdout), rel=0.02)
    assert "makes H1 too small" in by_file.stderr
    assert "makes H1 too small" not in chosen.stderr
    assert "look at: H2 is for time series, which 1 of 3 recordings are not" in chosen.stderr
    assert "H2 is for time series" not in by_file.stderr
