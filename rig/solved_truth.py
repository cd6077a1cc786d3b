"""What is true of a campaign of the solved rig, and what the base model and the plain world explain of it.

Each recording is reduced to its mean level, its lines weighted by their variances. To it a model's levels m are fitted,
    y = d m (1 + J_E ln(E'/E) + J_h ln(h'/h)),
m at the commanded places, with free d33, E and h under the priors of a diagnosis (2 %, 1 %), by least squares; the
variance of a level is that of its lines, of its gain and of its place. J are the sensitivities of the base model, whose
contact is that of `rig.layer_contacts` without any effect. Gains in χ² are over its fit.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rig.layer import Floats
from rig.layer_contacts import LayerContacts
from rig.solved.campaign import FINENESS, SolvedCampaign, levels, measured
from rig.solved.design import Design
from rig.solved.worlds import EXACT, NEAREST, PLAIN, World

VISIBLE = 20.0  # in χ²: below, an effect cannot be seen
_PRIOR_MODULUS, _PRIOR_THICKNESS = 0.02, 0.01  # standard deviations of the logarithms
_STEP = 0.01  # of the logarithms and, over the thickness, of the place, for derivatives


def truth_of_solved(campaign: SolvedCampaign, fineness: float = FINENESS) -> dict[str, Any]:
    """World, sizes, gains in χ² of the truth and of it over the plain world, and the error of d33 under each."""
    design, world = campaign.design, campaign.world
    commanded = replace(design, missed=np.zeros_like(design.missed))
    models = {"base": base_levels(design), "truth": levels(commanded, world, fineness)[0]}
    models["plain_world"] = models["truth"] if world.effect == PLAIN else levels(commanded, World(PLAIN), fineness)[0]
    fitted = {name: fit(campaign, model) for name, model in models.items()}
    chi2 = {name: fit_of_effect[0] for name, fit_of_effect in fitted.items()}
    return {
        "effect": world.effect,
        "parameters": dict(world.parameters),
        "exact_name": EXACT[world.effect],
        "nearest_names": list(NEAREST[world.effect]),
        "d33_pc_per_n": design.d33,
        "youngs_modulus_mpa": design.true.modulus,
        "thickness_mm": design.true.thickness,
        "sensor_radius_mm": design.true.sensor_radius,
        "chi2_gain_of_truth": chi2["base"] - chi2["truth"],
        "chi2_gain_over_plain_world": chi2["plain_world"] - chi2["truth"],
        **{f"d33_error_of_{name}": error for name, (_, error) in fitted.items()},
        "chi2_of_truth": chi2["truth"],
        "a_over_h": list(campaign.a_over_h),
        "rt_over_h": design.declared.sensor_radius / design.declared.thickness,
        "recordings": len(campaign.level),
    }


def base_levels(design: Design, modulus: float = 0.0, thickness: float = 0.0, position: float = 0.0) -> Floats:
    """Levels of the base model (rows,) [pC/N] as declared, or with ln E, ln h or the distance over h increased by
    these amounts."""
    declared = design.declared
    h = declared.thickness * np.exp(thickness)
    contacts = LayerContacts(
        h, declared.modulus * np.exp(modulus), {}, design.sphere, design.force, np.zeros(len(design.force))
    )
    distance = np.hypot(*design.offset.T) + position * declared.thickness
    sigma = contacts.sigma(declared.sensor_radius, distance)
    return np.asarray(design.d33 * 1.5 * (declared.sensor_radius / h) ** 2 * sigma)


def fit(campaign: SolvedCampaign, model: Floats) -> tuple[float, float]:
    """Least χ² of a model's levels, and the relative error of d33 there."""
    design, level = campaign.design, campaign.level
    real, _, variance = measured(campaign)
    spread = 1 / np.sum(1 / variance, axis=1)
    mean = np.sum(real / variance, axis=1) * spread
    ahead, back = (base_levels(design, position=sign * _STEP) for sign in (1, -1))
    moved = (ahead - back) / (2 * _STEP) / design.declared.thickness * design.noise.position_mm
    weight = 1 / np.sqrt(spread + (design.noise.gain * level) ** 2 + moved**2)
    base = base_levels(design)
    slopes = [
        (base_levels(design, **{name: _STEP}) - base_levels(design, **{name: -_STEP})) / (2 * _STEP) / base * model
        for name in ("modulus", "thickness")
    ]
    columns = np.column_stack([model, *slopes]) * weight[:, None]
    priors = np.array([[0.0, 1 / _PRIOR_MODULUS, 0.0], [0.0, 0.0, 1 / _PRIOR_THICKNESS]])
    matrix, right = np.vstack([columns, priors]), np.append(mean * weight, [0.0, 0.0])
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return float(np.sum((matrix @ solution - right) ** 2)), float(solution[0] - 1)
