"""Random campaigns of a skin whose declared Young's modulus is wrong by a factor of 2 to 4, up or down.

FRFs of wide contacts, in half of the draws beside a compressed block of the elastomer or indentations of the skin, and
in a third with a companion. The loads suit the skin as it is: where its E is declared too small, contacts may be
computed that are far wider, or harder pressed, than any that was made.

>>> document, truth = drawn_wrong_modulus(1, 0)
>>> document["schema"], truth["what"], 2 <= max(truth["factor"], 1 / truth["factor"]) <= 4
('campaign/1', 'compression', True)
"""

from typing import Any

import numpy as np

from rig.description import parse
from rig.draw_elastomer import block_description, indentation_description
from rig.draw_joint import COMPANIONS, frf_description
from rig.effects import COMPRESSION, FRF, INDENTATION
from rig.elastomer import record_curves
from rig.joint_campaign import CurveSet, Hidden, Joint, JointDocument, first_feasible
from rig.joint_truth import joint_truth
from rig.layer import Floats
from rig.recorded import record_lines
from rig.strengths import drawn_parameters, evenly_in_log, of_frf

_ERROR = "modulus_error"
_FACTORS = (2.0, 4.0)
_KINDS = {FRF: 0.5, COMPRESSION: 0.25, INDENTATION: 0.25}
_COMPANIONS = (*COMPANIONS, "adhesion", "contact_creep")
_COMPANY = 0.35
_HARD = 0.5  # share of the draws with loads up to the limit of the skin
_WIDEST, _HARDEST = 2.9, 0.09  # a/h and L that it bears


def wrong_modulus(seed: int, number: int) -> Joint:
    """Draw and record campaign `number` of a seed."""
    random = np.random.default_rng([seed, number, 43])
    return first_feasible(_drawn, random, f"wrong modulus {seed}/{number}", f"skin-{seed}-{number}")


def drawn_wrong_modulus(seed: int, number: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Campaign `number` of a seed.

    Parameters
    ----------
    seed, number : int

    Returns
    -------
    document : dict
        The campaign (`campaign/1`).
    truth : dict
        The truth about it (`joint_truth/1`), with the `factor` of the true on the declared E, and `as_declared`: a/h
        and L of the contact of each FRF by the declared E.
    """
    joint = wrong_modulus(seed, number)
    document = joint.documents[0]
    radius, load = _as_declared(document)
    return document.campaign(), {
        **joint_truth(joint),
        "factor": document.true_modulus_mpa / document.experiment.skin.youngs_modulus_mpa,
        "as_declared": {"a_over_h": radius.tolist(), "load_parameter": load.tolist()},
    }


def _drawn(random: np.random.Generator, name: str, skin: str) -> Joint:
    kind = str(random.choice(list(_KINDS), p=list(_KINDS.values())))
    names = {_ERROR} | ({str(random.choice(_COMPANIONS))} if random.random() < _COMPANY else set())
    description = frf_description(random, name, skin, names)
    if random.random() < _HARD:
        _press_harder(random, description)
    ranges = of_frf(description)
    factor = evenly_in_log(random, *_FACTORS) ** float(random.choice([-1, 1]))
    effects = {effect: drawn_parameters(random, effect, ranges) for effect in sorted(names)} | {
        _ERROR: {"factor": factor}
    }
    declared = float(f"{description['skin']['youngs_modulus_mpa'] / factor:.3g}")
    true = description["skin"] | {"youngs_modulus_mpa": declared * factor}
    description["skin"]["youngs_modulus_mpa"] = declared
    lines = record_lines(parse({**description, "effects": effects}))
    curves, together = None, dict(lines.response.on)
    if kind != FRF:
        described = block_description if kind == COMPRESSION else indentation_description
        pressed = parse(described(random, name, true, effects))
        curves = CurveSet(pressed, tuple(record_curves(pressed)))
        together |= pressed.effects  # those of curves may have more parameters
    gains = tuple(float(gain) for gain in lines.response.sensor_gains)
    hidden = [
        Hidden(effect, values, gains=gains if effect == "sensor_spread" else ()) for effect, values in together.items()
    ]  # fmt: skip
    return Joint(name, kind, (JointDocument(lines, curves),), tuple(hidden))


def _press_harder(random: np.random.Generator, description: dict[str, Any]) -> None:
    """All preloads larger by one factor, up to what the skin bears."""
    skin, design = description["skin"], description["design"]
    modulus, h = skin["youngs_modulus_mpa"], skin["thickness_mm"]
    spheres, preloads = design["indenters_mm"], design["preloads_n"]
    wide = (_WIDEST * h) ** 3 * modulus / (0.5625 * max(spheres))
    bearable = min(wide, _HARDEST * min(spheres) ** 2 * modulus)
    more = max(bearable / preloads[-1], 1.0) ** random.uniform(0.5, 1.0)
    design["preloads_n"] = [float(f"{more * force:.3g}") for force in preloads]


def _as_declared(document: JointDocument) -> tuple[Floats, Floats]:
    """a/h and L (recordings,) by the declared E and h: a³ = 9FR/(16E), L = F/(R² E)."""
    skin, plan = document.experiment.skin, document.lines.response.plan
    load = plan.preload_n / (plan.indenter_mm**2 * skin.youngs_modulus_mpa)
    return np.asarray(plan.indenter_mm * np.cbrt(0.5625 * load) / skin.thickness_mm), load
