"""Joint campaigns: every document follows one truth, the same seed gives the same, and the truth says what shows."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from bench.soak import SOAK
from rig.commands import rig as command
from rig.description import parse
from rig.draw_elastomer import block_description, indentation_description
from rig.elastomer import record_curves
from rig.errors import RigError
from rig.joint import WHAT, drawn_joint, joint_campaigns
from rig.joint_campaign import D33_DEPARTURE, Joint
from rig.joint_fit import Prior, deviation, least_chi2
from rig.joint_hypotheses import hypothesis
from rig.joint_truth import joint_truth
from underskin.recordings import campaign as campaigns

QUICK = {"compression": 2, "skins": 2}  # that hide something and take a second or two
SKIN = {"thickness_mm": 2.5, "youngs_modulus_mpa": 2.0, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0}


def first(what: str, hides: set[str] | None = None) -> Joint:
    """The first joint campaigns of a kind that hide this."""
    for number in range(300):
        joint = joint_campaigns(2, number, what)
        if hides is None or {hidden.effect for hidden in joint.hidden} == hides:
            return joint
    raise AssertionError(f"no {what} hides {hides}")


def quiet(described: Any, effects: dict[str, Any]) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Entry, displacement from the touch and force of a drawn curve without what the instrument adds."""
    description = described(np.random.default_rng(3), "x", SKIN, effects)
    description["effects"].pop("platen_friction", None)
    experiment = parse(description)
    assert experiment.curves is not None
    bare = replace(experiment.curves, gain=0.0, cell_gain=0.0, force_zero_n=0.0, drift_n_per_s=0.0, drift_n_per_mm=0.0)
    curve = record_curves(replace(experiment, curves=bare))[0]
    return curve.entry, curve.exact_displacement_mm - curve.zero_mm, curve.exact_force_n


def neo_hookean(strain: np.ndarray) -> np.ndarray:
    """Nominal stress over the modulus, compression positive."""
    stretch = 1 - strain
    return np.asarray((stretch**-2 - stretch) / 3)


def test_a_block_is_as_stiff_as_its_shape_and_the_skins_modulus() -> None:
    entry, shortening, force = quiet(block_description, {"modulus_error": {"factor": 3.0}})
    area = np.pi / 4 * entry["sample_diameter_mm"] ** 2
    expected = 2.0 * area * neo_hookean(shortening / entry["sample_height_mm"])
    assert force == pytest.approx(expected, abs=1e-9 * force.max())


def test_platens_that_hold_the_block_make_it_stiffer_by_the_shape_factor() -> None:
    for number in range(8):
        joint = joint_campaigns(4, number, "compression")
        curves, document = joint.documents[0].curves, joint.documents[0]
        assert curves is not None
        if {"strain_stiffening", "contact_creep"} & set(curves.experiment.effects):
            continue
        friction = float(curves.experiment.effects.get("platen_friction", {}).get("friction", 0.0))
        for curve in curves.recorded:
            entry = curve.entry
            shape = entry["sample_diameter_mm"] / (4 * entry["sample_height_mm"])
            area = np.pi / 4 * entry["sample_diameter_mm"] ** 2
            strain = (curve.exact_displacement_mm - curve.zero_mm) / entry["sample_height_mm"]
            slope = np.polyfit(neo_hookean(strain), curve.exact_force_n, 1)[0] / area
            assert slope == pytest.approx(document.true_modulus_mpa * (1 + 2 * friction * shape**2), rel=0.15)


def test_a_sphere_on_the_skin_follows_hertz_at_its_modulus() -> None:
    entry, depth, force = quiet(indentation_description, {})
    hertz = 4 / 3 * 2.0 / 0.75 * np.sqrt(entry["indenter_radius_mm"]) * np.maximum(depth, 0) ** 1.5
    assert force == pytest.approx(hertz, rel=1e-3, abs=1e-3 * hertz.max())


@pytest.mark.slow
@pytest.mark.parametrize("what", ["compression", "indentation"])
def test_curves_have_the_elastomer_of_the_lines_and_what_is_declared_is_off_in_half(what: str) -> None:
    off, count = 0, 60 if SOAK else 12
    for number in range(count):
        document = joint_campaigns(7, number, what).documents[0]
        effects = document.experiment.effects
        off += bool(set(effects) & {"modulus_error", "thickness_error", "strain_stiffening", "layered_contact"})
        assert 0.25 <= float(effects.get("modulus_error", {}).get("factor", 1.0)) <= 4
        assert 0.7 <= float(effects.get("thickness_error", {}).get("factor", 1.0)) <= 1.3
        assert document.curves is not None
        assert document.curves.experiment.skin.youngs_modulus_mpa == pytest.approx(document.true_modulus_mpa)
        assert document.curves.experiment.skin.thickness_mm == pytest.approx(document.true_thickness_mm)
        for name, values in document.curves.experiment.effects.items():
            if name in document.experiment.effects:
                assert values.items() >= document.experiment.effects[name].items()
        kinds = {recording.get("kind", "frf") for recording in document.campaign()["recordings"]}
        assert kinds == {"frf", what}
        assert 1 <= len(document.curves.recorded) <= 4
    assert 0.3 < off / count < 0.7


def test_the_same_seed_and_number_give_the_same_documents() -> None:
    for what in ("compression", "dates", "skins"):
        again = [document.campaign() for document in joint_campaigns(1, 2, what).documents]
        assert again == [document.campaign() for document in joint_campaigns(1, 2, what).documents]
        assert again != [document.campaign() for document in joint_campaigns(1, 3, what).documents]


def test_nothing_changes_between_two_dates_but_noise() -> None:
    joint = first("dates", set())
    before, after = (document.lines for document in joint.documents)
    assert before.response.plan.recorded_at != after.response.plan.recorded_at
    exact: dict[tuple[Any, ...], np.ndarray] = {}
    for recorded in (before, after):
        aimed = replace(recorded.response, missed_mm=np.zeros_like(recorded.response.missed_mm))
        plan = aimed.plan
        for row, line in enumerate(aimed.lines(recorded.frequency_hz)):
            key = (plan.sensor[row], plan.indenter_mm[row], plan.preload_n[row], *plan.offset_mm[row])
            key = (*key, plan.dynamic_n[row], None if plan.dwell_s is None else plan.dwell_s[row])
            assert line == pytest.approx(exact.setdefault(key, line), rel=1e-12)
    assert len(exact) < len(before.exact) + len(after.exact)
    assert not np.array_equal(before.measured[:3], after.measured[:3])


@pytest.mark.slow
def test_what_ages_is_said_with_its_date_and_its_sensors() -> None:
    for number in range(60):
        joint = joint_campaigns(3, number, "dates")
        ageing = [hidden for hidden in joint.hidden if hidden.effect == "ageing"]
        if not ageing:
            continue
        truth = joint_truth(joint)
        before, after = (np.array(list(one["d33_pc_per_n"].values())) for one in truth["documents"])
        aged = np.array(
            [not ageing[0].sensors or name in ageing[0].sensors for name in truth["documents"][0]["d33_pc_per_n"]]
        )
        assert after == pytest.approx(before * np.where(aged, ageing[0].parameters["factor"], 1.0), rel=1e-5)
        assert ageing[0].since == truth["documents"][1]["date"] > truth["documents"][0]["date"]
        assert truth["hidden"][-1]["chi2_gain_joint"] >= truth["hidden"][-1]["chi2_gain_alone"]
        return
    raise AssertionError("nothing ages")


@pytest.mark.slow
def test_one_skin_departs_and_one_has_few_recordings() -> None:
    seen, counts = set(), set()
    for number in range(30):
        joint = joint_campaigns(8, number, "skins")
        assert joint.population is not None
        counts.add(len({document.skin for document in joint.documents}))
        assert len({document.experiment.skin.youngs_modulus_mpa for document in joint.documents}) == 1
        assert len({document.experiment.skin.thickness_mm for document in joint.documents}) == 1
        assert min(len(document.lines.exact) for document in joint.documents) < 7
        seen |= {hidden.effect for hidden in joint.hidden}
        assert all(hidden.departs for hidden in joint.hidden)
    assert seen == {"modulus_error", "thickness_error", D33_DEPARTURE}
    assert counts == {3, 4, 5, 6}


@pytest.mark.slow
def test_truths_are_json_and_documents_are_campaigns() -> None:
    for what in WHAT if SOAK else ("compression", "skins"):
        for number in range(3) if SOAK else [QUICK[what]]:
            documents, truth = drawn_joint(9, number, what)
            json.dumps([documents, truth], allow_nan=False)
            for document, said in zip(documents, truth["documents"], strict=True):
                kept = campaigns.parse(document)
                assert len(kept.recordings) == sum(said["recordings"].values())
                assert said["name"] == document["name"]
                assert set(said["d33_pc_per_n"]) == {sensor["id"] for sensor in document["skin"]["sensors"]}
            for skin in truth["skins"]:
                alone = [said["sd_ln_modulus_frf"] for said in truth["documents"] if said["skin"] == skin["skin"]]
                assert skin["sd_ln_modulus_joint"] <= min(alone) * 1.01
            for hidden in truth["hidden"]:
                assert hidden["identifiable"] == (hidden["chi2_gain_joint"] is None or hidden["chi2_gain_joint"] > 20)


def test_a_true_model_expects_what_is_expected() -> None:
    joint = first("compression")
    parts, priors = hypothesis(joint, (0,), without=None, curves=True, declared=True, free=False)
    assert least_chi2(parts, priors) == pytest.approx(0, abs=1e-12)


class Line:
    """Two measurements of a + b within 0.1 and of a − b within 0.2."""

    parameters = ("a", "b")
    count = 2

    def residuals(self, values: Any) -> np.ndarray:
        return np.array([(values["a"] + values["b"] - 1) / 0.1, (values["a"] - values["b"]) / 0.2])


def test_fits_and_deviations_of_a_linear_problem_are_exact() -> None:
    free = {"a": Prior(0.0, 1e6), "b": Prior(0.0, 1e6)}
    assert least_chi2([Line()], free) == pytest.approx(0, abs=1e-9)
    assert deviation([Line()], free, "a") == pytest.approx(np.hypot(0.1, 0.2) / 2, rel=1e-6)
    held = {"a": Prior(0.5, 1e-6), "b": Prior(0.0, 1e-6)}
    assert least_chi2([Line()], held) == pytest.approx(25 + 6.25, rel=1e-3)


@pytest.mark.slow
def test_the_command_writes_every_document_and_refuses_what_it_does_not_draw(tmp_path: Path) -> None:
    arguments = ["draw", "--output-dir", str(tmp_path), "--count", "1", "--kind", "joint"]
    assert CliRunner().invoke(command, [*arguments, "--what", "skins"]).exit_code == 0
    files = sorted(file.name for file in (tmp_path / "campaigns").glob("*.json"))
    assert files == ["0000-1.json", "0000-2.json", "0000-3.json"]
    assert json.loads((tmp_path / "truth.json").read_text())["0000"]["schema"] == "joint_truth/1"
    with pytest.raises(RigError, match="must be one of compression, indentation, dates, skins"):
        drawn_joint(0, 0, "single")
    for option in (["--what", "single"], ["--kind", "shear"]):
        answer = CliRunner().invoke(command, [*arguments, *option])
        assert answer.exit_code == 2
        assert "must be one of" in " ".join(answer.output.replace("│", " ").split())
