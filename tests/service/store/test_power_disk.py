"""What the disk of the tests of power cuts forgets, and what it keeps."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.power.disk import Disk, powered

pytestmark = pytest.mark.slow

WRITES = """
import os, sys
folder = sys.argv[1]
def write(name, text, sync):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text)
        file.flush()
        if sync:
            os.fsync(file.fileno())
write("old", "new content", sync=False)
write("half", "a" * 4096, sync=True)
with open(os.path.join(folder, "half"), "r+") as file:
    file.write("b" * 4096)
write("named", "whole", sync=True)
write("empty", "content", sync=False)
os.fsync(os.open(folder, os.O_RDONLY))
write("nameless", "synced", sync=True)
os.rename(os.path.join(folder, "named"), os.path.join(folder, "renamed"))
"""


def test_a_cut_forgets_what_was_not_synced(tmp_path: Path) -> None:
    (tmp_path / "old").write_text("old content")
    with powered(tmp_path) as disk:
        write(disk)
        disk.cut()
    left = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert left == {"old": "old content", "half": "a" * 4096, "named": "whole", "empty": ""}


def write(disk: Disk) -> None:
    """Run WRITES as a process of that disk."""
    command = [sys.executable, "-c", WRITES, str(disk.folder)]
    subprocess.run(command, env=os.environ | disk.environment, check=True)
