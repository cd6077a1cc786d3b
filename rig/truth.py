"""The truth about a campaign (`truth/1`), in a separate file: effects, parameters, gains, and whether they are
visible."""

import math
from typing import Any

from rig import visible_curves
from rig.effects import in_catalogue
from rig.elastomer import RecordedCurve, true_modulus
from rig.experiment import Experiment
from rig.identifiable import THRESHOLD, visibility
from rig.recorded import RecordedLines
from rig.true_response import TrueResponse

SCHEMA = "truth/1"


def truth_of(experiment: Experiment) -> dict[str, Any]:
    """The truth for any kind: effects by their catalogue names (`unknown` where not in it), and every parameter."""
    names = [in_catalogue(name) for name in experiment.effects]
    skin, on = experiment.skin, experiment.effects
    factors = {name: float(on[f"{name}_error"]["factor"]) if f"{name}_error" in on else 1.0
               for name in ("modulus", "thickness")}  # fmt: skip
    return {
        "schema": SCHEMA,
        "name": experiment.name,
        "seed": experiment.seed,
        "kind": experiment.kind,
        "effects": names,
        "parameters": dict(on),
        "d33_pc_per_n": skin.d33_pc_per_n,
        "youngs_modulus_mpa": (
            skin.youngs_modulus_mpa * factors["modulus"] if experiment.curves is None else true_modulus(experiment)
        ),
        "thickness_mm": skin.thickness_mm * factors["thickness"],
        "experiment": dict(experiment.document),
    }


def truth_of_response(response: TrueResponse) -> dict[str, Any]:
    """`truth_of` with the true gains of the sensors."""
    gains = [round(float(gain), 6) for gain in response.sensor_gains]
    return {**truth_of(response.experiment), "sensor_gains": gains}


def truth_of_curves(experiment: Experiment, curves: list[RecordedCurve]) -> dict[str, Any]:
    """`truth_of` with whether each effect, and all of them together, are visible in the curves."""
    overall = visible_curves.visibility(experiment, curves)
    on = tuple(experiment.effects)
    by_effect = (
        {on[0]: overall}
        if len(on) == 1
        else {
            name: visible_curves.visibility(experiment, curves, tuple(other for other in on if other != name))
            for name in on
        }
    )
    return {
        **truth_of(experiment),
        "identifiable": overall.identifiable if on else True,
        "every_effect_identifiable": all(visible.identifiable for visible in by_effect.values()),
        "chi2_gain_of_truth": round(overall.chi2_gain, 2),
        "chi2_gain_of_each": {  # None without bound: JSON has no infinity
            name: round(visible.chi2_gain, 2) if math.isfinite(visible.chi2_gain) else None
            for name, visible in by_effect.items()
        },
        "base_rms_misfit_percent": round(overall.base_misfit_percent, 3),
    }


def truth_of_lines(recorded: RecordedLines) -> dict[str, Any]:
    """`truth_of_response` with whether each effect, and all of them together, are visible in the lines.

    `identifiable` is true where nothing is hidden.
    """
    overall = visibility(recorded)
    on = tuple(recorded.response.on)
    gain_by_effect = {
        name: visibility(recorded, tuple(other for other in on if other != name)).chi2_gain for name in on
    }
    return {
        **truth_of_response(recorded.response),
        "identifiable": overall.identifiable if on else True,
        "every_effect_identifiable": all(gain > THRESHOLD for gain in gain_by_effect.values()),
        "chi2_gain_of_truth": round(overall.chi2_gain, 2),
        "chi2_gain_of_each": {name: round(gain, 2) for name, gain in gain_by_effect.items()},
        "base_rms_misfit_percent": round(overall.base_misfit_percent, 3),
    }
