"""What h5py's errors about a damaged file say, in words."""

import re

_CUT = re.compile(r"truncated file: eof = (\d+),.*stored_eof = (\d+)")


def damage(error: Exception) -> str:
    """What is wrong with the file; h5py lets any exception of a damaged one through."""
    cut = _CUT.search(str(error))
    if cut is not None:
        return f"was cut off: {cut[1]} of its {cut[2]} bytes are there; copy it once more"
    return f"is damaged: {type(error).__name__}: {error}"
