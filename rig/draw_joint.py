"""Random FRFs of a skin beside curves of its elastomer: a compressed block, or a sphere pressed into the skin.

All follow one truth: E, h, stiffening, creep, and adhesion of the skin. What is declared is off in half of the draws: E
by a factor of 0.25 to 4, h by up to 30 %, or the elastomer stiffens or the layer is thin for its contacts, which FRFs
alone do not tell apart from E or h. Ranges are documented in docs/rig.md.
"""

from typing import Any

import numpy as np

from rig.description import parse
from rig.draw import CATALOGUED, random_description
from rig.draw_elastomer import block_description, indentation_description
from rig.effects import COMPRESSION, INDENTATION
from rig.elastomer import record_curves
from rig.joint_campaign import CurveSet, Hidden, Joint, JointDocument
from rig.recorded import record_lines
from rig.strengths import drawn_parameters, of_frf
from rig.strengths import evenly_in_log as _log
from rig.wide_tails import scatter

_OFF = ("modulus_error", "thickness_error", "strain_stiffening", "layered_contact")
COMPANIONS = (
    "moving_contact_edge", "misalignment", "compressible_layer", "preload_dependent_d33", "sensor_spread",
    "contact_resonance", "amplifier_high_pass", "sensor_relaxation", "timing_delay",
)  # fmt: skip
_FACTORS = {"modulus_error": (1.1, 4.0), "thickness_error": (1.03, 1.3)}
_DECLARED = {"modulus_error": "youngs_modulus_mpa", "thickness_error": "thickness_mm"}


def with_block(random: np.random.Generator, name: str, skin: str) -> Joint:
    """FRFs of a skin, and one to three compressions of a block of its elastomer."""
    return _with_curves(random, name, skin, COMPRESSION)


def with_indentations(random: np.random.Generator, name: str, skin: str) -> Joint:
    """FRFs of a skin, and one to four raw curves of a sphere pressed into it."""
    return _with_curves(random, name, skin, INDENTATION)


def _with_curves(random: np.random.Generator, name: str, skin: str, kind: str) -> Joint:
    names = _names(random, kind)
    description = frf_description(random, name, skin, names or {str(random.choice(CATALOGUED))})
    ranges = of_frf(description)
    effects = {effect: drawn_parameters(random, effect, ranges) for effect in sorted(names)}
    off = sorted(set(_FACTORS) & set(effects))
    for name_of_effect in off:
        effects[name_of_effect] = {"factor": _log(random, *_FACTORS[name_of_effect]) ** float(random.choice([-1, 1]))}
        design_for_both(description["skin"], name_of_effect, effects[name_of_effect]["factor"])
    skin_declared = description["skin"]
    true = skin_declared | {
        _DECLARED[name_of_effect]: skin_declared[_DECLARED[name_of_effect]] * effects[name_of_effect]["factor"]
        for name_of_effect in off
    }
    described = block_description if kind == COMPRESSION else indentation_description
    pressed = parse(described(random, name, true, effects))
    lines = record_lines(parse({**description, "effects": effects}))
    curves = CurveSet(pressed, tuple(record_curves(pressed)))
    together = {**lines.response.on, **pressed.effects}  # those of curves may have more parameters
    gains = tuple(float(gain) for gain in lines.response.sensor_gains)
    hidden = [
        Hidden(name_of_effect, values, gains=gains if name_of_effect == "sensor_spread" else ())
        for name_of_effect, values in together.items()
    ]
    return Joint(name, kind, (JointDocument(lines, curves),), tuple(hidden))


def _names(random: np.random.Generator, kind: str) -> set[str]:
    """Effects on the FRFs; those of the elastomer act on its curves too."""
    names: set[str] = set()
    if random.random() < 0.5:
        names |= {str(effect) for effect in random.choice(_OFF, 1 if random.random() < 0.75 else 2, replace=False)}
    if random.random() < (0.4 if kind == INDENTATION else 0.1):
        names.add("adhesion")
    if random.random() < 0.3:
        names.add("contact_creep")
    if random.random() < 0.25:
        names.add(str(random.choice(COMPANIONS)))
    return names


def frf_description(random: np.random.Generator, name: str, skin: str, sought: set[str]) -> dict[str, Any]:
    """The description of FRFs of a skin that suits the effects sought, with wider scatter than a lone campaign's."""
    description = random_description(random, name, sought)
    description["skin"]["id"] = skin
    description["noise"] |= scatter(random)
    return description


def design_for_both(skin: dict[str, Any], error: str, factor: float) -> None:
    """Declare E or h so that loads which suit the skin suit the declared and the true one: the lower of both stays."""
    skin[_DECLARED[error]] /= min(factor, 1.0)
