"""What the conditions that a lab notes, such as a temperature, do to the gain of the recordings of an array.

A condition that changes while the sensors are measured in turn looks like a difference between them. Recording i of
sensor s under the load c (indenter and preload) has
    ln |d33_i| = a_s + q_c + Σ_k β_k x_ik + ε_i,    β_k ~ N(0, g0²), ε_i ~ N(0, g²)
with flat a_s and q_c, the noted numbers x_k in units of their standard deviation over the campaign, and g by the
residual: before any recording, a condition is expected to change the gain by as much as usually scatters it (g0,
`mixed_model.USUAL_GAIN`). So β is told within sensor and load alone, and a column that follows the load takes nothing
of what d33 does with it. With x_ik = m_sk + l_ck + rest, the d33 of sensor s is corrected by Σ_k β_k m_sk, all of its
cells alike. A column of which the recordings tell less than the prior, as of a channel's number, corrects and widens
nothing.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.mixed_model import USUAL_GAIN
from underskin.prediction.answers import STATED
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Indices, Mask

_PASSES = 3  # of residual and gain scatter, which settle at once
_PHYSICAL = re.compile("temp|humid|celsius|kelvin", re.IGNORECASE)  # what d33 depends on, unlike a channel or a date


@dataclass(frozen=True)
class NotedConditions:
    """The lab's numeric columns that vary: `names`, their `mean` and `deviation` (columns,), and the standardised
    `values` (recordings, columns), 0 where a recording has none."""

    names: tuple[str, ...]
    mean: Floats
    deviation: Floats
    values: Floats

    def fitted(self, rows: Indices, sensor: Indices, load: Indices, d33: Floats) -> "ConditionEffects":
        """Their effects from the recordings `rows`, of which `sensor` (number) and `d33` are given (rows,), and `load`
        (number) of all (recordings,)."""
        noted = self.values[rows]
        count = len(self.names)
        if not noted.size or len(np.unique(sensor)) < 2:
            without = np.zeros(count)
            return ConditionEffects(self, without, np.zeros((count, count)), without > 0, self.values)
        of_loads = (load[:, None] == np.unique(load[rows])).astype(np.float64)
        loads = of_loads[rows]
        members = (sensor[:, None] == np.unique(sensor)).astype(np.float64)
        share = members / members.sum(axis=0)
        level = np.log(np.maximum(np.abs(d33), np.finfo(float).tiny))
        centred, columns = (part - members @ (share.T @ part) for part in (loads, np.column_stack([noted, level])))
        by_load, _, rank, _ = np.linalg.lstsq(centred, columns, rcond=None)
        columns -= centred @ by_load
        rest, level = columns[:, :count], columns[:, count]
        told: Mask = np.ones(count, dtype=bool)
        variance = USUAL_GAIN**2
        for _ in range(_PASSES):
            squares = (rest * told).T @ (rest * told)
            covariance = np.linalg.inv(squares / variance + np.eye(count) / USUAL_GAIN**2)
            effects = covariance @ ((rest * told).T @ level) / variance
            freedom = len(level) - members.shape[1] - int(rank) - float(np.trace(covariance @ squares)) / variance
            if freedom >= 1:
                variance = max(float(np.sum((level - rest @ effects) ** 2)) / freedom, np.finfo(float).eps)
            told = told & (np.sum(rest**2, axis=0) / variance > 1 / USUAL_GAIN**2)
        without_load = self.values - of_loads @ by_load[:, :count]
        without_load -= without_load[rows].mean(axis=0)
        return ConditionEffects(self, effects * told, covariance * np.outer(told, told), told, without_load)


@dataclass(frozen=True)
class ConditionEffects:
    """The `effect` of each condition on ln d33 for its standard deviation (columns,), and the effects' covariance;
    which are `told` by the recordings of each sensor, and the `values` (recordings, columns) less those of the load."""

    conditions: NotedConditions
    effect: Floats
    covariance: Floats
    told: Mask
    values: Floats

    def gain(self, rows: Indices, sensor: Indices, count: int) -> Floats:
        """The factor on the d33 of the sensors of these recordings over that at the conditions' means (rows,)."""
        return np.asarray(np.exp(self._of_sensors(rows, sensor, count) @ self.effect)[sensor])

    def unsure(self, rows: Indices, sensor: Indices, count: int) -> Floats:
        """The relative uncertainty of the d33 of each of `count` sensors by the effects (count,)."""
        mean = self._of_sensors(rows, sensor, count)
        return np.asarray(np.sqrt(np.einsum("gi,ij,gj->g", mean, self.covariance, mean)))

    def _of_sensors(self, rows: Indices, sensor: Indices, count: int) -> Floats:
        total = np.zeros((count, len(self.effect)))
        np.add.at(total, sensor, self.values[rows])
        return total / np.maximum(np.bincount(sensor, minlength=count), 1)[:, None]

    def findings(self, rows: Indices, sensor: Indices, count: int) -> list[Finding]:
        """A finding on each condition whose effect on the d33 of a sensor is 1 % or more, root mean square, and on each
        physical one that the recordings of each sensor do not tell but may have as large an effect."""
        means, every = self._of_sensors(rows, sensor, count), []
        for index, name in enumerate(self.conditions.names):
            largest = float(np.abs(means[:, index]).max())
            unsure = float(np.sqrt(self.covariance[index, index])) if self.told[index] else USUAL_GAIN
            if largest * float(np.hypot(self.effect[index], unsure)) < STATED:
                continue
            deviation, centre = self.conditions.deviation[index], self.conditions.mean[index]
            of_sensors = centre + deviation * means[np.unique(sensor), index]
            span = float(np.ptp(of_sensors))
            if not span > 0:
                continue
            arguments = {
                "name": name, "low": _to_step(of_sensors.min(), span), "high": _to_step(of_sensors.max(), span),
            }  # fmt: skip
            reason = Reason.CONDITION_DIFFERS
            if self.told[index]:
                percent, unsure_percent = (float(100 * part / deviation) for part in (self.effect[index], unsure))
                arguments |= {
                    "mean": _to_step(centre, span), "percent": _to_step(percent, unsure_percent),
                    "unsure": unsure_percent, "left_percent": 100 * largest * unsure,
                }  # fmt: skip
            elif _PHYSICAL.search(name):
                reason = Reason.CONDITION_NOT_TOLD
            else:
                continue
            every.append(Finding(reason, "", f"conditions.{name}", arguments))
        return every


def _to_step(value: float, span: float) -> float:
    """The value to a hundredth of a span's power of ten."""
    return round(float(value), 2 - math.floor(math.log10(span)))


def noted_conditions(recorded: Sequence[FrfRecording]) -> NotedConditions:
    """The numbers among the lab's own columns that are not the same in all recordings."""
    every = [recording.conditions or {} for recording in recorded]
    names = dict.fromkeys(name for noted in every for name, value in noted.items() if not isinstance(value, str))
    columns = []
    for name in names:
        values = np.array([_number(noted.get(name)) for noted in every])
        there: Mask = np.isfinite(values)
        mean, deviation = float(values[there].mean()), float(values[there].std())
        if deviation > 0:
            columns.append((name, mean, deviation, np.where(there, (values - mean) / deviation, 0.0)))
    kept, means, deviations, standard = zip(*columns, strict=True) if columns else ((), (), (), ())
    values = np.column_stack(standard) if columns else np.zeros((len(recorded), 0))
    return NotedConditions(kept, np.array(means), np.array(deviations), values)


def _number(value: float | str | None) -> float:
    return float(value) if isinstance(value, (int, float)) else float("nan")
