"""`underskin d33 FILE...` as a user runs it on campaigns, instrument files, and files that cannot be read."""

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.commands import FRF, SKIN, refused, run
from tests.support.instrument_files import EXAMPLES
from tests.support.simulated_campaign import Rig, simulate
from underskin import load_table
from underskin.inversion.invert import invert
from underskin.recordings.campaign import Campaign, CompressionRecording, SkinDescription
from underskin.recordings.readers import json_file
from underskin.units import to_lab

CURVE = "Compression (mm),Load (N)\n" + "".join(f"{0.1 * step:.1f},{0.4 * step:.2f}\n" for step in range(40))


@pytest.fixture(scope="module")
def palm() -> Campaign:
    """An array in which one sensor is weak."""
    random = np.random.default_rng(5)
    d33 = np.append(14 * np.exp(random.normal(0, 0.02, 5)), 4.0)  # pC/N
    rig = Rig(d33, preloads_n=(0.5, 1.0, 2.0), frequency_hz=np.geomspace(5, 130, 12))
    campaign = simulate(load_table(), rig, random)
    return replace(campaign, name="palm")


@pytest.fixture
def file(palm: Campaign, tmp_path: Path) -> Path:
    path = tmp_path / "palm.json"
    path.write_bytes(json_file.write(palm))
    return path


@pytest.mark.slow
def test_csv_has_the_inversions_numbers(palm: Campaign, file: Path) -> None:
    found = invert(palm, load_table())
    answer = run("d33", str(file), "--csv")
    assert answer.returncode == 0
    array, relative, *others = csv.DictReader(io.StringIO(answer.stdout))
    sensors, cells = others[:6], others[6:]
    assert found.absolute_d33 is not None
    assert found.campaign_d33 is not None
    assert (relative["level"], relative["d33_pc_per_n"]) == ("array_relative", array["d33_pc_per_n"])
    assert float(relative["d33_high_pc_per_n"]) == pytest.approx(to_lab("d33_pc_per_n", found.campaign_d33.high), 1e-12)
    assert (array["level"], array["sensor"]) == ("array", "")
    for name in ("value", "uncertainty", "low", "high"):
        column = "d33_pc_per_n" if name == "value" else f"d33_{name}_pc_per_n"
        assert float(array[column]) == pytest.approx(to_lab("d33_pc_per_n", getattr(found.absolute_d33, name)), 1e-12)
        assert [float(row[column]) for row in sensors] == pytest.approx(
            to_lab("d33_pc_per_n", getattr(found.sensors, name)), rel=1e-12
        )
        assert [float(row[column]) for row in cells] == pytest.approx(
            to_lab("d33_pc_per_n", getattr(found.cells.d33, name)), rel=1e-12
        )
    assert {row["level"] for row in sensors} == {"sensor"}
    assert [row["flags"] for row in sensors] == [*5 * [""], "weak"]
    keys = {(row["sensor"], float(row["indenter_radius_mm"]), float(row["preload_n"])) for row in cells}
    assert keys == {(f"s{n}", radius, preload) for n in range(6) for radius in (4, 10) for preload in (0.5, 1, 2)}
    assert {row["recordings"] for row in cells} == {"1"}
    assert "left out: sensor s5: weak" in answer.stderr


@pytest.mark.slow
def test_the_table_shows_array_sensors_band_and_what_is_left_out(palm: Campaign, file: Path) -> None:
    shown = run("d33", str(file)).stdout
    found = invert(palm, load_table())
    assert f"palm ({file})" in shown
    for title, d33 in (("d33 of the array", found.absolute_d33), ("relative to others", found.campaign_d33)):
        assert d33 is not None
        value, low, high = (float(to_lab("d33_pc_per_n", getattr(d33, name))) for name in ("value", "low", "high"))
        assert re.search(rf"{title} +{value:.4g} ± \S+ pC/N \(95 %: {low:.4g} to {high:.4g}\)", shown)
    assert re.search(r"band +5 to 130 Hz: no resonance in any recording; it is the whole recorded range", shown)
    assert re.search(r"s5 .* weak: 2\d % of the array's median", shown)
    assert "left out: sensor s5: weak" in shown
    assert "look at" not in shown


@pytest.mark.slow
def test_unreadable_files_and_recordings_are_named_and_the_others_inverted(palm: Campaign, tmp_path: Path) -> None:
    document = json.loads(json_file.write(palm))
    document["recordings"][3]["preload_n"] = -1
    (tmp_path / "one.json").write_text(json.dumps(document))
    (tmp_path / "cut.json").write_text(json.dumps(document)[:100])
    document["skin"]["thickness_mm"] = 0.0025
    (tmp_path / "slip.json").write_text(json.dumps(document))
    (tmp_path / "good.json").write_bytes(json_file.write(palm))
    names = [str(tmp_path / name) for name in ("cut.json", "slip.json", "one.json", "nowhere.json", "good.json")]
    answer = run("d33", *names)
    assert answer.returncode == 2
    errors = answer.stderr.splitlines()
    assert [line.split(": ")[1] for line in errors] == [names[0], names[1], names[3]]
    assert "line 1" in errors[0]
    assert "skin.thickness_mm = 0.0025" in errors[1]
    assert "No such file" in errors[2]
    assert answer.stdout.count("d33 of the array") == 2
    assert "left out: recording r3: preload_n = -1" in answer.stdout
    assert run("d33", names[2]).returncode == 0


@pytest.mark.slow
def test_a_campaign_that_tells_nothing_says_why(palm: Campaign, tmp_path: Path) -> None:
    document = json.loads(json_file.write(palm))
    for recording in document["recordings"]:
        recording["preload_n"] = 500
    (tmp_path / "hard.json").write_text(json.dumps(document))
    answer = run("d33", str(tmp_path / "hard.json"))
    assert answer.returncode == 2
    assert (
        "no d33: preload_n: no preload is below 500 N: they look 1000 × too large; were they given in mN?"
        in answer.stdout
    )
    for recording in document["recordings"]:
        recording["preload_n"] = -1
    (tmp_path / "refused.json").write_text(json.dumps(document))
    refused = run("d33", str(tmp_path / "refused.json")).stdout.splitlines()
    assert refused[1] == f"no d33: none of the {len(document['recordings'])} recordings can be used"
    assert refused[2:-1] == [  # one line for all that are refused alike
        "left out: recordings r0, r1, r2 and 33 more: preload_n = -1.0: must be finite and greater than 0 (N)"
    ]


@pytest.mark.slow
def test_instrument_files_need_a_rig_and_tell_the_modulus(tmp_path: Path) -> None:
    (tmp_path / "block.csv").write_text(CURVE)
    rig = tmp_path / "rig.yaml"
    text = (EXAMPLES / "rigs" / "silicone-compression.yaml").read_text()
    rig.write_text(text.replace("  time_s: {channel: Time (s)}\n", ""))
    told = run("d33", str(tmp_path / "block.csv"), "--rig", str(rig))
    assert told.returncode == 0
    # 4 N/mm on 30 mm of height and 50 mm of diameter
    modulus = 4 * 30 / (np.pi / 4 * 50**2)
    assert re.search(rf"block +{modulus:.4g} .* compression: straight from 0 to 13 % strain, and not seen", told.stdout)
    assert "no d33" not in told.stdout
    assert re.search(
        r"^read the text as: rows of \d numbers from line \d+ to \d+, separated by", told.stdout, re.MULTILINE
    )
    assert re.search(r"^read force_n: 'Load \(N\)' in N: .* N$", told.stdout, re.MULTILINE)
    without = run("d33", str(tmp_path / "block.csv"))
    assert without.returncode == 2
    assert "a rig description must say what its channels are (`underskin read FILE --draft" in without.stderr
    assert "Compression (mm)" in without.stderr
    nowhere = run("d33", str(tmp_path / "block.csv"), "--rig", str(tmp_path / "none.yaml"))
    assert (nowhere.returncode, "none.yaml: cannot be opened" in nowhere.stderr) == (2, True)
    rig.write_text(text.replace("rig/1", "rig/9"))
    wrong = run("d33", str(tmp_path / "block.csv"), "--rig", str(rig))
    assert (wrong.returncode, wrong.stderr) == (2, f"underskin: {rig}: schema = 'rig/9': must be rig/1\n")


@pytest.mark.slow
def test_a_pulled_sample_is_not_called_compressed(palm: Campaign, tmp_path: Path) -> None:
    """The modulus of a pulled cylinder is said to be by tension."""
    stretch = np.linspace(1.0, 1.5, 60)
    force = -9 * np.pi / 3 * (stretch - stretch**-2)
    strip = CompressionRecording(
        id="strip", sample_height_mm=20.0, sample_diameter_mm=6.0, displacement_mm=20 * (1 - stretch), force_n=force
    )
    (tmp_path / "strip.json").write_bytes(json_file.write(replace(palm, recordings=(strip,))))
    told = run("d33", str(tmp_path / "strip.json"))
    assert re.search(r"strip +1 .* tension: neo-Hookean from 0 to 50 % strain", told.stdout), told.stdout
    assert "compression" not in told.stdout


@pytest.mark.parametrize(("relaxes", "sign", "held"), [(0.0, 1, True), (0.3, -1, True), (0.0, 1, False)])
def test_d33_of_a_block_that_relaxes(relaxes: float, sign: int, held: bool, palm: Campaign, tmp_path: Path) -> None:
    """E of a block whose force falls while it is held, of either sign, lies between two moduli, which is said with it;
    where it is not held, as in half a period of a sine, its force falls as it turns."""
    time = np.arange(0.0, 40.0, 0.1)
    strain = np.minimum(time / 40, 0.1) if held else 0.1 * np.sin(np.pi * time / time[-1])
    force = (
        sign * 100.0 * ((1 - strain) ** -2 - (1 - strain)) * (1 - relaxes * (1 - np.exp(-np.maximum(time - 4, 0) / 5)))
    )
    force = force + 0.02 * np.random.default_rng(1).standard_normal(400)
    block = CompressionRecording(
        id="held", sample_height_mm=10.0, sample_diameter_mm=12.0, displacement_mm=10 * strain, force_n=force,
        time_s=time,
    )  # fmt: skip
    (tmp_path / "held.json").write_bytes(json_file.write(replace(palm, recordings=(block,))))
    told = re.search(
        r"the force falls by up to (\S+) % while the displacement is held",
        run("d33", str(tmp_path / "held.json")).stdout,
    )
    assert (told is not None) == (relaxes > 0)
    assert told is None or float(told[1]) == pytest.approx(30, rel=0.1)


@pytest.mark.slow
def test_d33_and_modulus_of_one_campaign(palm: Campaign, tmp_path: Path) -> None:
    strain = np.linspace(0, 0.1, 50)
    area_mm2 = np.pi / 4 * 12.0**2
    block = CompressionRecording(
        id="block", sample_height_mm=10.0, sample_diameter_mm=12.0, displacement_mm=10 * strain,
        force_n=16 * strain * area_mm2,
    )  # fmt: skip
    idle = replace(block, id="idle", force_n=0 * strain)
    (tmp_path / "both.json").write_bytes(json_file.write(replace(palm, recordings=(*palm.recordings, block, idle))))
    shown = run("d33", str(tmp_path / "both.json"))
    assert shown.returncode == 0
    assert "d33 of the array" in shown.stdout
    assert re.search(r"block +16 ", shown.stdout)
    assert "left out: recording idle: force_n" in shown.stdout


@pytest.mark.slow
def test_figures_are_pages_that_need_nothing_else(file: Path, tmp_path: Path) -> None:
    assert run("d33", str(file), "--figures", str(tmp_path / "new" / "figures")).returncode == 0
    (page,) = (tmp_path / "new" / "figures").iterdir()
    assert page.name == "palm.json.html"
    text = page.read_text(encoding="utf-8")
    assert text.count("plotly.js v") == 1  # the script is inside, once
    assert re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=", text) == []
    drawn = [json.loads(figure) for figure in re.findall(r'"figure-\d",\s*(\[\{.*?\}\]),\s*\{', text)]
    assert [[trace["name"] for trace in traces if "name" in trace] for traces in drawn] == [
        ["d33", "not different from the others", "marked", "marked"],
        ["R 4 mm, measured", "R 4 mm, model", "R 10 mm, measured", "R 10 mm, model"],
        ["sensor", "marked"],
    ]
    assert "left out" in text.lower()
    assert "sensor s5: weak" in text


def test_figures_of_two_files_of_one_name_are_refused(file: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / "palm.json"
    other.write_bytes(file.read_bytes())
    assert "would hold two files' figures" in refused("d33", str(file), str(other), "--figures", str(tmp_path / "f"))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["d33", "x.json", *SKIN], "--indenter-radius-mm is for columns; files say it themselves"),
        (["d33", *SKIN, "--preload-n", "1", "--frf-pc-per-n", "7", "--band", "1,2"], "--band goes with FILE"),
        (["d33", "x.json", "--band", "100"], "band = '100': must be two frequencies in Hz"),
        (["d33", "x.json", "--band", "100,10"], "the lower one first"),
        ([*FRF, "x.json", "--preload-n", "1"], "unexpected extra argument"),
    ],
)
def test_wrong_usage_is_one_line(arguments: list[str], says: str) -> None:
    assert says in refused(*arguments)


@pytest.mark.parametrize("sign", [1, -1])
def test_modulus_of_a_block_says_what_it_takes_of_the_machine(tmp_path: Path, sign: int) -> None:
    """A block of k = E A/h on a frame of stiffness K reads low by k/K: it says from which K on that exceeds its ±.

    Platens that hold the ends of a block with S = D/4H raise it by 2 S². A machine may count compression negative.
    """
    force = np.linspace(0, 30, 120)
    block = CompressionRecording(
        id="block",
        sample_height_mm=5.0,
        sample_diameter_mm=20.0,
        displacement_mm=force / 400 + force / 200,
        force_n=sign * force,
    )
    path = tmp_path / "frame.json"
    path.write_bytes(json_file.write(Campaign("frame", SkinDescription(poisson_ratio=0.5), (block,))))
    answer = run("d33", path)
    frame, platens = (line for line in answer.stdout.splitlines() if line.startswith("before you quote E"))
    assert float(re.findall(r"softer than (\d+) N/mm", frame)[0]) > 200
    assert "raise it by up to 200 %" in platens
