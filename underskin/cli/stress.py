"""The command `underskin stress`."""

from typing import Annotated

import typer


def stress(
    request: Annotated[
        str, typer.Argument(metavar="FILE", help="JSON as for POST /v1/stress: skin, sensors and loads; - is stdin.")
    ],
    pressure_map: Annotated[
        str | None,
        typer.Option(
            metavar="CSV",
            help="File of the pressure map, where the JSON has none: x_mm in the first line, from its second cell on; "
            "then a line for each y_mm, which comes first, with its pressure_mpa.",
        ),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="Write CSV instead of a table.")] = False,
) -> None:
    """The charge on every sensor of an array under several contacts or a pressure map."""
    from underskin.array_stress.answer import answer
    from underskin.array_stress.request import read_file
    from underskin.cli import columns
    from underskin.surrogate.tables import load_influence

    stresses = answer(load_influence(), read_file(request, pressure_map))
    columns.write_findings(stresses.findings)
    write = columns.write_csv if csv else columns.write_table
    write(stresses.columns, stresses.inside, stresses.limits, len(stresses.sensors), {"sensor": stresses.sensors})
