"""The option `--contact` of commands."""

from enum import StrEnum
from typing import Annotated

import typer


class Contact(StrEnum):
    """How the sphere touches the layer, as `ContactName` has it."""

    PAPER = "paper"
    SOLVED = "solved"


ContactOption = Annotated[
    Contact,
    typer.Option(
        help="Hertz' pressure of a half space on the layer, as a dead load; or contact with the layer itself, solved."
    ),
]
