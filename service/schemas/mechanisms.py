"""Mechanisms: requests and answers."""

from pydantic import BaseModel, Field

from service.schemas.base import StrictRequest


class MechanismParameter(BaseModel):
    """A parameter of a mechanism of the lab's own."""

    name: str = Field(description="Its name.")
    unit: str = Field(description="Its unit; - for none.")
    low: float = Field(description="The least value that is tried.")
    high: float = Field(description="The largest value that is tried.")


class MechanismEntry(BaseModel):
    """A mechanism that diagnoses know by name."""

    name: str = Field(description="Its name in reports.", examples=["adhesion"])
    description: str = Field(description="What happens, in a sentence.")
    law: str = Field(description="What it changes, as a formula.")
    kinds: list[str] = Field(description="Kinds of recordings that it acts on.", examples=[["frf"]])
    assumptions: str = Field(description="Where the law holds.")
    source: str = Field(description="Where it comes from.")
    package: str | None = Field(description="The package or file that it comes from; null for underskin's own.")
    own: bool = Field(description="Whether it is one of the lab's own, which can be discarded.")
    parameters: list[MechanismParameter] = Field(description="Of the lab's own; empty for others.")


class UnusableFile(BaseModel):
    """A file of the lab's folder that cannot be used: no diagnosis is made until it is mended or removed."""

    file: str = Field(description="Its name.", examples=["warm.yaml"])
    reason: str = Field(description="Why, with the line.")


class MechanismList(BaseModel):
    """The catalogue of mechanisms, in the order in which a model composes them."""

    mechanisms: list[MechanismEntry] = Field(description="All of them.")
    unusable: list[UnusableFile] = Field(description="Files of the lab's own that are left out.")


class KeepFound(StrictRequest):
    """Keeps the law that a diagnosis found beside the catalogue."""

    diagnosis_id: str = Field(description="A diagnosis whose report has `unnamed`.")
    name: str = Field(description="What to call it: lower case letters, digits and _.", examples=["warm_skin"])
    description: str | None = Field(default=None, max_length=500, description="One sentence on what it is.")
