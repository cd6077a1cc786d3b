"""Draws whole campaigns and writes them as campaign/1."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rig.unlisted.bench import (
    Companion,
    Measurement,
    base_state,
    draw_companion,
    log_amplitude,
    measure,
    responses,
    state,
)
from rig.unlisted.design import Design, add_random_columns, draw_design
from rig.unlisted.fits import Lines, whitener
from rig.unlisted.laws import LIMIT, SPECTRAL_LIMIT, Law, choose, draw_law, needs, spectral_scaled
from rig.unlisted.observed import amplitudes
from rig.unlisted.truth import describe

Generator = np.random.Generator

COMPANIONS = 0.2
TARGET = (np.log(8.0), np.log(2500.0))
"""Expected gain in chi2 of the true law over the base model; limited by what each quantity may change."""
SPECTRAL_TARGET = (np.log(12.0), np.log(20000.0))
ATTEMPTS = 6


@dataclass(frozen=True)
class Campaign:
    """One drawn campaign with its measurement and its truth."""

    name: str
    design: Design
    data: Measurement
    law: Law | None
    companion: Companion | None
    truth: dict[str, Any]


def _expected_static(design: Design, law: Law, white: npt.NDArray[np.float64]) -> float:
    truth = state(design, law)
    if law.acts_on == "frequency_response":
        change = truth.loss_angle
    else:
        change = log_amplitude(design, truth) - log_amplitude(design, base_state(design))
    return float(((white @ change) ** 2).sum())


def strongest(design: Design, law: Law, limit: float) -> float:
    """The largest factor on a law that keeps |u| below the limit in every recording.

    Along the preload, the force at the skin and the contact radius must still grow with the preload.
    """
    load = np.log(design.value("preload_n"))
    order = np.argsort(load)
    hertz = {"force": 1.0, "contact_radius": 1.0 / 3.0}.get(law.acts_on, 0.0) if law.axis == "preload_n" else 0.0

    def allowed(factor: float) -> bool:
        u = law.scaled(factor).u(design)
        grows = not hertz or bool((np.diff((u + 0.8 * hertz * load)[order]) >= -1e-9).all())
        return float(np.abs(u).max()) <= limit and grows

    low, high = 0.0, 2.0 * limit / float(np.abs(np.array(law.coefficients) @ law.on(design).basis).max())
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


def strengthen(rng: Generator, design: Design, law: Law) -> tuple[Law, bool]:
    """The law at a strength drawn log-uniformly in expected chi2, and whether the design let it come near that."""
    blank = measure(np.random.default_rng(0), design, None, None)
    if law.spectral:
        target, most = float(np.exp(rng.uniform(*SPECTRAL_TARGET))), SPECTRAL_LIMIT[law.form]
        if law.form == "peak" and law.coefficients[0] > 0:
            most = 4.0

        def scaled(f: float) -> Law:
            return spectral_scaled(law, f)

        def gain(f: float) -> float:
            h = responses(design, scaled(f), None, base_state(design))
            exact = Measurement(blank.exact * h, blank.exact, blank.coherence, blank.log_d33, blank.line_variance,
                                blank.position_mean, blank.position_variance)  # fmt: skip
            return float((Lines(design, exact, None, base_state(design)).residual("", np.zeros(0)) ** 2).sum())
    else:
        target = float(np.exp(rng.uniform(*TARGET)))
        limit = {"position": 0.4 * design.thickness_mm, "frequency_response": LIMIT["loss_angle"]} | LIMIT
        most = strongest(design, law, limit[law.acts_on])
        if law.acts_on == "frequency_response":
            white = np.diag(np.sqrt((1.0 / blank.line_variance).sum(axis=1)))
        else:
            ones = np.ones(blank.frf.shape, dtype=np.complex128)
            observed = amplitudes(design, blank, ones, None, base_state(design))
            white = whitener(observed, np.arange(design.count))

        def scaled(f: float) -> Law:
            return law.scaled(f)

        def gain(f: float) -> float:
            return _expected_static(design, law.scaled(f), white)

    low, high = 0.0, most
    if gain(most) > target:
        for _ in range(16):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gain(middle) < target else (low, middle)
    return scaled(high), gain(high) > min(0.5 * target, 40.0)


def draw(rng: Generator, name: str, quiet: bool = False, random_columns: int = 0) -> Campaign:
    """One campaign; a design in which the law is invisible at any strength is mostly drawn again."""
    law: Law | None = None
    if quiet:
        design = draw_design(rng, careful=bool(rng.random() < 0.5))
    else:
        acts_on, axis = choose(rng)
        careful = acts_on != "gain" or bool(rng.random() < 0.3)
        for _ in range(ATTEMPTS):
            design = draw_design(rng, needs(axis), careful)
            law, strong = strengthen(rng, design, draw_law(rng, acts_on, axis, design))
            if strong or rng.random() < 0.1:
                break
    design = add_random_columns(rng, design, random_columns)
    companion = draw_companion(rng, design, law) if law is not None and rng.random() < COMPANIONS else None
    data = measure(rng, design, law, companion)
    test = np.sort(rng.permutation(design.count)[: design.count // 3])
    truth = describe(design, data, law, companion, test)
    truth["heldout_recordings"] = [f"r{i + 1:03d}" for i in test]
    return Campaign(name, design, data, law, companion, truth)


def _digits(values: npt.NDArray[np.float64], digits: int = 6) -> list[float]:
    return [float(f"{v:.{digits}g}") for v in values]


def as_json(campaign: Campaign) -> dict[str, Any]:
    """The campaign as campaign/1; recordings stand in the order in which they were made."""
    design, data = campaign.design, campaign.data
    sensors = [{"id": f"s{i + 1:02d}", "x_mm": float(x), "y_mm": float(y)} for i, (x, y) in enumerate(design.sensor_xy)]
    skin = {
        "thickness_mm": design.thickness_mm, "youngs_modulus_mpa": design.modulus_mpa, "poisson_ratio": 0.5,
        "sensor_radius_mm": design.sensor_radius_mm, "d33_pc_per_n": None, "sensors": sensors,
    }  # fmt: skip
    midnight = datetime(2015, 1, 5, tzinfo=UTC) + timedelta(days=design.day)
    recordings = []
    for i in range(design.count):
        recording: dict[str, Any] = {
            "id": f"r{i + 1:03d}",
            "sensor": sensors[int(design.sensor[i])]["id"],
            "indenter_radius_mm": float(design.value("indenter_radius_mm")[i]),
            "preload_n": float(design.value("preload_n")[i]),
            "dynamic_force_n": float(f"{design.value('dynamic_force_n')[i]:.4g}"),
        }
        if "recorded_at" in design.shown:
            moment = midnight + timedelta(seconds=round(3600.0 * float(design.value("recorded_at")[i])))
            recording["recorded_at"] = moment.strftime("%Y-%m-%dT%H:%M:%SZ")
        if "load_cycles" in design.shown:
            recording["load_cycles"] = int(design.value("load_cycles")[i])
        if "dwell_s" in design.shown:
            recording["dwell_s"] = float(design.value("dwell_s")[i])
        if "position_mm" in design.shown:
            recording["position_mm"] = [float(design.value("x_mm")[i]), float(design.value("y_mm")[i])]
        if design.conditions:
            recording["conditions"] = {n: _condition(design, n, i) for n in design.conditions}
        recording["frequency_hz"] = _digits(design.frequency_hz)
        recording["frf_re_pc_per_n"] = _digits(data.frf[i].real)
        recording["frf_im_pc_per_n"] = _digits(data.frf[i].imag)
        if design.coherence:
            recording["coherence"] = [float(v) for v in np.round(data.coherence[i], 5)]
        recordings.append(recording)
    return {"schema": "campaign/1", "name": campaign.name, "skin": skin, "recordings": recordings}


def _condition(design: Design, name: str, index: int) -> float | str:
    column = design.columns[name]
    number = float(column.values[index])
    return column.words[int(number)] if column.words else number


def _rounded(item: Any) -> Any:
    if isinstance(item, dict):
        return {k: _rounded(v) for k, v in item.items()}
    if isinstance(item, list):
        return [_rounded(v) for v in item]
    if isinstance(item, float | np.floating):
        return float(f"{float(item):.5g}")
    return bool(item) if isinstance(item, np.bool_) else item


def write(seed: int, count: int, output: Path, quiet: bool = False, random_columns: int = 0) -> dict[str, Any]:
    """Writes `count` campaigns and `truth.json`; each campaign has its own stream, so `count` changes none of them."""
    output.mkdir(parents=True, exist_ok=True)
    truth: dict[str, Any] = {}
    for index in range(1, count + 1):
        rng = np.random.default_rng([seed, index])
        campaign = draw(rng, f"{index:04d}", quiet, random_columns)
        (output / f"{campaign.name}.json").write_text(json.dumps(as_json(campaign)), encoding="utf-8")
        truth[campaign.name] = _rounded(campaign.truth)
    (output / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
    return truth
