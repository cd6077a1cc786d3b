"""The memory of a server process and of all that it has started, from /proc."""

import re
from pathlib import Path


def memory_bytes(pid: int) -> int:
    """Resident memory [bytes] of a process and of all other programs that it has started; 0 where it has ended."""
    process = Path(f"/proc/{pid}")
    try:
        found = re.search(r"VmRSS:\s+(\d+) kB", (process / "status").read_text())
        children = [child for task in process.glob("task/*/children") for child in task.read_text().split()]
    except OSError:  # it has ended
        return 0
    return (int(found[1]) * 1024 if found else 0) + sum(
        memory_bytes(int(child)) for child in children if _program(int(child)) != _program(pid)
    )


def _program(pid: int) -> bytes:
    """The command line of a process; until it has become another program it has the memory of its parent."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""
