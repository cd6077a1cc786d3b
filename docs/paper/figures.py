"""The paper's figures, drawn from the library alone after the paper's captions; the same input gives the same bytes."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.paper import prototype_figures
from docs.paper.prototype import MODULUS_MPA, RHO, THICKNESS_MM
from tablegen import linear_layer
from underskin.physics import half_space, hertz
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

NUMBERS = ("4", "6", "8", "9", "10", "11", "13", "14", "15", "16")
_STYLE = Path(__file__).parents[1] / "figures.mplstyle"

# rT/h and line of the paper's captions; "yellow" is drawn darker to be seen on white
_SENSORS = (
    (0.0, "k-"), (0.2, "goldenrod"), (0.5, "green"), (0.6, "k:"),
    (0.7, "blue"), (1.0, "magenta"), (1.5, "deepskyblue"), (2.0, "red"),
)  # fmt: skip

# What figure 10 varies at fixed E, "arbitrarily playing with the two parameters"; the paper does not list its pairs.
SPHERES_MM = (2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 40.0)
FORCES_N = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
_COMPARED = (0.2, 0.6, 1.0, 2.0)
_STRIPS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)


def draw(table: SigmaTable, folder: Path) -> list[Path]:
    """Write paper-fig*.svg of all `NUMBERS` into `folder`; returns their paths."""
    drawings = {
        "4": _point_force,
        "6": _hertz_pressure_on_a_point,
        "8": _hertz_pressure,
        "9": prototype_figures.displacement,
        "10": _half_space_against_layer,
        "11": _strips_of_load,
        "13": prototype_figures.stress_strain,
        "14": prototype_figures.frf_over_frequency,
        "15": prototype_figures.frf_over_preload,
        "16": prototype_figures.array,
    }
    paths = []
    with mpl.rc_context(fname=_STYLE):
        for number in NUMBERS:
            figure = Figure(figsize=(7.6, 3.2), layout="constrained")
            drawings[number](figure, table)
            paths.append(folder / f"paper-fig{number}.svg")
            figure.savefig(paths[-1], metadata={"Date": None})
    return paths


def varied_contacts() -> tuple[Floats, Floats]:
    """a/h and L of every sphere of `SPHERES_MM` at every force of `FORCES_N`, in the order of a/h."""
    sphere, force = (grid.ravel() for grid in np.meshgrid(SPHERES_MM, FORCES_N))
    radius, modulus = to_si("indenter_radius_mm", sphere), to_si("youngs_modulus_mpa", MODULUS_MPA)
    a = hertz.contact_radius(force, radius, modulus) / to_si("thickness_mm", THICKNESS_MM)
    load = hertz.load_parameter(force, radius, modulus)
    order = np.lexsort((load, np.round(a, 9)))  # equal contacts by L
    return a[order], load[order]


def _point_force(figure: Figure, _: SigmaTable) -> None:
    offset = np.linspace(0, 3, 181)
    left, right = figure.subplots(1, 2, sharey=True)
    for rho, line in _SENSORS:
        _curve(left, offset, half_space.gamma_n(offset, rho), rho, line)
        _curve(right, offset, linear_layer.gamma_n(offset, rho), rho, line)
    _label(left, "half space, as in the paper", "distance of the force, r̂/h", "γ")
    _label(right, "layer on its rigid base, exact", "distance of the force, r̂/h", "")


def _hertz_pressure_on_a_point(figure: Figure, _: SigmaTable) -> None:
    a = np.linspace(0, 3, 181)
    axes = figure.subplots()
    axes.plot(a, half_space.delta(a), "k-", label="half space: δ = 1/(1 + (a/h)²)")
    axes.plot(a, linear_layer.sigma(a, 0.0), "C0-", label="layer on its rigid base, exact")
    _label(axes, "Hertz pressure over a point sensor", "contact radius, a/h", "δ")


def _hertz_pressure(figure: Figure, _: SigmaTable) -> None:
    a = np.linspace(0, 3, 181)
    left, right = figure.subplots(1, 2, sharey=True)
    for rho, line in _SENSORS:
        _curve(left, a, half_space.sigma(a, rho), rho, line)
        _curve(right, a, linear_layer.sigma(a, rho), rho, line)
    _label(left, "half space, as in the paper", "contact radius, a/h", "σ")
    _label(right, "layer on its rigid base, exact, L = 0", "contact radius, a/h", "")


def _half_space_against_layer(figure: Figure, table: SigmaTable) -> None:
    contact, load = varied_contacts()
    a = np.linspace(0, 1.05 * contact.max(), 121)
    left, right = figure.subplots(1, 2)
    for rho, line in _SENSORS:
        if rho in _COMPARED:
            _curve(left, a, half_space.sigma(a, rho), rho, line)
            left.plot(contact, table.sigma(contact, rho, load).sigma, "o-", color=_colour(line), markersize=2)
    _raise_top(left, 1.2)
    _label(left, "lines: half space; points: layer", "contact radius, a/h", "σ")
    change = 100 * (table.sigma(contact, RHO, load).sigma / linear_layer.sigma(contact, RHO) - 1)
    right.plot(contact, change, "ko:", markersize=3, label=f"rT/h = {RHO:g}")
    _label(right, "the oscillation: what L adds to σ(a/h)", "contact radius, a/h", "%")


def _strips_of_load(figure: Figure, table: SigmaTable) -> None:
    a = np.linspace(0.05, 1.0, 39)
    left, right = figure.subplots(1, 2)
    for number, load in enumerate(_STRIPS):
        sigma, colour = table.sigma(a, RHO, load).sigma, f"C{number}"
        left.plot(a, sigma, "o-", color=colour, markersize=2, label=f"L = {load:g}")
        right.plot(a, 100 * (sigma / linear_layer.sigma(a, RHO) - 1), "o-", color=colour, markersize=2)
    left.plot(a, half_space.sigma(a, RHO), "k:", label="half space")
    _label(left, f"rT/h = {RHO:g}", "contact radius, a/h", "σ")
    prototype_figures.mark_prototype(right, table)
    _raise_top(right, 1.5)
    _label(right, "what L adds to σ(a/h)", "contact radius, a/h", "%")


def _curve(axes: Axes, x: Floats, y: Floats, rho: float, line: str) -> None:
    name = "point sensor" if rho == 0 else f"rT/h = {rho:g}"
    axes.plot(x, y, color=_colour(line), linestyle=":" if line.endswith(":") else "-", label=name)


def _colour(line: str) -> str:
    return line.rstrip(":-")


def _raise_top(axes: Axes, times: float) -> None:
    """Room for the legend above the curves."""
    axes.set_ylim(top=times * axes.get_ylim()[1])


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.margins(x=0)
    axes.legend()
