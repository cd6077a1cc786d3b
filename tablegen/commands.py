"""`underskin tablegen`: make tables by finite elements."""

from pathlib import Path
from typing import Annotated

import typer

from tablegen.sigma_table import make_sigma_table
from underskin.errors import UnderskinError

tablegen = typer.Typer(no_args_is_help=True, help="Make tables by finite elements (offline; minutes).")


@tablegen.callback()
def _group() -> None:
    """Keeps `sigma` a subcommand while it is the only one."""


@tablegen.command()
def sigma(
    out: Annotated[Path, typer.Option(help="The HDF5 file to write.")],
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler; default: all cores of this machine.")
    ] = None,
) -> None:
    """Solve σ over contact radius, sensor radius and load. Killed at any moment, it resumes when called again."""
    try:
        digest = make_sigma_table(out, scheduler=scheduler)
    except UnderskinError as error:
        typer.echo(f"tablegen sigma: {error}", err=True)
        raise typer.Exit(1) from error
    typer.echo(f"{out} sha256 {digest}")
