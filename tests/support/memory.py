"""Memory of a process and of all below it."""

from pathlib import Path


def family_mb(process: int) -> float:
    """In MB; what processes share counts once, in parts. What ends meanwhile counts nothing."""
    return sum(map(_own_part_mb, _family(process)))


def _family(process: int) -> list[int]:
    found = [process]
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        for child in _text(children).split():
            found += _family(int(child))
    return found


def _own_part_mb(process: int) -> float:
    lines = _text(Path(f"/proc/{process}/smaps_rollup")).splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1e3


def _text(file: Path) -> str:
    try:
        return file.read_text()
    except OSError:  # the process has ended meanwhile
        return ""
