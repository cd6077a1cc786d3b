"""From an instrument's channels to a campaign, by a rig description."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

from underskin.errors import FileError
from underskin.recordings import common_start
from underskin.recordings.campaign import SCHEMA
from underskin.recordings.channels import Block, Contents
from underskin.recordings.curve_parts import curve_parts, doubts
from underskin.recordings.mapped_block import MappedBlock
from underskin.recordings.readers import derived_channels
from underskin.recordings.rig_description import BLOCK_NAME, CurveChannel, RigDescription, Trim
from underskin.recordings.shown_values import LONGEST_NAME
from underskin.recordings.stated_values import common_value


@dataclass(frozen=True)
class MappedFile:
    """The campaign document of a file, what the user should know, and of each field of the first recording what was
    taken for it, in words; under no field how the text was read."""

    document: dict[str, Any]
    warnings: list[str]
    taken: dict[str, str]


def apply(rig: RigDescription, contents: Contents, file: str) -> MappedFile:
    """The campaign document, one recording for each curve in a block that holds the rig's channels.

    Raises FileError that names the channel or property that is missing or whose unit does not fit.
    """
    in_formulas = [name for formula in rig.derived.values() for name in formula.names]
    contents = common_start.aligned(contents, dict.fromkeys([*_channel_names(rig), *in_formulas]), file)
    contents = derived_channels.with_derived(contents, rig.derived, lambda one: _stated(contents, one, one.name), file)
    blocks = _with_channels(rig, contents, file)
    warnings = [*contents.warnings, *doubts(contents, rig.curves)]
    if len(blocks) < len(contents.blocks):
        warnings.append(f"{len(contents.blocks) - len(blocks)} parts without the rig's channels are left out")
    stem = _printable(PurePath(file).stem)
    recordings = []
    taken: dict[str, str] = {"": contents.layout} if contents.layout else {}
    curves = curve_parts(blocks, rig.curves, file)
    parts = [(_trimmed(block, rig.trim, file), of) for block, of in curves]
    if rig.trim is not None:
        warnings.append(_used(rig.trim, [_samples(block) for block, _ in curves]))
    for number, (block, of) in enumerate(parts, start=1):
        label = _label(stem, _printable(block.name) or str(number)) if len(parts) > 1 else stem
        stated = _stated(contents, block, of)
        common = {name: common_value(name, value, stated, file) for name, value in rig.recording.items()}
        began = {} if block.recorded_at is None else {"recorded_at": block.recorded_at}
        mapped = MappedBlock(rig, block, stated, file)
        estimated = {} if rig.estimator is None else {"estimator": rig.estimator}
        own = {"id": label, "kind": rig.kind, **began, **estimated}
        recordings.append({**own, **mapped.spring(), **common, **mapped.fields()})
        warnings += mapped.warnings
        taken |= {name: how for name, how in mapped.taken.items() if name not in taken}
    document = {"schema": SCHEMA, "name": stem, "skin": rig.skin, "recordings": recordings}
    return MappedFile({**document, "units_checked": rig.units_checked}, list(dict.fromkeys(warnings)), taken)


def has_channels(rig: RigDescription, contents: Contents) -> bool:
    """Whether a part of a file holds every channel that the rig names, or can derive."""
    try:
        derived = derived_channels.with_derived(contents, rig.derived, lambda one: _stated(contents, one, one.name), "")
        return bool(_with_channels(rig, derived, ""))
    except FileError:
        return False


def _with_channels(rig: RigDescription, contents: Contents, file: str) -> list[Block]:
    """The blocks that hold every channel that the rig names."""
    names = _channel_names(rig)
    blocks = [block for block in contents.blocks if all(block.headed(name) for name in names)]
    if blocks:
        return blocks
    nearest = max(contents.blocks, key=lambda block: sum(map(bool, map(block.headed, names))), default=Block("", ()))
    missing = ", ".join(name for name in names if not nearest.headed(name))
    lacks = f"no part holds all channels that the rig description names: it lacks {missing}"
    raise FileError(file, "", f"{lacks}; it has {contents.described()}")


def _trimmed(block: Block, trim: Trim | None, file: str) -> Block:
    """The samples that are used; those that a short curve lacks are not missed at its end."""
    if trim is None:
        return block
    start = (trim.first_sample or 1) - 1
    channels = tuple(replace(channel, values=channel.values[start : trim.last_sample]) for channel in block.channels)
    if _samples(block) <= start:
        reason = f"is {start + 1}; {block.name or 'the curve'} has {_samples(block)} samples"
        raise FileError(file, "trim.first_sample", reason)
    return replace(block, channels=channels, group_starts=())


def _used(trim: Trim, samples: Sequence[int]) -> str:
    """Which samples are used of curves that have so many each."""
    last = trim.last_sample
    short = [count for count in samples if last is not None and count < last]
    if not short:
        return f"of each curve, {trim.words} are used"
    if len(samples) == 1:
        used = replace(trim, last_sample=short[0]).words
        return f"{used} are used: the curve ends there, before the last sample that was said, {last}"
    ends = f"{len(short)} of {len(samples)} curves end before that, the shortest at sample {min(short)}"
    return (
        f"of each curve, {trim.words} are used; {ends}, and of these all samples from {trim.first_sample or 1} on are"
    )


def _samples(block: Block) -> int:
    return max((len(channel.values) for channel in block.channels), default=0)


def _channel_names(rig: RigDescription) -> Sequence[str]:
    """Each once, in the order of the description."""
    names = [signal.channel for entry in rig.channels.values() for signal in entry.signals]
    curves = rig.curves
    by = (curves.channel or curves.segments) if isinstance(curves, CurveChannel) else None
    return list(dict.fromkeys([*names, *([] if by is None else [by])]))


def _label(stem: str, part: str) -> str:
    """The file's name and the part's; the file's is cut where both make more than an id may have."""
    return f"{stem[: max(0, LONGEST_NAME - 1 - len(part))]} {part}".strip()


def _printable(name: str) -> str:
    return "".join(letter for letter in name if letter.isprintable())[:LONGEST_NAME].strip()


def _stated(contents: Contents, block: Block, of: str) -> dict[str, str | float]:
    """What the file says about itself; of the block named `of`, in which this one is, its own properties
    (`run.preload` is `preload`), and this one's name."""
    own = f"{of}."
    about_block = {name.removeprefix(own): value for name, value in contents.properties.items() if name.startswith(own)}
    return {BLOCK_NAME: block.name, **contents.properties, **about_block}
