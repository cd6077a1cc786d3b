"""`underskin tablegen`: make tables by finite elements."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from underskin.errors import UnderskinError

tablegen = typer.Typer(no_args_is_help=True, help="Make tables by finite elements (offline; minutes).")


Out = Annotated[Path, typer.Option(help="The HDF5 file to write.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of a Dask scheduler; default: all cores of this machine.")]


@tablegen.command()
def sigma(out: Out, scheduler: Scheduler = None) -> None:
    """Solve σ over contact radius, sensor radius and load. Killed at any moment, it resumes when called again."""
    from tablegen.sigma_table import make_sigma_table

    _make("sigma", make_sigma_table, out, scheduler)


@tablegen.command()
def influence(out: Out, scheduler: Scheduler = None) -> None:
    """Solve point loads over Poisson's ratio, glue line, sensor radius and distance; resumes like sigma."""
    from tablegen.influence_table import make_influence_table

    _make("influence", make_influence_table, out, scheduler)


@tablegen.command()
def contact(out: Out, scheduler: Scheduler = None) -> None:
    """Press spheres into the layer over their radius and the load; resumes like sigma."""
    from tablegen.contact_table import make_contact_table

    _make("contact", make_contact_table, out, scheduler)


def _make(name: str, make: Callable[..., str], out: Path, scheduler: str | None) -> None:
    try:
        digest = make(out, scheduler=scheduler)
    except UnderskinError as error:
        typer.echo(f"tablegen {name}: {error}", err=True)
        raise typer.Exit(1) from error
    typer.echo(f"{out} sha256 {digest}")
