"""Channels of one recording in several files, such as the force in one and the charge in another.

A rig description says how the names of the files belong together: `join: {_force: [_charge]}` reads `a_charge.csv`
with `a_force.csv`. Their clocks align them: the stated starts of both, and the first value of a column of times in
each; `regular_samples.aligned` cuts the channels to the samples in common.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents, with_distinct_names
from underskin.recordings.readers.unit_labels import unit
from underskin.recordings.regular_samples import OFF_SAMPLE, mean_step
from underskin.units import Floats


def files_to_join(file: Path, join: tuple[str, tuple[str, ...]]) -> Iterator[Path]:
    """The other files of a recording, by the name of the first; raises FileError where its name has not the part, or
    would give none of a file."""
    part, others = join
    if part not in file.name:
        raise FileError(str(file), "", f"has no {part!r} in its name, which says what files belong to it (join)")
    for other in others:
        name = other.join(file.name.rsplit(part, 1))
        if name in ("", ".", "..") or Path(name).name != name:
            raise FileError(str(file), "", f"would be joined with {name!r}, which must be the name of a file (join)")
        yield file.with_name(name)


def is_of_another(name: str, names: Iterable[str], join: tuple[str, tuple[str, ...]]) -> bool:
    """Whether a file belongs to the recording of another one of these names, and is none of its own."""
    firsts = (Path(first) for first in names if join[0] in first)
    return any(file.name == name for first in firsts for file in files_to_join(first, join))


def joined(contents: Contents, others: Mapping[str, Contents], file: str) -> Contents:
    """The contents with the channels of the `others`, part by part; a repeated name is numbered (`Value (2)`).

    Raises FileError that names the files where they have other parts, or no clock by which they could be aligned.
    """
    for name, other in others.items():
        if len(other.blocks) != len(contents.blocks):
            raise FileError(file, "", f"has {len(contents.blocks)} parts, and {name} {len(other.blocks)}")
        pairs = zip(contents.blocks, other.blocks, strict=True)
        blocks, notes = zip(*(_joined(first, second, file, name) for first, second in pairs), strict=True)
        warnings = (*contents.warnings, *(f"{name}: {warning}" for warning in other.warnings), *filter(None, notes))
        properties = {**other.properties, **contents.properties}
        contents = replace(contents, blocks=blocks, properties=properties, warnings=tuple(dict.fromkeys(warnings)))
    return contents


def _joined(first: Block, second: Block, file: str, other: str) -> tuple[Block, str]:
    """A part with the channels of the other, each with its start and rate unless both have one clock; and a note
    where they are taken to begin together."""
    clocks, times = zip(*(_clock(block) for block in (first, second)), strict=True)
    added = [channel for channel in second.channels if channel is not clocks[1]]
    texts = (*first.texts, *(words for words in second.texts if first.words(words.name) is None))
    lengths = [max((len(channel.values) for channel in block.channels), default=0) for block in (first, second)]
    rates = [_rate(block, time) for block, time in zip((first, second), times, strict=True)]
    starts = [float(time[0]) if len(time) else 0.0 for time in times]
    delay, told = _delay(first, second, starts, file, other)
    is_one_clock = np.array_equal(times[0], times[1]) and rates[0] == rates[1] and not delay
    if is_one_clock and lengths[0] == lengths[1]:
        lacking = "clock" if rates[0] is None else "" if first.recorded_at else "start"
        stated = f"{file} and {other} state no {lacking}: their rows are taken to be of one time"
        note = stated if lacking and not len(times[0]) else ""
        return replace(first, channels=with_distinct_names([*first.channels, *added]), texts=texts), note
    if rates[0] is not None and rates[1] is not None and abs(rates[1] / rates[0] - 1) * max(lengths) < OFF_SAMPLE:
        rates[1] = rates[0]  # but for rounding
    if None in rates:
        both = " and ".join(name for name, rate in zip((file, other), rates, strict=True) if rate is None)
        raise FileError(file, "", f"{both}: no rate and no even clock, by which they could be aligned")
    together = starts[0] == starts[1] + delay
    timed = [
        replace(
            channel,
            values=channel.values[: min(lengths)] if together else channel.values,
            sample_rate_hz=rate,
            starts_s=channel.starts_s + start,
        )
        for channels, rate, start in zip((first.channels, added), rates, (starts[0], starts[1] + delay), strict=True)
        for channel in channels
    ]
    note = f"{file} and {other} begin together, and are cut to {min(lengths)} samples" if together else told
    return replace(first, channels=with_distinct_names(timed), texts=texts, sample_rate_hz=None), note


def _clock(block: Block) -> tuple[Channel | None, Floats]:
    """The column of times of a part, of which there is one, and these [s]; empty without one."""
    labels = [(channel, unit(channel.label)) for channel in block.channels]
    times = [(channel, label.to_si) for channel, label in labels if label is not None and label.dimension == "time"]
    if len(times) != 1 or len(times[0][0].values) < 2:
        return None, np.zeros(0)
    return times[0][0], times[0][0].values.real * times[0][1]


def _rate(block: Block, time: np.ndarray) -> float | None:
    """Samples a second, as stated or by times in even steps."""
    if not len(time):
        return block.sample_rate_hz or None
    step = mean_step(time)
    even = time[0] + step * np.arange(len(time))
    return 1 / step if step > 0 and np.abs(time - even).max() <= OFF_SAMPLE * step else None


def _delay(first: Block, second: Block, starts: Sequence[float], file: str, other: str) -> tuple[float, str]:
    """The stated start of the second part after the first [s], 0 where neither states one; and a note.

    Whole seconds are too coarse to align samples. Where columns of times start [s] as far apart, they are those of one
    clock, which tells it exactly: then it is 0. Raises FileError where nothing tells it.
    """
    if first.recorded_at is None and second.recorded_at is None:
        return 0.0, ""
    stated = f"{file} at {first.recorded_at or '?'}, {other} at {second.recorded_at or '?'}"
    try:
        moments = [datetime.fromisoformat(block.recorded_at or "") for block in (first, second)]
        delay = (moments[1] - moments[0]).total_seconds()
    except (ValueError, TypeError):
        raise FileError(file, "", f"the starts of the files cannot be compared: {stated}") from None
    if not delay or any(moment.microsecond for moment in moments):
        return delay, ""
    if round(starts[1] - starts[0]) != delay:
        reason = f"the starts of the files differ, in whole seconds, by which no samples can be aligned: {stated}"
        raise FileError(file, "", reason)
    return 0.0, f"{file} and {other} are aligned by their columns of times, and not by their starts in whole seconds"
