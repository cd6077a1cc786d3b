"""Random campaigns of three to six skins of one make: E and d33 are of a population, and one may depart in one."""

import math
from copy import deepcopy
from typing import Any

import numpy as np

from rig.description import parse
from rig.draw import CATALOGUED
from rig.draw_joint import design_for_both, frf_description
from rig.joint_campaign import D33_DEPARTURE, Hidden, Joint, JointDocument, Population
from rig.recorded import record_lines
from rig.strengths import evenly_in_log as _log

_SKINS, _THREE = (4, 5, 6), 0.5  # how many skins, where not three
_DEPARTURES = {"nothing": 0.4, "modulus_error": 0.2, D33_DEPARTURE: 0.2, "thickness_error": 0.2}
_SIZES = {"modulus_error": (1.3, 2.5), D33_DEPARTURE: (1.15, 2.0), "thickness_error": (1.08, 1.3)}
_SD = (0.01, 0.1)
_LEAST_SDS = 4.0  # by which E or d33 departs


def skins_of_one_batch(random: np.random.Generator, name: str, batch: str) -> Joint:
    """FRFs of three to six skins of one make, one of them with few recordings; the make's E is declared for all."""
    common = frf_description(random, name, batch, {"modulus_error", str(random.choice(CATALOGUED))})
    skin, sds = common["skin"], {"modulus_error": _log(random, *_SD), D33_DEPARTURE: _log(random, *_SD)}
    departure = str(random.choice(list(_DEPARTURES), p=list(_DEPARTURES.values())))
    count = 3 if random.random() < _THREE else int(random.choice(_SKINS))
    odd, few = (int(random.integers(count)) for _ in range(2))
    size = _size(random, departure, sds.get(departure, 0.0))
    if departure in ("modulus_error", "thickness_error"):
        design_for_both(skin, departure, size)
    population = Population(
        skin["youngs_modulus_mpa"], sds["modulus_error"], skin["d33_pc_per_n"], sds[D33_DEPARTURE]
    )  # fmt: skip
    descriptions = []
    for number in range(count):
        departs = departure if number == odd else "nothing"
        description = _skin(random, common, population, departs, size)
        description["name"] = f"{name}, skin {number + 1}"
        description["skin"]["id"] = f"{batch}-{number + 1}"
        if number == few:
            description["design"]["most_recordings"] = int(random.integers(3, 7))
        descriptions.append(description)
    hidden = [] if departure == "nothing" else [Hidden(departure, {"factor": size}, (odd,), departs=True)]
    lines = [JointDocument(record_lines(parse(description))) for description in descriptions]
    return Joint(name, "skins", tuple(lines), tuple(hidden), population)


def _size(random: np.random.Generator, departure: str, sd: float) -> float:
    """The factor by which a skin departs: a few deviations of its population at least."""
    if departure == "nothing":
        return 1.0
    size = max(_log(random, *_SIZES[departure]), math.exp(_LEAST_SDS * sd))
    return float(size ** random.choice([-1, 1]))


def _skin(
    random: np.random.Generator, common: dict[str, Any], population: Population, departure: str, size: float
) -> dict[str, Any]:  # fmt: skip
    """One skin's description; its E is the declared one times the factor of modulus_error."""
    description = deepcopy(common)
    description["seed"] = int(random.integers(2**31))
    modulus, d33 = np.exp(random.normal(size=2) * [population.modulus_sd, population.d33_sd])
    description["effects"] = {"modulus_error": {"factor": float(modulus)}}
    if departure == "modulus_error":
        description["effects"]["modulus_error"]["factor"] = float(modulus) * size
    if departure == D33_DEPARTURE:
        d33 *= size
    if departure == "thickness_error":
        description["effects"]["thickness_error"] = {"factor": size}
    description["skin"]["d33_pc_per_n"] = float(population.d33_pc_per_n * d33)
    return description
