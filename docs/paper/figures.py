"""The five figures, drawn from the library alone; the same input gives the same bytes."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.paper.prototype import BEST_FIT_D33_PC_PER_N, INDENTERS_MM, PRELOADS_N, RHO, press
from tablegen import linear_layer
from underskin.physics import charge_response, half_space
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_STYLE = Path(__file__).parents[1] / "figures.mplstyle"
_LOADS = (0.0, 1e-3, 1e-2, 1e-1)
_RADII = (0.0, 0.2, 0.6, 1.0)
_FLAT_ZONE_HZ = (1.0, 130.0)


def draw(table: SigmaTable, folder: Path) -> list[Path]:
    """Write paper-fig4, 6, 8, 10 and 11 as SVG into `folder`; returns their paths."""
    drawings = {
        "4": _point_force,
        "6": _hertz_pressure,
        "8": _finite_strain,
        "10": _frf_over_frequency,
        "11": _frf_over_preload,
    }
    paths = []
    with mpl.rc_context(fname=_STYLE):
        for number, drawing in drawings.items():
            figure = Figure(figsize=(7.6, 3.2), layout="constrained")
            drawing(figure, table)
            paths.append(folder / f"paper-fig{number}.svg")
            figure.savefig(paths[-1], metadata={"Date": None})
    return paths


def _point_force(figure: Figure, _: SigmaTable) -> None:
    offset = np.linspace(0, 3, 181)
    left, right = figure.subplots(1, 2, sharey=True)
    for rho in _RADII:
        left.plot(offset, half_space.gamma_n(offset, rho), label=f"rT/h = {rho:g}")
        right.plot(offset, linear_layer.gamma_n(offset, rho), label=f"rT/h = {rho:g}")
    _label(left, "half space (equation 6)", "distance of the force, r̂/h", "γ")
    _label(right, "bonded layer, exact", "distance of the force, r̂/h", "")


def _hertz_pressure(figure: Figure, _: SigmaTable) -> None:
    a = np.linspace(0, 3, 181)
    left, right = figure.subplots(1, 2, sharey=True)
    for rho in _RADII:
        name = "rT/h = 0: δ(a/h)" if rho == 0 else f"rT/h = {rho:g}"
        left.plot(a, half_space.sigma(a, rho), label=name)
        right.plot(a, linear_layer.sigma(a, rho), label=f"rT/h = {rho:g}")
    _label(left, "half space (equations 12 and 14)", "contact radius, a/h", "σ")
    _label(right, "bonded layer, exact (L = 0)", "contact radius, a/h", "")


def _finite_strain(figure: Figure, table: SigmaTable) -> None:
    left, right = figure.subplots(1, 2)
    a = np.linspace(0, 2, 121)
    for load in _LOADS:
        left.plot(a, table.sigma(a, RHO, load).sigma, label=f"L = {load:g}")
    left.plot(a, half_space.sigma(a, RHO), "k:", label="half space")
    _label(left, f"σ at rT/h = {RHO:g}", "contact radius, a/h", "σ")
    a = np.linspace(0.05, 0.5, 46)
    for load in _LOADS[1:]:
        ratio = table.sigma(a, RHO, load).sigma / linear_layer.sigma(a, RHO)
        right.plot(a, 100 * (ratio - 1), "k-", linewidth=0.7)
        right.annotate(f"L = {load:g}", (a[-1], 100 * (ratio[-1] - 1)), ha="right", va="bottom", fontsize=8)
    marks = []
    for radius in INDENTERS_MM:
        pressed = press(table, radius, PRELOADS_N)
        change = 100 * (pressed.table / pressed.linear - 1)
        marks += list(zip(pressed.a_over_h, change, strict=True))
        right.plot(pressed.a_over_h, change, "o-", label=f"R = {radius:g} mm, 0.5 to 3 N")
    right.plot(*np.array(sorted(marks)).T, "k:", label="joined by a/h alone")
    _label(right, "what L adds to the linear layer", "contact radius, a/h", "%")


def _frf_over_frequency(figure: Figure, table: SigmaTable) -> None:
    frequency = np.geomspace(1, 1000, 61)
    for axes, radius in zip(figure.subplots(1, 2, sharey=True), INDENTERS_MM, strict=True):
        for preload in PRELOADS_N:
            value = _frf_pc_per_n(press(table, radius, [preload]).table)
            axes.semilogx(frequency, np.full_like(frequency, value[0]), label=f"Re, {preload:g} N")
        axes.semilogx(frequency, np.zeros_like(frequency), "k--", label="Im, every preload")
        axes.axvspan(*_FLAT_ZONE_HZ, color="0.9", zorder=0)
        _label(axes, f"R = {radius:g} mm, d33 = {BEST_FIT_D33_PC_PER_N:g} pC/N", "frequency, Hz", "FRF, pC/N")


def _frf_over_preload(figure: Figure, table: SigmaTable) -> None:
    preload = np.linspace(*_ends(), 51)
    left, right = figure.subplots(1, 2, sharey=True)
    for number, radius in enumerate(INDENTERS_MM):
        pressed, colour = press(table, radius, preload), f"C{number}"
        models = (
            ("table", pressed.table, "-"),
            ("linear", pressed.linear, "--"),
            ("half space", pressed.half_space, ":"),
        )
        for name, sigma, line in models:
            left.plot(preload, _frf_pc_per_n(sigma), line, color=colour, label=f"R = {radius:g} mm, {name}")
    _label(left, f"d33 = {BEST_FIT_D33_PC_PER_N:g} pC/N", "preload, N", "FRF plateau, pC/N")
    pressed = press(table, INDENTERS_MM[0], preload)
    for d33 in (14.0, 22.0):
        right.plot(preload, _frf_pc_per_n(pressed.table, d33), label=f"d33 = {d33:g} pC/N")
    for preload_n, d33 in ((1.0, 14.0), (3.0, 22.0)):
        point = _frf_pc_per_n(press(table, INDENTERS_MM[0], [preload_n]).table, d33)
        right.plot([preload_n], point, "o", clip_on=False, label=f"array at {preload_n:g} N")
    _label(right, f"array, R = {INDENTERS_MM[0]:g} mm", "preload, N", "")


def _frf_pc_per_n(sigma: Floats, d33_pc_per_n: float = BEST_FIT_D33_PC_PER_N) -> Floats:
    return d33_pc_per_n * charge_response.gain(sigma, RHO)


def _ends() -> tuple[float, float]:
    return PRELOADS_N[0], PRELOADS_N[-1]


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.margins(x=0)
    axes.legend()
