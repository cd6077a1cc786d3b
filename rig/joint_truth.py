"""The truth about joint campaigns (`joint_truth/1`): what each hides, what changed or departs, and what is visible.

`chi2_gain_alone` is the gain in χ² of a hidden effect over a model without it on the FRFs of the last campaign on which
it acts, `chi2_gain_joint` that on all data; both are expected values. d33 is free; E is known within 2 % of the
declared value, h within 1 %, unless their error is hidden too; E and d33 of skins of one batch are tied to their
population. `chi2_gain_modulus_free` is the joint gain with E free in any case: whether the effect can be distinguished
from an error of E. `sd_ln_modulus_frf` and `sd_ln_modulus_joint` are standard deviations of ln E by Fisher's
information, with the parameters of hidden effects and E free.
"""

import math
from typing import Any

from rig.effects import in_catalogue
from rig.joint_campaign import Hidden, Joint, JointDocument
from rig.joint_fit import deviation, least_chi2
from rig.joint_hypotheses import hypothesis

SCHEMA = "joint_truth/1"
VISIBLE_CHI2 = 20.0  # χ²
IDENTIFIABLE = 0.1  # standard deviation of ln E


def joint_truth(joint: Joint) -> dict[str, Any]:
    """The truth document."""
    return {
        "schema": SCHEMA,
        "name": joint.name,
        "what": joint.what,
        "documents": [_document(joint, number) for number in range(len(joint.documents))],
        "hidden": [_hidden(joint, hidden) for hidden in joint.hidden],
        "skins": [_skin(joint, skin) for skin in sorted({document.skin for document in joint.documents})],
        "population": _population(joint),
    }


def that_show(joint: Joint) -> list[Hidden]:
    """The hidden effects that are visible in all campaigns together: the `identifiable` of the truth."""
    everything = tuple(range(len(joint.documents)))
    return [hidden for hidden in joint.hidden if _gain(joint, hidden, everything, curves=True) > VISIBLE_CHI2]


def _document(joint: Joint, number: int) -> dict[str, Any]:
    document = joint.documents[number]
    response, experiment = document.lines.response, document.experiment
    kinds = {experiment.kind: len(response.plan.sensor)}
    if document.curves is not None:
        kinds[document.curves.experiment.kind] = len(document.curves.recorded)
    dates = response.plan.recorded_at
    return {
        "name": experiment.name,
        "skin": document.skin,
        "date": None if dates is None else dates[0][:10],
        "recordings": kinds,
        "effects": [in_catalogue(hidden.effect) for hidden in joint.hidden if number in hidden.documents],
        "declared": {
            "youngs_modulus_mpa": experiment.skin.youngs_modulus_mpa,
            "thickness_mm": experiment.skin.thickness_mm,
        },
        "youngs_modulus_mpa": document.true_modulus_mpa,
        "thickness_mm": document.true_thickness_mm,
        "d33_pc_per_n": _d33(document),
        "experiment": dict(experiment.document),
        "curves_experiment": None if document.curves is None else dict(document.curves.experiment.document),
        "sd_ln_modulus_frf": _rounded(_deviation(joint, (number,), document.skin, curves=False)),
    }


def _d33(document: JointDocument) -> dict[str, float]:
    skin = document.experiment.skin
    gains = zip(skin.sensors, document.lines.response.sensor_gains, strict=True)
    return {sensor[0]: round(float(skin.d33_pc_per_n * gain), 6) for sensor, gain in gains}


def _hidden(joint: Joint, hidden: Hidden) -> dict[str, Any]:
    everything = tuple(range(len(joint.documents)))
    gain_of_frfs = _gain(joint, hidden, hidden.documents[-1:], curves=False)
    together = _gain(joint, hidden, everything, curves=True)
    modulus_free = together
    if hidden.effect != "modulus_error":
        modulus_free = _gain(joint, hidden, everything, curves=True, declared=False)
    return {
        "effect": in_catalogue(hidden.effect),
        "parameters": dict(hidden.parameters),
        "documents": [joint.documents[number].experiment.name for number in hidden.documents],
        "sensors": list(hidden.sensors) or None,
        "since": hidden.since,
        "departs": joint.documents[hidden.documents[0]].skin if hidden.departs else None,
        "chi2_gain_alone": _rounded(gain_of_frfs),
        "chi2_gain_joint": _rounded(together),
        "chi2_gain_modulus_free": _rounded(modulus_free),
        "identifiable": together > VISIBLE_CHI2,
    }


def _gain(
    joint: Joint, hidden: Hidden, documents: tuple[int, ...], *, curves: bool, declared: bool = True
) -> float:  # fmt: skip
    parts, priors = hypothesis(joint, documents, without=hidden, curves=curves, declared=declared, free=False)
    return least_chi2(parts, priors, sorted({f"{joint.documents[number].skin}/modulus" for number in documents}))


def _skin(joint: Joint, skin: str) -> dict[str, Any]:
    everything = tuple(range(len(joint.documents)))
    sd = _deviation(joint, everything, skin, curves=True)
    return {"skin": skin, "sd_ln_modulus_joint": _rounded(sd), "modulus_identifiable": sd < IDENTIFIABLE}


def _deviation(joint: Joint, documents: tuple[int, ...], skin: str, *, curves: bool) -> float:
    parts, priors = hypothesis(joint, documents, without=None, curves=curves, declared=False, free=True)
    return deviation(parts, priors, f"{skin}/modulus")


def _population(joint: Joint) -> list[dict[str, Any]] | None:
    of = joint.population
    if of is None:
        return None
    return [
        {"parameter": "youngs_modulus_mpa", "median": of.modulus_mpa, "sd_of_log": of.modulus_sd},
        {"parameter": "d33_pc_per_n", "median": of.d33_pc_per_n, "sd_of_log": of.d33_sd},
    ]


def _rounded(value: float) -> float | None:
    """To four significant digits; None without a bound, which JSON cannot hold."""
    return float(f"{value:.4g}") if math.isfinite(value) else None
