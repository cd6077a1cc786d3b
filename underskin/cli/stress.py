"""The commands `underskin stress` and `underskin field`."""

from typing import Annotated

import typer

from underskin.cli.rigs import Contact, ContactOption


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
    from underskin.surrogate.influence_table import load_influence

    stresses = answer(load_influence(), read_file(request, pressure_map))
    columns.write_findings(stresses.findings)
    write = columns.write_csv if csv else columns.write_table
    write(stresses.columns, stresses.inside, stresses.limits, len(stresses.sensors), {"sensor": stresses.sensors})


def _number(meaning: str) -> object:
    return typer.Option(help=meaning, metavar="NUMBER", show_default=False)


def field(
    thickness_mm: Annotated[float, _number("Thickness h of the layer over the sensors [mm].")],
    youngs_modulus_mpa: Annotated[float, _number("Young's modulus E of the layer [MPa].")],
    sensor_radius_mm: Annotated[float, _number("Radius rT of a sensor, centred under the sphere [mm].")],
    indenter_radius_mm: Annotated[float, _number("Radius R of the sphere [mm].")],
    preload_n: Annotated[float, _number("Force F of the sphere [N].")],
    poisson_ratio: Annotated[
        float, _number("Poisson's ratio, 0.5 if left out; below, the linear layer at small strain.")
    ] = 0.5,
    contact: ContactOption = Contact.PAPER,
    r_points: Annotated[int, typer.Option(min=2, help="Distances from the axis.", metavar="COUNT")] = 61,
    depth_points: Annotated[int, typer.Option(min=2, help="Depths, from surface to base.", metavar="COUNT")] = 26,
    units_checked: Annotated[
        bool, typer.Option("--units-checked", help="Accept magnitudes that look like a slip of units.")
    ] = False,
    csv: Annotated[bool, typer.Option("--csv", help="Write the whole section as CSV instead of a table.")] = False,
) -> None:
    """The stress σ_zz in the layer under a sphere: as a table on the base, as CSV at every depth."""
    inputs = {
        "thickness_mm": thickness_mm,
        "youngs_modulus_mpa": youngs_modulus_mpa,
        "sensor_radius_mm": sensor_radius_mm,
        "indenter_radius_mm": indenter_radius_mm,
        "preload_n": preload_n,
        "poisson_ratio": poisson_ratio,
    }
    import numpy as np

    from underskin.cli import columns
    from underskin.physics.charge_response import INCOMPRESSIBLE
    from underskin.prediction.answers import lab_columns
    from underskin.prediction.stress_field import field_from_lab
    from underskin.surrogate.sigma_table import load_table
    from underskin.surrogate.solved_contact import contact_model
    from underskin.units import to_lab

    model = contact_model(load_table(), contact.value)
    stress_field = field_from_lab(model, inputs, r_points, depth_points, units_checked=units_checked)
    r, depth, stress = (
        to_lab(name, values)
        for name, values in (
            ("r_mm", stress_field.r),
            ("depth_mm", stress_field.depth),
            ("sigma_zz_mpa", stress_field.sigma_zz[0]),
        )
    )
    limits = (
        None if stress_field.limits[0] is None else [stress_field.limits[0]] * (r.size * depth.size if csv else r.size)
    )
    if csv:
        section = {"depth_mm": np.repeat(depth, r.size), "r_mm": np.tile(r, depth.size), "sigma_zz_mpa": stress.ravel()}
        columns.write_csv(section, stress_field.contact.inside, limits, stress.size)
        return
    pressed = {**{name: np.array(value) for name, value in inputs.items()}, **lab_columns(stress_field.contact)}
    bounded = poisson_ratio == INCOMPRESSIBLE and contact is Contact.PAPER
    error = {"section_error": stress_field.section_error} if bounded else {}
    base = {**error, "r_mm": r, "sigma_zz_mpa": stress[-1]}
    columns.write_table({**pressed, **base}, stress_field.contact.inside, limits, r.size)
