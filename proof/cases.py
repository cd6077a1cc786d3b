"""Campaigns to diagnose: from a file, drawn by the virtual rig, or made; small, so that they can be sent to any
process."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rig.draw import drawn, record
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.elastomer import campaign_of_curves
from rig.recorded import campaign
from rig.wide_tails import USUAL, WIDE


class Case(Protocol):
    """A campaign to diagnose, with a unique name."""

    @property
    def name(self) -> str:
        """Its name in the results."""
        ...

    def document(self) -> dict[str, Any]:
        """The campaign (`campaign/1`): all that the diagnosis is told."""
        ...


@dataclass(frozen=True)
class FileCase:
    """A campaign/1 file."""

    path: Path

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem

    def document(self) -> dict[str, Any]:
        """What the file holds."""
        return dict(json.loads(self.path.read_text(encoding="utf-8")))


@dataclass(frozen=True)
class DrawnCase:
    """Random experiment `number` of a seed on the virtual rig; what it hides (`what`) is drawn too if None."""

    seed: int
    number: int
    what: str | None = None
    tails: str = USUAL

    @property
    def name(self) -> str:
        """Seed, number and what was asked for."""
        return f"{self.seed}-{self.number:04d}-{self.what or 'any'}{'-wide' if self.tails == WIDE else ''}"

    @property
    def description(self) -> dict[str, Any]:
        """The experiment (`experiment/1`), with what it hides."""
        return drawn(self.seed, self.number, self.what, self.tails)

    def document(self) -> dict[str, Any]:
        """What the rig records, without its truth."""
        return campaign(record(self.description))


@dataclass(frozen=True)
class DrawnCurves:
    """Raw indentation curves of random experiment `number` of a seed on the virtual rig, with what they hide."""

    seed: int
    number: int
    what: str

    @property
    def name(self) -> str:
        """Seed, number and what was asked for."""
        return f"curves-{self.seed}-{self.number:04d}-{self.what}"

    def document(self) -> dict[str, Any]:
        """What the rig records, without its truth."""
        return campaign_of_curves(*drawn_curves(self.seed, self.number, INDENTATION, self.what))


@dataclass(frozen=True)
class MadeCase:
    """A campaign/1 document that was made from recordings."""

    name: str
    content: dict[str, Any]

    def document(self) -> dict[str, Any]:
        """The document."""
        return self.content
