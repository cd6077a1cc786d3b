"""`underskin d33 FILE... --together NAME`: a file a press, one array."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.commands import refused, run
from tests.support.simulated_campaign import Rig, simulate
from underskin import load_table
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.readers import json_file


@pytest.fixture(scope="module")
def palm() -> Campaign:
    d33 = 14 * np.exp(np.random.default_rng(2).normal(0, 0.05, 4))  # pC/N
    rig = Rig(d33, preloads_n=(1.0, 2.0), indenters_mm=(4.0,), frequency_hz=np.geomspace(5, 130, 12))
    return replace(simulate(load_table(), rig, np.random.default_rng(3)), name="palm")


@pytest.fixture
def presses(palm: Campaign, tmp_path: Path) -> list[str]:
    """A file for each recording, which knows its own sensor only and calls the recording r."""
    names = []
    for number, recording in enumerate(one for one in palm.recordings if isinstance(one, FrfRecording)):
        sensors = tuple(sensor for sensor in palm.skin.sensors if sensor.id == recording.sensor)
        skin = replace(palm.skin, sensors=sensors)
        one = Campaign(f"press {number}", skin, (replace(recording, id="r"),))
        (tmp_path / f"press-{number}.json").write_bytes(json_file.write(one))
        names.append(str(tmp_path / f"press-{number}.json"))
    return names


def figures(text: str) -> list[dict[str, str]]:
    return [{name: value for name, value in row.items() if name != "file"} for row in csv.DictReader(io.StringIO(text))]


@pytest.mark.slow
def test_files_together_tell_what_one_file_of_all_would(palm: Campaign, presses: list[str], tmp_path: Path) -> None:
    (tmp_path / "all.json").write_bytes(json_file.write(palm))
    whole = run("d33", str(tmp_path / "all.json"), "--csv")
    parts = run("d33", *presses, "--together", "palm 3", "--csv")
    assert (parts.returncode, figures(parts.stdout)) == (0, figures(whole.stdout))
    assert {row["file"] for row in csv.DictReader(io.StringIO(parts.stdout))} == {"palm 3"}
    assert "8 recordings have ids that several files use" in parts.stderr
    shown = run("d33", *presses, "--together", "palm/3", "--figures", str(tmp_path / "pages")).stdout
    assert (shown.splitlines()[0], shown.count("d33 of the array")) == ("palm/3", 2)  # and by the solved contact
    assert "assumes the paper's model" in shown  # whether it can be quoted
    assert [page.name for page in (tmp_path / "pages").iterdir()] == ["palm-3.html"]


@pytest.mark.slow
def test_together_needs_files_and_a_name(presses: list[str]) -> None:
    assert "--together goes with FILE" in refused("d33", "--together", "palm")
    assert "together = '': must be a printable text" in refused("d33", presses[0], "--together", "")
