"""`underskin diagnose --rig`: a raw indentation from a spring's deflection, with what was taken for what."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.lean_reports import COSTLY
from underskin.cli.app import app

RIG = """\
schema: rig/1
kind: indentation
units_checked: true
skin: {poisson_ratio: 0.5}
recording: {indenter_radius_mm: 0.0075}
channels:
  displacement_mm: {channel: Piezo, unit: um, labelled: nm, sign: -1, deflection: {channel: Deflection}}
  force_n: {channel: Deflection, spring_constant_n_per_m: {property: k (N/m)}}
"""


def hertz(file: Path) -> None:
    """A sphere of 7.5 um on 1 MPa, 3 N/m behind it; the heading of the piezo says nm and means um."""
    depth = 1e-6 * np.concatenate([np.linspace(-1, 2, 60), np.linspace(2, -1, 60)])
    force = 4 / 3 * 1e6 / 0.75 * np.sqrt(7.5e-6) * np.maximum(depth, 0) ** 1.5
    deflection = (force + 2e-8 * np.random.default_rng(1).normal(size=120)) / 3
    rows = [f"{-1e6 * (z + d):.6f}\t{1e9 * d:.3f}" for z, d in zip(depth, deflection, strict=True)]
    file.write_text("\n".join(["k (N/m)\t3", "Piezo\tDeflection", "nm\tnm", "eoh", *rows]))


@pytest.mark.slow
def test_a_raw_curve_is_diagnosed_with_a_rig_description(tmp_path: Path) -> None:
    file, rig = tmp_path / "curve.txt", tmp_path / "rig.yaml"
    hertz(file)
    rig.write_text(RIG)
    fewer = [word for name in COSTLY for word in ("--without", name)]
    asked = ["diagnose", str(file), *fewer, "--output-dir", str(tmp_path / "reports")]
    without = CliRunner().invoke(app, asked)
    assert without.exit_code == 2
    assert "a rig description must say what its channels are (" in without.stderr
    assert "; it has Piezo [nm], Deflection [nm]" in without.stderr
    assert "names from line 2, units from line 3" in without.stderr
    told = CliRunner().invoke(app, [*asked, "--rig", str(rig)])
    assert told.exit_code == 0
    assert "read force_n: 'Deflection' in nm, a deflection, times 3 N/m: " in told.stderr
    assert "look at: channel 'Piezo' is labelled 'nm'; the rig description says 'um'" in told.stderr
    report = json.loads((tmp_path / "reports" / "curve.json").read_text())
    assert report["verdict"] == "no_mismatch"
