"""Campaigns of the solved rig: FRFs whose every level is the first harmonic of a solved charge over the force."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.solved.charge import ChargeCurve, harmonic, solve
from rig.solved.design import Design, drawn_design
from rig.solved.layer import Floats, NotConverged
from rig.solved.worlds import SHARES, World, drawn_world

_ATTEMPTS = 20
_START = datetime(2024, 3, 4, 8, 30, tzinfo=UTC)
_DISTANCE_STEP_MM = 1e-3  # mm: charge curves are shared within
FINENESS = 1.5  # of the mesh


@dataclass(frozen=True)
class SolvedCampaign:
    """A drawn campaign: world, design, and the level of each recording without noise (rows,) [pC/N]."""

    name: str
    seed: tuple[int, int]
    world: World
    design: Design
    level: Floats
    a_over_h: tuple[float, float]


def drawn(seed: int, number: int, fineness: float = FINENESS) -> SolvedCampaign:
    """Campaign `number` of a seed. Takes seconds; a draw that cannot be solved is repeated."""
    random = np.random.default_rng([seed, number, 41])
    effect = str(random.choice(list(SHARES), p=list(SHARES.values())))
    for _ in range(_ATTEMPTS):
        world = drawn_world(random, effect)
        design = drawn_design(random, world)
        try:
            level, widths = levels(design, world, fineness)
        except NotConverged:
            continue
        return SolvedCampaign(f"solved {seed}/{number}", (seed, number), world, design, level, widths)
    raise RuntimeError(f"no campaign {seed}/{number} can be solved")


def levels(design: Design, world: World, fineness: float = FINENESS) -> tuple[Floats, tuple[float, float]]:
    """First harmonic of the charge over force of each recording (rows,) [pC/N] in a world, at the true sizes and
    positions; and the narrowest and widest contact, a/h."""
    true = design.true
    dwell = np.zeros(len(design.force)) if design.dwell_s is None else design.dwell_s
    unit = true.modulus * world.relaxed(dwell) * true.thickness**2
    force, dynamic = design.force / unit, design.dynamic / unit
    levels_of_rows, widths = np.empty(len(force)), []
    for sphere in np.unique(design.sphere):
        rows = np.flatnonzero(design.sphere == sphere)
        low, high = float((force - dynamic)[rows].min()), float((force + dynamic)[rows].max())
        curve = solve(world.skin(), float(sphere / true.thickness), low, high, fineness)
        levels_of_rows[rows] = _shares(curve, design, rows, force, dynamic)
        widths += curve.contact_radius(force[rows]).tolist()
    return design.d33 * levels_of_rows, (min(widths), max(widths))


def _shares(curve: ChargeCurve, design: Design, rows: NDArray[np.intp], force: Floats, dynamic: Floats) -> Floats:
    """First harmonic over force of the share borne by the disc, for the rows of one sphere."""
    true, shares = design.true, np.empty(len(rows))
    places = np.round(design.distance[rows] / _DISTANCE_STEP_MM) * _DISTANCE_STEP_MM
    for distance in np.unique(places):
        here = places == distance
        share = curve.share(true.sensor_radius / true.thickness, float(distance / true.thickness))
        shares[here] = harmonic(share, force[rows[here]], dynamic[rows[here]])
    return shares


def measured(campaign: SolvedCampaign) -> tuple[Floats, Floats, Floats]:
    """Real and imaginary part of each line, and the variance of each (rows, lines): gain error of the recording, and
    noise relative to the line plus a floor."""
    noise, f = campaign.design.noise, campaign.design.frequency_hz
    random = np.random.default_rng([*campaign.seed, 43])
    actual = campaign.level * np.exp(noise.gain * random.normal(size=len(campaign.level)))
    variance = (actual[:, None] * noise.of_line(f)) ** 2 + noise.floor**2
    real, imaginary = random.normal(size=(2, *variance.shape)) * np.sqrt(variance)
    return actual[:, None] + real, imaginary, variance


def document(campaign: SolvedCampaign) -> dict[str, Any]:
    """The campaign (`campaign/1`), with what the lab knows."""
    design, sizes = campaign.design, campaign.design.declared
    real, imaginary, variance = measured(campaign)
    coherence = 1 / (1 + 2 * design.noise.averages * variance / (real**2 + imaginary**2))
    names = [f"s{number + 1:02d}" for number in range(len(design.sensors))]
    moved, recordings = bool(np.any(design.offset)), []
    for row, sensor in enumerate(design.sensor):
        header: dict[str, Any] = {
            "id": f"r{row + 1:03d}",
            "sensor": names[sensor],
            "indenter_radius_mm": float(design.sphere[row]),
            "preload_n": float(design.force[row]),
            "dynamic_force_n": float(design.dynamic[row]),
        }
        if design.minutes:
            header["recorded_at"] = (_START + timedelta(minutes=design.minutes * row)).strftime("%Y-%m-%dT%H:%M:%SZ")
        if design.dwell_s is not None:
            header["dwell_s"] = float(design.dwell_s[row])
        if moved:
            header["position_mm"] = np.round(design.sensors[sensor] + design.offset[row], 4).tolist()
        header["frequency_hz"] = design.frequency_hz.tolist()
        header["frf_re_pc_per_n"], header["frf_im_pc_per_n"] = _rounded(real[row]), _rounded(imaginary[row])
        if design.noise.coherence:
            header["coherence"] = np.round(coherence[row], 6).tolist()
        recordings.append(header)
    return {
        "schema": "campaign/1",
        "name": campaign.name,
        "skin": {
            "thickness_mm": sizes.thickness,
            "youngs_modulus_mpa": sizes.modulus,
            "poisson_ratio": 0.5,
            "sensor_radius_mm": sizes.sensor_radius,
            "d33_pc_per_n": None,
            "sensors": [
                {"id": name, "x_mm": float(x), "y_mm": float(y)}
                for name, (x, y) in zip(names, design.sensors, strict=True)
            ],
        },
        "recordings": recordings,
    }


def _rounded(values: Floats) -> list[float]:
    return [float(f"{value:.7g}") for value in values]
