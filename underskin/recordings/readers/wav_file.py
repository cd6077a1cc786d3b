"""Sound files, WAV: each channel as a part of the full scale, 1, which a rig description makes a quantity.

A recorder's full scale is a voltage that its manual or its gain states: `unit: V` where it is 1 V, else a formula, such
as `force: 10 [V] * 'channel 1' [1] / 0.5 [V/N]`.
"""

import warnings
from typing import BinaryIO

import numpy as np
from scipy.io import wavfile

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import Block, Channel, Contents

_OF_8_BITS = 128  # the level of silence


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a WAV file; raises FileError where it is none."""
    stream.seek(0)
    with (
        damage_said(file, "", lambda error: f"is no WAV file that can be read: {error}"),
        warnings.catch_warnings(record=True) as caught,
    ):
        warnings.simplefilter("always")  # of chunks that hold no samples
        try:
            rate, samples = wavfile.read(stream)
        except MemoryError:
            raise FileError(file, "", "declares more samples than the file holds, or than there is memory") from None
    if not len(samples) or rate <= 0:
        raise FileError(file, "", "holds no samples")
    samples = samples.reshape(len(samples), -1)
    if samples.dtype.kind == "u":
        scaled = (samples.astype(np.float64) - _OF_8_BITS) / _OF_8_BITS
    elif samples.dtype.kind == "i":
        scaled = samples.astype(np.float64) / -float(np.iinfo(samples.dtype).min)
    else:
        scaled = samples.astype(np.float64)
    channels = tuple(Channel(f"channel {number}", "", column) for number, column in enumerate(scaled.T, start=1))
    cut = [str(warning.message) for warning in caught if "EOF" in str(warning.message)]
    return Contents((Block("", channels, float(rate)),), {}, tuple(cut))
