"""The paper's figures of its prototype: the model's predictions, and the numbers that the paper states.

The measured curves of figures 13 to 16 are not available as numbers; none is drawn.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.paper import block_question, cylinder
from docs.paper.block import FiniteBlock, displacements
from docs.paper.prototype import (
    ARRAY,
    BEST_FIT_D33_PC_PER_N,
    CYLINDER_DIAMETER_MM,
    CYLINDER_HEIGHT_MM,
    FLAT_UP_TO_HZ,
    INDENTERS_MM,
    LINEAR_UP_TO_MPA,
    MODULUS_MPA,
    PRELOADS_N,
    RHO,
    SKIN,
    THICKNESS_MM,
    preload_at_peak_pressure,
    press,
)
from tablegen import linear_layer
from underskin.physics import charge_response
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SHOWN_HZ = (1.0, 150.0)
_FIGURE_9 = (2.0, 10.0)  # force [N] and radius of the sphere [mm]
_OFF_CENTRE_MM = 0.5
_SHOWN_MM = 10.0
_LEVELS_MM = np.arange(1, 13) * 5e-3


def displacement(figure: Figure, table: SigmaTable) -> None:
    """Figure 9: total displacement of the block, 40 × 20 × 2.5 mm, under 2 N by a sphere of 10 mm."""
    along, across, up, total, contact_mm = displacement_mm(table)
    x, y = _mirrored(along), _mirrored(across)
    surface, section = total[:, :, -1], total[:, 0, :]
    top, side = figure.subplots(1, 2)
    shown = top.contourf(x, y, _both_ways(_both_ways(surface).T), _LEVELS_MM, extend="min")
    top.plot(*_circle(contact_mm), "w-", linewidth=1)
    top.set(title="surface", xlabel="x, mm", ylabel="y, mm")
    side.contourf(x, up, _both_ways(section).T, _LEVELS_MM, extend="min")
    side.set(title="section y = 0", xlabel="x, mm", ylabel="z, mm")
    for axes in (top, side):
        axes.set(xlim=(-_SHOWN_MM, _SHOWN_MM), aspect="equal")
        axes.grid(visible=False)
    figure.colorbar(shown, ax=[top, side], shrink=0.8, label="total displacement, mm")


def displacement_mm(table: SigmaTable) -> tuple[Floats, Floats, Floats, Floats, float]:
    """Grid x, y, z [mm] of a quarter of the block, the total displacement there (x, y, z) [mm], and a [mm]."""
    force, sphere = _FIGURE_9
    pressed = press(table, sphere, [force])
    length, width = block_question.LENGTH_MM / THICKNESS_MM, block_question.WIDTH_MM / THICKNESS_MM
    near = np.linspace(0, 2, 33)
    grid = (
        np.append(near, np.linspace(2, length / 2, 25)[1:]),
        np.append(near, np.linspace(2, width / 2, 13)[1:]),
        np.linspace(0, 1, 21),
    )
    field = displacements(FiniteBlock(length, width, 1.0), float(pressed.a_over_h[0]), grid)
    unit = force / (float(SKIN.youngs_modulus) / 3 * float(SKIN.thickness)) * 1e3  # F/(Gh) [mm]
    x, y, z = (THICKNESS_MM * values for values in grid)
    return x, y, z, unit * np.sqrt((field**2).sum(axis=0)), float(pressed.contact_radius_mm[0])


def stress_strain(figure: Figure, _: SigmaTable) -> None:
    """Figure 13: the compressed cylinder; a stuck one of lower modulus looks alike."""
    strain = np.linspace(0, 0.2, 61)
    axes = figure.subplots()
    axes.plot(100 * strain, MODULUS_MPA * strain, "k--", label=f"slope {MODULUS_MPA:g} MPa, as the paper states")
    axes.plot(100 * strain, MODULUS_MPA * neo_hookean(strain), "C0-", label=f"neo-Hookean, E = {MODULUS_MPA:g} MPa")
    lower = MODULUS_MPA / cylinder.stiffness_ratio(CYLINDER_HEIGHT_MM, CYLINDER_DIAMETER_MM)
    free = f"its elastomer, had the ends stuck: E = {lower:.1f} MPa"
    axes.plot(100 * strain, lower * neo_hookean(strain), "C1-", label=free)
    axes.axhline(LINEAR_UP_TO_MPA, color="0.6", linewidth=1, label="non-linear above, as the paper states")
    _label(axes, "cylinder of 4 mm diameter and 2.5 mm height", "nominal strain, %", "nominal stress, MPa")


def neo_hookean(strain: Floats) -> Floats:
    """Nominal compressive stress over E of an incompressible neo-Hookean cylinder that slips: (λ^(−2) − λ)/3."""
    stretch = 1 - strain
    return np.asarray((stretch**-2 - stretch) / 3)


def frf_over_frequency(figure: Figure, table: SigmaTable) -> None:
    """Figure 14: real and imaginary part from 1 to 150 Hz."""
    frequency = np.linspace(*_SHOWN_HZ, 61)
    for axes, radius in zip(figure.subplots(1, 2, sharey=True), INDENTERS_MM, strict=True):
        for preload in (PRELOADS_N[0], PRELOADS_N[-1]):
            value = frf_pc_per_n(press(table, radius, [preload]).table)[0]
            axes.plot(frequency, np.full_like(frequency, value), label=f"Re, {preload:g} N")
        axes.plot(frequency, np.zeros_like(frequency), "k--", label="Im of the model")
        axes.axhspan(-0.1 * value, 0.1 * value, color="C3", alpha=0.15, linewidth=0, label="|Im|, as the paper states")
        axes.axvspan(_SHOWN_HZ[0], FLAT_UP_TO_HZ, color="0.93", zorder=0)
        _label(axes, f"R = {radius:g} mm, d33 = {BEST_FIT_D33_PC_PER_N:g} pC/N", "frequency, Hz", "FRF, pC/N")


def frf_over_preload(figure: Figure, table: SigmaTable) -> None:
    """Figure 15: the two spheres."""
    preload = np.linspace(PRELOADS_N[0], PRELOADS_N[-1], 51)
    for axes, radius in zip(figure.subplots(1, 2, sharey=True), INDENTERS_MM, strict=True):
        pressed = press(table, radius, preload)
        models = (("layer", pressed.table, "-"), ("linear layer", pressed.linear, "--"))
        for name, sigma, line in (*models, ("half space", pressed.half_space, ":")):
            axes.plot(preload, frf_pc_per_n(sigma), line, color="C0", label=name)
        reached = preload_at_peak_pressure(radius, LINEAR_UP_TO_MPA)
        if reached < PRELOADS_N[-1]:
            axes.axvspan(reached, PRELOADS_N[-1], color="0.9", zorder=0, label=f"q0 > {LINEAR_UP_TO_MPA:g} MPa")
        _label(axes, f"R = {radius:g} mm, d33 = {BEST_FIT_D33_PC_PER_N:g} pC/N", "preload, N", "FRF, pC/N")


def array(figure: Figure, table: SigmaTable) -> None:
    """Figure 16: the model's two lines, and how far below them a force half a millimetre off centre lies."""
    axes, sensors = figure.subplots(), 0
    for number, (count, preload, d33) in enumerate(ARRAY):
        pressed = press(table, INDENTERS_MM[0], [preload])
        centred = float(frf_pc_per_n(pressed.table, d33)[0])
        lower = centred * off_centre(float(pressed.a_over_h[0]), _OFF_CENTRE_MM)
        span, colour = np.array([sensors, sensors + count]), f"C{number}"
        axes.plot(span, [centred, centred], ":", color=colour, label=f"{count} sensors, {preload:g} N: {d33:g} pC/N")
        axes.fill_between(span, lower, centred, color=colour, alpha=0.2, linewidth=0)
        sensors += count
    _label(axes, f"shaded: a force up to {_OFF_CENTRE_MM:g} mm off centre", "sensors, one after the other", "FRF, pC/N")
    axes.set_ylim(bottom=0)


def off_centre(a_over_h: float, offset_mm: float) -> float:
    """σ of a force off the sensor's centre over σ of a centred one, by the linear layer, at the prototype's ρ."""
    offset = offset_mm / THICKNESS_MM
    return float(linear_layer.sigma(a_over_h, RHO, offset) / linear_layer.sigma(a_over_h, RHO))


def mark_prototype(axes: Axes, table: SigmaTable) -> None:
    """The prototype's own contacts: what L adds to σ there [%]."""
    for radius in INDENTERS_MM:
        pressed = press(table, radius, PRELOADS_N)
        axes.plot(
            pressed.a_over_h, 100 * (pressed.table / pressed.linear - 1), "ks-", markersize=3,
            markerfacecolor="k" if radius == INDENTERS_MM[0] else "w", label=f"R = {radius:g} mm, 0.5 to 3 N",
        )  # fmt: skip


def frf_pc_per_n(sigma: Floats, d33_pc_per_n: float = BEST_FIT_D33_PC_PER_N) -> Floats:
    """FRF = d33 (3/2) ρ² σ of the prototype."""
    return d33_pc_per_n * charge_response.gain(sigma, RHO)


def _mirrored(half: Floats) -> Floats:
    return np.concatenate([-half[:0:-1], half])


def _both_ways(half: Floats) -> Floats:
    """A quantity over 0 … x on its first axis, over −x … x."""
    return np.concatenate([half[:0:-1], half])


def _circle(radius: float) -> tuple[Floats, Floats]:
    angle = np.linspace(0, 2 * np.pi, 73)
    return radius * np.cos(angle), radius * np.sin(angle)


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.margins(x=0)
    axes.legend()
