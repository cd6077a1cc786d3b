"""Written campaigns and their truth: format, determinism, consistency."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from rig.unlisted.bench import measure, state
from rig.unlisted.campaign import Campaign, as_json, draw, write
from rig.unlisted.design import draw_design
from rig.unlisted.fits import Lines, fit_shapes
from rig.unlisted.laws import AXES, STATIC, Law, listed
from rig.unlisted.truth import IDENTIFIABLE, describe, observe

pytestmark = pytest.mark.slow

FORMS = {"linear", "power", "exponential", "saturating", "threshold", "step", "periodic", "peak", "notch", "free"}
SEED, COUNT = (77, 24) if SOAK else (82, 4)
RECORDING = {
    "id", "sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "recorded_at", "load_cycles", "dwell_s",
    "position_mm", "conditions", "frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence",
}  # fmt: skip


@pytest.fixture(scope="module")
def campaigns() -> list[Campaign]:
    return [draw(np.random.default_rng([SEED, i]), f"{i:04d}") for i in range(1, COUNT + 1)]


def test_format(campaigns: list[Campaign]) -> None:
    for campaign in campaigns:
        body: dict[str, Any] = json.loads(json.dumps(as_json(campaign), allow_nan=False))
        assert set(body) == {"schema", "name", "skin", "recordings"}
        assert body["schema"] == "campaign/1"
        sensors = {s["id"] for s in body["skin"]["sensors"]}
        assert len({r["id"] for r in body["recordings"]}) == len(body["recordings"])
        for r in body["recordings"]:
            assert set(r) <= RECORDING
            assert r["sensor"] in sensors
            assert len({len(r[k]) for k in ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n")}) == 1
            assert 0.0 < r["dynamic_force_n"] < r["preload_n"]
            assert all(0.0 < c <= 1.0 for c in r.get("coherence", [1.0]))


def test_the_axis_of_the_law_is_in_the_file(campaigns: list[Campaign]) -> None:
    for campaign in campaigns:
        assert campaign.law is not None
        first, axis = as_json(campaign)["recordings"][1], campaign.law.axis
        derived = {"order", "previous_preload_n", "time_of_day", "x_mm", "y_mm", "frequency_hz"}
        assert axis in derived or axis in first or axis in first.get("conditions", {}), axis
        assert axis != "time_of_day" or "recorded_at" in first
        assert axis not in ("x_mm", "y_mm") or "position_mm" in first


def test_truth_is_consistent(campaigns: list[Campaign]) -> None:
    for c in campaigns:
        t, law = c.truth, c.truth["law"]
        assert law["acts_on"] in {*STATIC, "frequency_response"}
        assert law["axis"] in AXES[law["acts_on"]]
        assert law["form"] in FORMS
        assert law["form"] not in t["form_also"]
        assert law["axis"] not in t["axis_also"]
        assert law["acts_on"] not in t["acts_on_also"]
        assert t["chi2_gain_over_best_listed"] <= t["chi2_gain_over_base"] + 1e-3, c.name
        assert t["identifiable"] == (min(t["chi2_gain_over_base"], t["chi2_gain_over_best_listed"]) > IDENTIFIABLE)
        assert t["best_listed"]
        assert not t["altered"] or law["form"] == "power"
        assert t["noise_floor_percent"] > 0.0
        assert np.isfinite(t["heldout_ideal_percent"])
        assert c.law is not None
        rising = c.law.coefficients[0] > 0.0
        assert not listed(c.law.acts_on, c.law.axis, c.law.form, rising)


def test_the_true_law_fits_to_the_noise(campaigns: list[Campaign]) -> None:
    total, dof = 0.0, 0.0
    for c in campaigns:
        assert c.law is not None
        if c.law.spectral:
            lines = Lines(c.design, c.data, c.companion, state(c.design, c.law))
            total += lines.fit(c.law.form, np.array(c.law.coefficients))[1]
            dof += 2.0 * c.data.frf.size - c.design.count
            continue
        seen = observe(c.design, c.data, c.law, c.companion)
        start = np.array(c.law.coefficients)
        fits = fit_shapes(seen, c.law.acts_on, c.law.along, [c.law.on(c.design)], start)
        chi2 = min(f.chi2 for f in fits)
        assert chi2 < c.design.count + 5.0 * np.sqrt(2.0 * c.design.count), c.name
        total, dof = total + chi2, dof + c.design.count - seen.linear.shape[0]
    assert total < dof + 5.0 * np.sqrt(2.0 * dof)


def test_a_loss_angle_shows_as_planned() -> None:
    """A law on the loss angle gains what its angles weigh against their noise."""
    design = draw_design(np.random.default_rng(1))
    law = Law("frequency_response", "order", "linear", (), (0.05,))
    data = measure(np.random.default_rng(2), design, law, None)
    seen = observe(design, data, law, None)
    np.testing.assert_allclose(seen.residual, law.u(design), atol=5.0 * float(np.sqrt(seen.covariance.max())))
    entry = describe(design, data, law, None, np.arange(0, design.count, 3))
    expected = float((law.u(design) ** 2 / np.diag(seen.covariance)).sum())
    assert entry["chi2_gain_over_base"] == pytest.approx(expected, rel=0.3)
    assert entry["heldout_ideal_percent"] < entry["heldout_base_percent"]


def test_modelling_a_visible_law_predicts_better(campaigns: list[Campaign]) -> None:
    visible = [c.truth for c in campaigns if c.truth["chi2_gain_over_base"] > 100.0]
    assert len(visible) > min(5, len(campaigns) / 2)
    better = [t["heldout_ideal_percent"] < t["heldout_base_percent"] for t in visible]
    assert np.mean(better) > 0.85


def test_writes_what_is_drawn_alone(campaigns: list[Campaign], tmp_path: Path) -> None:
    """The same again, whatever was written before it."""
    drawn = campaigns[: 2 if SOAK else 1]
    write(SEED, len(drawn), tmp_path)
    truth = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    assert list(truth) == [campaign.name for campaign in drawn]
    for campaign in drawn:
        written = json.loads((tmp_path / f"{campaign.name}.json").read_text(encoding="utf-8"))
        assert written == as_json(campaign)
        gain = campaign.truth["chi2_gain_over_base"]
        assert truth[campaign.name]["chi2_gain_over_base"] == pytest.approx(gain, rel=1e-3)


def test_quiet_campaigns_hide_nothing(tmp_path: Path) -> None:
    truth = write(6, 3, tmp_path, quiet=True, random_columns=4)
    for name, entry in truth.items():
        assert entry["law"] is None
        assert not entry["identifiable"]
        assert entry["best_listed"] is None
        assert entry["effects"] == []
        recordings = json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))["recordings"]
        assert {"note_01", "note_02", "note_03", "note_04"} <= set(recordings[0]["conditions"])
