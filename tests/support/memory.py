"""Memory of a process and of all below it, and the processes that it has started."""

from pathlib import Path


def family_mb(process: int) -> float:
    """In MB; what processes share counts once, in parts. What ends meanwhile counts nothing."""
    return sum(map(_own_part_mb, _family(process)))


def children(process: int) -> list[int]:
    """The processes that a process has started and that have not ended."""
    try:
        tasks = list(Path(f"/proc/{process}/task").iterdir())
    except OSError:  # it has ended meanwhile
        return []
    return [int(child) for task in tasks for child in _text(task / "children").split()]


def _family(process: int) -> list[int]:
    return [process, *(one for child in children(process) for one in _family(child))]


def _own_part_mb(process: int) -> float:
    lines = _text(Path(f"/proc/{process}/smaps_rollup")).splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1e3


def _text(file: Path) -> str:
    try:
        return file.read_text()
    except OSError:  # the process has ended meanwhile
        return ""
