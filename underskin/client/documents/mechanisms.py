"""The catalogue of mechanisms. Written by scripts/client_documents.py."""

from dataclasses import dataclass

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class MechanismParameter(Document):
    """A parameter of a mechanism of the lab's own."""

    name: str
    """Its name."""

    unit: str
    """Its unit; - for none."""

    low: float
    """The least value that is tried."""

    high: float
    """The largest value that is tried."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MechanismEntry(Document):
    """A mechanism that diagnoses know by name."""

    name: str
    """Its name in reports."""

    description: str
    """What happens, in a sentence."""

    law: str
    """What it changes, as a formula."""

    kinds: tuple[str, ...]
    """Kinds of recordings that it acts on."""

    assumptions: str
    """Where the law holds."""

    source: str
    """Where it comes from."""

    package: str | None
    """The package or file that it comes from; null for underskin's own."""

    own: bool
    """Whether it is one of the lab's own, which can be discarded."""

    parameters: tuple[MechanismParameter, ...]
    """Of the lab's own; empty for others."""
