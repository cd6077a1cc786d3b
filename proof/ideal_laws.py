"""The hypotheses of the ideal diagnoser: each effect by the rig's own law, within the range it is drawn from."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from rig.effects import ALL_EFFECTS, Values, needed_by_law
from rig.strengths import INVERTED, SIGNED, Ranges
from underskin.units import Floats

_MAINS_HZ = (50.0, 60.0)


@dataclass(frozen=True)
class Coordinate:
    """A parameter, uniform in its logarithm; `sign` −1 inverts its sign, or that of a factor's logarithm."""

    effect: str
    parameter: str
    low: float
    high: float
    sign: int = 1

    def value(self, position: float) -> float:
        """The parameter's value at a coordinate from 0 to 1."""
        if self.parameter == "angle":
            return 2 * math.pi * position
        size = math.exp(math.log(self.low) + position * math.log(self.high / self.low))
        if self.effect in INVERTED:
            return size**self.sign
        return self.sign * size

    def position_of(self, value: float) -> float:
        """The coordinate of a value; outside 0 to 1 or nan if this coordinate does not reach it."""
        if self.parameter == "angle":
            return value / (2 * math.pi) % 1
        size = value**self.sign if self.effect in INVERTED else self.sign * value
        return math.log(size / self.low) / math.log(self.high / self.low) if size > 0 else math.nan


@dataclass(frozen=True)
class Supposition:
    """Effects with their laws fixed and their parameters free: `coordinates` run from 0 to 1."""

    fixed: Mapping[str, Values]
    coordinates: tuple[Coordinate, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names, sorted."""
        return tuple(sorted(self.fixed))

    def effects(self, positions: Floats) -> dict[str, Values]:
        """The effects at these coordinates."""
        result: dict[str, Values] = {name: dict(values) for name, values in self.fixed.items()}
        for coordinate, at in zip(self.coordinates, positions, strict=True):
            result[coordinate.effect][coordinate.parameter] = coordinate.value(float(at))
        if "misalignment" in result:
            size, angle = (float(result["misalignment"].pop(name)) for name in ("size", "angle"))
            result["misalignment"] = {"x_mm": size * math.cos(angle), "y_mm": size * math.sin(angle)}
        return result

    def positions_of(self, effects: Mapping[str, Values]) -> Floats | None:
        """The coordinates of these effects; None where this hypothesis does not contain them."""
        positions = self.positions_of_shared(effects)
        return positions if set(effects) == set(self.fixed) and not np.isnan(positions).any() else None

    def positions_of_shared(self, effects: Mapping[str, Values]) -> Floats:
        """The coordinates of those effects that this hypothesis shares with the given ones; nan for the others."""
        values_of_effects = {name: dict(values) for name, values in effects.items()}
        if "misalignment" in values_of_effects:
            x, y = (float(values_of_effects["misalignment"][name]) for name in ("x_mm", "y_mm"))
            values_of_effects["misalignment"] = {"size": math.hypot(x, y), "angle": math.atan2(y, x)}
        positions = np.full(len(self.coordinates), np.nan)
        for name, values in self.fixed.items():
            indices = [index for index, coordinate in enumerate(self.coordinates) if coordinate.effect == name]
            if name not in values_of_effects or any(
                values_of_effects[name].get(key) != value for key, value in values.items()
            ):
                continue
            at = np.array(
                [
                    self.coordinates[i].position_of(float(values_of_effects[name][self.coordinates[i].parameter]))
                    for i in indices
                ]
            )
            if np.all((at > -0.01) & (at < 1.01)):
                positions[indices] = np.clip(at, 0.0, 1.0)
        return positions


def suppositions(names: Sequence[str], ranges: Ranges) -> list[Supposition]:
    """All laws and signs of a set of effects."""
    result = []
    for parts in product(*(list(_of_effect(name, ranges.get(name, {}))) for name in names)):
        fixed = {name: values for name, (values, _) in zip(names, parts, strict=True)}
        result.append(Supposition(fixed, tuple(coordinate for _, coordinates in parts for coordinate in coordinates)))
    return result


def _of_effect(name: str, ranges: Mapping[str, tuple[float, float]]) -> Iterator[tuple[Values, tuple[Coordinate, ...]]]:
    effect = ALL_EFFECTS[name]
    for law in effect.laws or (None,):
        values: Values = {} if law is None else {"law": law}
        unused = set(effect.optional) - set(needed_by_law(name, values))
        free = {parameter: ends for parameter, ends in ranges.items() if parameter not in unused}
        if name == "misalignment":
            free = {"size": free["x_mm"], "angle": (0.0, 2 * math.pi)}
        for sign in (1, -1) if name in SIGNED or name in INVERTED else (1,):
            turned = SIGNED.get(name, "factor")
            coordinates = tuple(
                Coordinate(name, parameter, *ends, sign if parameter == turned else 1)
                for parameter, ends in free.items()
            )
            for mains in _MAINS_HZ if name == "mains_pickup" else (None,):
                yield (values if mains is None else {**values, "mains_hz": mains}), coordinates
