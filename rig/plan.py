"""The recordings of an experiment, one row each, in the order in which they are made."""

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from rig.errors import RigError
from rig.experiment import MOST_RECORDINGS, Experiment
from rig.layer import Floats


@dataclass(frozen=True)
class Plan:
    """Arrays over recordings; `offset` is the commanded position from the sensor's centre (rows, 2), `hours` the
    time since midnight of the first day. Quantities that the experiment does not record are None."""

    sensor: NDArray[np.intp]
    indenter_mm: Floats
    preload_n: Floats
    dynamic_n: Floats
    offset_mm: Floats
    dwell_s: Floats | None
    cycles: NDArray[np.int64] | None
    start: datetime | None
    hours: Floats | None

    @property
    def recorded_at(self) -> list[str] | None:
        """Date and time of each recording."""
        if self.start is None or self.hours is None:
            return None
        midnight = self.start.replace(hour=0, minute=0, second=0, microsecond=0)
        return [
            (midnight + timedelta(seconds=round(3600 * float(hours)))).isoformat().replace("+00:00", "Z")
            for hours in self.hours
        ]


def recordings(experiment: Experiment) -> Plan:
    """The plan of an experiment of kind frf; raises RigError where there are too many recordings."""
    design, random = experiment.design, np.random.default_rng([experiment.seed, 0])
    ids = [sensor[0] for sensor in experiment.skin.sensors]
    chosen = [ids.index(name) for name in design.sensors] or range(len(ids))
    shape = (len(chosen), len(design.indenters_mm), len(design.preloads_n), len(design.offsets_mm), design.repeats)
    total = int(np.prod(shape))
    if total > MOST_RECORDINGS and design.most_recordings is None:
        raise RigError("design", f"{total} recordings", f"must make at most {MOST_RECORDINGS}: see most_recordings")
    order = random.permutation(total) if design.shuffled or design.most_recordings is not None else np.arange(total)
    chosen_rows = order[: design.most_recordings]
    if not design.shuffled:
        chosen_rows = np.sort(chosen_rows)
    sensor, indenter, preload, offset, _ = np.unravel_index(chosen_rows, shape)
    rows = len(chosen_rows)
    cycles = None
    if design.cycles_per_recording is not None:
        steps = design.cycles_per_recording * random.uniform(0.5, 1.5, rows)
        cycles = np.cumsum(steps).astype(np.int64)
    start, hours = None, None
    if design.start is not None:
        try:
            start = datetime.fromisoformat(design.start)
        except ValueError:
            raise RigError("design.start", design.start, "must be a date and time like 2017-05-03T09:00:00Z") from None
        first = start.hour + start.minute / 60 + start.second / 3600
        hours = first + design.minutes_per_recording / 60 * np.arange(rows, dtype=np.float64)
    return Plan(
        sensor=np.array(chosen)[sensor],
        indenter_mm=np.array(design.indenters_mm)[indenter],
        preload_n=np.array(design.preloads_n)[preload],
        dynamic_n=random.choice(np.array(design.dynamic_forces_n), rows),
        offset_mm=np.array(design.offsets_mm)[offset],
        dwell_s=random.choice(np.array(design.dwells_s), rows) if design.dwells_s else None,
        cycles=cycles,
        start=start,
        hours=hours,
    )
