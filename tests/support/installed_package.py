"""A package of another lab, as an installer leaves it."""

from pathlib import Path


def installed(folder: Path, group: str, target: str, source: str) -> Path:
    """The folder to put on the path; its entry point `thing` names `target` of the module lab_tools."""
    (folder / "lab_tools-2.1.dist-info").mkdir(parents=True)
    (folder / "lab_tools.py").write_text(source, encoding="utf-8")
    (folder / "lab_tools-2.1.dist-info" / "METADATA").write_text("Name: lab-tools\nVersion: 2.1\n")
    (folder / "lab_tools-2.1.dist-info" / "entry_points.txt").write_text(f"[{group}]\nthing = lab_tools:{target}\n")
    return folder
