"""Writes docs/proof.md and its figures from the parts that were worked out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proof import figures
from proof.concealed import judged_of
from proof.text import document


def write_page(parts: Mapping[str, Mapping[str, Any]], docs: Path) -> list[Path]:
    """The page and its figures; returns their paths."""
    folder = docs / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    written = [docs / "proof.md"]
    written[0].write_text(document(parts), encoding="utf-8")
    if "mixture" in parts:
        judged = judged_of(parts["mixture"])
        visible = [judgement for judgement in judged if judgement.visible]
        written.append(figures.calibration_and_size(visible, folder / "proof-calibration.svg"))
        written.append(figures.confusion(visible, folder / "proof-confusion.svg"))
    if "recordings" in parts:
        written.append(figures.before_and_after(parts["recordings"]["campaigns"], folder / "proof-recordings.svg"))
    return written
