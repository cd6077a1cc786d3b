"""Random campaigns of one skin on two dates, months apart, between which one thing changes or nothing.

E, h, d33 of each sensor and what is hidden on both dates stay. What may change: d33 of one sensor or of all ages by a
factor, the tip becomes heavier, the glue line begins to slip.
"""

from copy import deepcopy
from datetime import date, timedelta
from typing import Any

import numpy as np

from rig.description import parse
from rig.draw_joint import COMPANIONS, frf_description
from rig.joint_campaign import Hidden, Joint, JointDocument
from rig.layer import Floats
from rig.plan import recordings
from rig.recorded import record_lines
from rig.strengths import drawn_parameters, of_frf
from rig.strengths import evenly_in_log as _log

_CHANGES = {"nothing": 0.3, "one_sensor": 0.2, "all_sensors": 0.2, "contact_resonance": 0.15, "interface_slip": 0.15}
_APPEARING = ("contact_resonance", "interface_slip")
_LASTING = tuple(name for name in COMPANIONS if name not in _APPEARING)
_AGED = (0.5, 0.97)  # factor on d33


def two_dates(random: np.random.Generator, name: str, skin: str) -> Joint:
    """FRFs of one skin on two dates."""
    change = str(random.choice(list(_CHANGES), p=list(_CHANGES.values())))
    lasting = {str(random.choice(_LASTING))} if random.random() < 0.4 else set()
    needed = {change} if change in _APPEARING else {"sensor_spread"} if change == "one_sensor" else set()
    first = frf_description(random, name, skin, lasting | needed or {str(random.choice(COMPANIONS))})
    first["design"].pop("cycles_per_recording", None)
    ranges = of_frf(first)
    first["effects"] = {effect: drawn_parameters(random, effect, ranges) for effect in sorted(lasting)}
    start = date(2021, 3, 1)
    later = start + timedelta(days=int(random.integers(30, 600)))
    second = deepcopy(first)
    for number, (description, day) in enumerate(((first, start), (second, later))):
        description["name"] = f"{name}, date {number + 1}"
        description["seed"] = int(random.integers(2**31))
        description["design"] |= {"start": f"{day.isoformat()}T09:00:00Z", "minutes_per_recording": 5.0}
    if change in _APPEARING:
        second["effects"][change] = drawn_parameters(random, change, ranges)
    gains = _spread(random, first)
    factor = np.ones_like(gains)
    if change in ("one_sensor", "all_sensors"):
        factor = _ageing(random, first, second, single=change == "one_sensor")
    lines = [record_lines(parse(first), gains), record_lines(parse(second), gains * factor)]
    documents = tuple(JointDocument(document) for document in lines)
    return Joint(name, "dates", documents, _hidden(documents, gains, factor, later.isoformat()))


def _hidden(documents: tuple[JointDocument, ...], gains: Floats, factor: Floats, later: str) -> tuple[Hidden, ...]:
    """What lasts, and what appears on the later date."""
    before, after = (document.experiment.effects for document in documents)
    hidden = [
        Hidden(effect, values, (0, 1), _floats(gains) if effect == "sensor_spread" else ())
        for effect, values in before.items()
    ]
    hidden += [Hidden(effect, values, (1,), since=later) for effect, values in after.items() if effect not in before]
    if np.any(factor != 1):
        ids = [sensor[0] for sensor in documents[0].experiment.skin.sensors]
        aged = tuple(ids[index] for index in np.flatnonzero(factor != 1))
        sensors = aged if len(aged) < len(ids) else ()
        hidden.append(Hidden("ageing", {"factor": float(factor.min())}, (1,), _floats(factor), sensors, later))
    return tuple(hidden)


def _floats(values: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _spread(random: np.random.Generator, description: dict[str, Any]) -> Floats:
    """Gain of each sensor, the same on both dates."""
    sd = float(description["effects"].get("sensor_spread", {}).get("sd", 0.0))
    return np.exp(sd * random.normal(size=len(parse(description).skin.sensors)))


def _ageing(random: np.random.Generator, first: dict[str, Any], second: dict[str, Any], *, single: bool) -> Floats:
    """The factor on d33 of each sensor on the second date: of one sensor that both dates record, or of all."""
    plans = [recordings(parse(description)) for description in (first, second)]
    both = np.intersect1d(plans[0].sensor, plans[1].sensor)
    factor = np.ones(len(parse(first).skin.sensors))
    factor[random.choice(both) if single else slice(None)] = _log(random, *_AGED)
    return factor
