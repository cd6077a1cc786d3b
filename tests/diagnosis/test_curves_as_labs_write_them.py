"""Curves with signs, units and courses as benches write them: E is right, or none is stated."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import underskin
from tests.cli.commands import run
from tests.support.cases import first
from tests.support.lean_reports import beside, quick_diagnosis
from underskin.errors import InvalidInput
from underskin.inversion.elastomer import of_campaign
from underskin.recordings.block_modulus import CompressionModulus
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, SkinDescription
from underskin.units import Floats

pytestmark = pytest.mark.slow

SKIN = SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=None)
QUICKLY = [word for name in beside("strain_stiffening", "platen_friction") for word in ("--without", name)]
E_MPA, RADIUS_MM = 2.0, 4.0
HERTZ = 4 / 3 * E_MPA / 0.75 * np.sqrt(RADIUS_MM)  # N/mm^1.5


def sphere(depth: Floats, force: Floats, time: Floats | None = None, modulus_mpa: float | None = None) -> Campaign:
    noise = 1e-3 * np.random.default_rng(5).standard_normal(len(force)) * np.abs(force).max()
    curve = IndentationRecording(
        id="curve", indenter_radius_mm=RADIUS_MM, displacement_mm=depth, force_n=force + noise, time_s=time
    )
    return Campaign("bench", replace(SKIN, youngs_modulus_mpa=modulus_mpa), (curve,))


def way_in() -> tuple[Floats, Floats]:
    """Depth [mm] and force [N] of a press from the air to 0.5 mm."""
    depth = np.concatenate([np.linspace(-0.05, 0, 80, endpoint=False), np.linspace(0, 0.5, 400)])
    return depth, HERTZ * np.maximum(depth, 0) ** 1.5


def uniaxial(strain: Floats, stress: Floats, signs_checked: bool | None = None) -> Campaign:
    """A sample 40 mm long and 5 mm across."""
    force = np.pi / 4 * 25 * stress
    force = force + 1e-3 * np.abs(force).max() * np.random.default_rng(3).standard_normal(len(force))
    curve = CompressionRecording("strip", 40.0, 5.0, 40 * strain, force, signs_checked=signs_checked)
    return Campaign("bench", SKIN, (curve,))


def pulled(modulus_mpa: float, largest: float) -> tuple[Floats, Floats]:
    """Strain and nominal stress [MPa] of a neo-Hookean solid, positive as it is pulled."""
    stretch = 1 + np.linspace(0, largest, 300)
    return stretch - 1, modulus_mpa / 3 * (stretch - stretch**-2)


def modulus(report: underskin.Report) -> tuple[float, float] | None:
    stated = report.fit.after.youngs_modulus if report.fit is not None else None
    return None if stated is None or stated.low is None or stated.high is None else (stated.low, stated.high)


def holds(report: underskin.Report, modulus_mpa: float) -> bool:
    ends = modulus(report)
    return ends is not None and ends[0] < modulus_mpa < ends[1]


@pytest.mark.parametrize("sign", [1, -1])
def test_pulled_strip_of_either_sign(sign: int) -> None:
    """The curve tells that a strip was pulled, whatever its signs."""
    strain, stress = pulled(0.6, 0.8)
    report = quick_diagnosis(uniaxial(sign * strain, sign * stress))
    assert report.verdict == "no_mismatch"
    assert holds(report, 0.6)
    turned = [finding for finding in report.findings if finding.code == "sign_flipped"]
    assert ["of one that is pulled" in finding.statement for finding in turned] == ([True] if sign > 0 else [])


def test_strip_pulled_beyond_its_height() -> None:
    """A strip whose pull counts positive, longer than it is high, was not pressed: no slip of units is suspected."""
    strain, stress = pulled(0.6, 2.0)
    report = quick_diagnosis(uniaxial(strain, stress))
    assert report.verdict == "no_mismatch"
    assert holds(report, 0.6)
    assert [finding.code for finding in report.findings] == ["sign_flipped"]
    (found,) = of_campaign(uniaxial(strain, stress))
    assert isinstance(found.result, CompressionModulus)
    assert found.result.load == "tension"
    assert found.result.modulus == pytest.approx(0.6e6, rel=0.02)


def test_a_foam_whose_height_is_in_another_unit() -> None:
    """A foam that softens as it is pressed half its height, stated ten times too small, was not pulled: both readings
    are named, and no modulus is read."""
    strain = np.linspace(0, 0.5, 300)
    (found,) = of_campaign(uniaxial(10 * strain, 0.05 * np.tanh(strain / 0.05) + 0.2 * strain**4))
    assert isinstance(found.result, InvalidInput)
    assert all(words in str(found.result) for words in ("sample_height_mm, 40: is that height in mm", "pulled"))


def test_pressed_block_counted_negative() -> None:
    """A block whose curve is that of one that is pressed is not taken as pulled for its signs."""
    strain, stress = pulled(0.6, -0.25)
    report = quick_diagnosis(uniaxial(strain, stress))
    assert report.verdict == "no_mismatch"
    assert holds(report, 0.6)


def test_plateau_of_either_load_stays_open() -> None:
    """Where mechanisms bend the curve of a pulled sample and of a pressed one alike, nothing is explained."""
    strain = np.linspace(0, 0.3, 300)
    report = quick_diagnosis(uniaxial(strain, 0.015 * np.tanh(20 * strain)))
    assert "pulled_or_pressed" in {finding.code for finding in report.findings}
    assert report.verdict == "ambiguous"
    assert modulus(report) is None


def test_checked_signs_bind() -> None:
    """Signs that the lab has checked are not turned round, whatever the curve looks like; and no set explains curves
    whose held-out part it predicts worse than the base model, and far from the noise."""
    strain, stress = pulled(0.6, 0.8)
    report = quick_diagnosis(uniaxial(strain, stress, signs_checked=True))
    assert "sign_flipped" not in {finding.code for finding in report.findings}
    assert report.fit is not None
    before, after = report.fit.before.heldout_rmse_percent, report.fit.after.heldout_rmse_percent
    assert before is not None
    assert after is not None
    assert after > before
    assert report.verdict == "ambiguous"
    assert "predicted no better" in report.statement


@pytest.mark.parametrize(("unit", "in_newtons"), [("gf", 9.80665e-3), ("mN", 1e-3)])
def test_force_without_its_unit(unit: str, in_newtons: float) -> None:
    """A modulus that no elastomer has is a unit that is not the heading's, and no result."""
    depth, force = way_in()
    report = quick_diagnosis(sphere(depth, force / in_newtons))
    assert report.verdict == "insufficient_data"
    assert f"N for {unit}" in report.statement
    declared = quick_diagnosis(sphere(depth, force / in_newtons, modulus_mpa=3.0))
    assert f"N for {unit}" in declared.statement


def test_soft_rail_of_cell() -> None:
    """Where the force that is read bends over with the depth, no law of it tells E."""
    depth, force = way_in()
    report = quick_diagnosis(sphere(depth, 2.2 * np.tanh(force / 2.2)))
    assert report.verdict not in ("explained", "no_mismatch")
    assert modulus(report) is None or holds(report, E_MPA)


@pytest.mark.parametrize("lead_s", first(1, [2.0, 0.0]))
def test_creep_under_held_force(lead_s: float) -> None:
    """A sphere that sinks in under a held force shows creep: of a solid with one time, 40 % of it."""
    time = np.arange(0, 60, 0.1)
    force = np.clip((time - lead_s) / 2, 0, 1)
    relaxed, tau = 0.6 * E_MPA, 5.0
    grown = np.diff(force, prepend=0.0)

    def compliance(age: Floats) -> Floats:
        return 0.75 * (1 / relaxed - (1 / relaxed - 1 / E_MPA) * np.exp(-age * (relaxed / E_MPA) / tau))

    cubes = np.array([compliance(time[at] - time[: at + 1]) @ grown[: at + 1] for at in range(len(time))])
    depth = (3 / (4 * np.sqrt(RADIUS_MM)) * cubes) ** (2 / 3)
    depth = depth + 2e-4 * np.random.default_rng(8).standard_normal(len(depth))
    report = quick_diagnosis(sphere(depth, force, time), "contact_creep")
    assert [mechanism.name for mechanism in report.mechanisms] == ["contact_creep"]
    assert report.verdict == "explained"
    assert holds(report, E_MPA)


def test_backlash_is_taken_out_whole() -> None:
    """Play at the turn is taken out as large as it is: nothing of it is left."""
    depth, force = way_in()
    back = np.concatenate([depth, depth[::-1] + 0.008])
    report = quick_diagnosis(sphere(back, np.concatenate([force, force[::-1]]), np.linspace(0, 48, 960)))
    assert "reading_steps" in {finding.code for finding in report.findings}
    assert report.verdict == "no_mismatch"
    assert holds(report, E_MPA)


def test_curves_together_without_frfs(tmp_path: Path) -> None:
    """Files of one block each are diagnosed as one, and state sizes in their headers."""
    for height in (20, 10, 5):
        factor = 1 + 2 * (20 / (4 * height)) ** 2 * 0.8  # friction of 0.8
        stretch = 1 - np.linspace(0, 0.2, 200)
        force = np.pi * 100 / 3 * factor * (stretch**-2 - stretch)
        force = force + 1e-3 * force.max() * np.random.default_rng(height).standard_normal(200)
        rows = "\n".join(f"{height * (1 - at):.6g},{load:.6g}" for at, load in zip(stretch, force, strict=True))
        head = f"# Sample height [mm]: {height}\n# Sample diameter [mm]: 20\nDisplacement (mm),Force (N)\n"
        (tmp_path / f"block-{height}.csv").write_text(head + rows + "\n")
    files = [str(tmp_path / f"block-{height}.csv") for height in (20, 10, 5)]
    answer = run("diagnose", *files, *QUICKLY, "--together", "blocks", "--output-dir", str(tmp_path))
    assert answer.returncode == 0, answer.stderr
    report = json.loads((tmp_path / "blocks.json").read_text())
    assert report["campaign"] == "blocks"
    assert [mechanism["name"] for mechanism in report["mechanisms"]] == ["platen_friction"]


def test_signs_of_rig_description_bind(tmp_path: Path) -> None:
    """A rig description that states both signs is not overruled by the look of the curve."""
    depth, force = way_in()
    rows = "\n".join(f"{-at:.6g},{-load:.6g}" for at, load in zip(depth, force, strict=True))
    (tmp_path / "curve.csv").write_text(f"Depth (mm),Force (N)\n{rows}\n")
    rig = (
        "schema: rig/1\nkind: indentation\nskin: {poisson_ratio: 0.5}\nrecording: {indenter_radius_mm: 4}\n"
        "channels: {displacement_mm: {channel: Depth, sign: SIGN}, force_n: {channel: Force, sign: SIGN}}\n"
    )
    for sign in (1, -1):
        (tmp_path / "rig.yaml").write_text(rig.replace("SIGN", str(sign)))
        given = ("--rig", str(tmp_path / "rig.yaml"), "--output-dir", str(tmp_path / str(sign)))
        answer = run("diagnose", str(tmp_path / "curve.csv"), *QUICKLY, *given)
        report = json.loads((tmp_path / str(sign) / "curve.json").read_text())
        assert "sign_flipped" not in {finding["code"] for finding in report["findings"]}, answer.stdout
        assert (report["verdict"] == "no_mismatch") == (sign == -1)
