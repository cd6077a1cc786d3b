"""An open question of the paper's cylinder: if it stuck to the platens, 16 MPa is not E; and the diagnosis of that
case."""

from dataclasses import dataclass
from typing import Any

import underskin
from docs.paper import cylinder
from docs.paper.markdown import percent, table
from docs.paper.prototype import (
    BEST_FIT_D33_PC_PER_N,
    CYLINDER_DIAMETER_MM,
    CYLINDER_HEIGHT_MM,
    INDENTERS_MM,
    LINEAR_UP_TO_MPA,
    MODULUS_MPA,
    PITCH_MM,
    PRELOADS_N,
    SENSOR_RADIUS_MM,
    THICKNESS_MM,
    preload_at_peak_pressure,
    press,
)
from rig.description import parse
from rig.elastomer import record_curves
from rig.joint_campaign import CurveSet, JointDocument
from rig.recorded import record_lines
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import SigmaTable

_TALL_MM = 8.0  # height of a second cylinder of the same diameter
_SEED = 1

_INTRODUCTION = """\
## What the paper leaves out: its cylinder may have stuck

The 16 MPa are the slope of nominal stress over strain of a cylinder of {diameter:g} mm diameter and {height:g} mm
height. That is E only where its ends slip on the platens. If they stick, the cylinder cannot widen there and looks
stiffer: {exact:.3f} times by finite elements (`docs/paper/cylinder.py`, incompressible, small strain) and
{approximate:.3f} times by Gent and Lindley's 1 + 2 S² with the shape factor S = {shape:g}, which the diagnosis uses
(`platen_friction`). E would then be {lower:.1f} MPa, or {lower_approximate:.1f} MPa by the approximation: about a
quarter lower. The paper does not say whether the platens were lubricated.

What follows for the prototype, if E is {lower:.1f} instead of {modulus:g} MPa:

"""

_DIAGNOSIS = """\

So the contact is a tenth wider, while σ and with it d33 hardly move: the paper's d33 stand, its contact radii and
peak pressures do not. Under R = 4 mm, q0 would reach 2 MPa only at {reaches:.1f} N instead of {reached:.1f} N, which
leaves less of the preloads at which the paper takes the elastomer's non-linearity for the cause.

**As the diagnosis reports it.** The virtual rig (`rig/`: {lower_approximate:.1f} MPa, stuck, d33 {d33:g} pC/N, two
spheres, four preloads, four sensors, 1 % scatter of gain) records the prototype's FRFs and compresses the paper's
cylinder three times; E is declared as {modulus:g} MPa. Then the same with a second cylinder, {tall:g} mm high.

"""

_CLOSE = """\

One cylinder cannot tell friction from modulus, and the interval of E says so; two heights can.
"""


@dataclass(frozen=True)
class Diagnosed:
    """The report on cylinders of some heights together with the FRFs."""

    heights_mm: tuple[float, ...]
    report: dict[str, Any]


def section(sigma_table: SigmaTable) -> str:
    """The whole section."""
    exact = cylinder.stiffness_ratio(CYLINDER_HEIGHT_MM, CYLINDER_DIAMETER_MM)
    approximate = cylinder.gent_lindley(CYLINDER_HEIGHT_MM, CYLINDER_DIAMETER_MM)
    numbers = {
        "diameter": CYLINDER_DIAMETER_MM,
        "height": CYLINDER_HEIGHT_MM,
        "exact": exact,
        "approximate": approximate,
        "shape": CYLINDER_DIAMETER_MM / (4 * CYLINDER_HEIGHT_MM),
        "lower": MODULUS_MPA / exact,
        "lower_approximate": MODULUS_MPA / approximate,
        "modulus": MODULUS_MPA,
    }
    return (
        _INTRODUCTION.format(**numbers)
        + _consequences(sigma_table, MODULUS_MPA / exact)
        + _DIAGNOSIS.format(
            **numbers,
            reaches=_preload_at_two_megapascals(MODULUS_MPA / exact),
            reached=_preload_at_two_megapascals(MODULUS_MPA),
            d33=BEST_FIT_D33_PC_PER_N,
            tall=_TALL_MM,
        )
        + _reported(
            [diagnosed(sigma_table, heights) for heights in ((CYLINDER_HEIGHT_MM,), (CYLINDER_HEIGHT_MM, _TALL_MM))]
        )
        + _CLOSE
    )


def diagnosed(sigma_table: SigmaTable, heights_mm: tuple[float, ...]) -> Diagnosed:
    """The report on the prototype's FRFs and stuck cylinders, of which E is declared as their slope."""
    approximate = cylinder.gent_lindley(CYLINDER_HEIGHT_MM, CYLINDER_DIAMETER_MM)
    skin = {
        "id": "prototype",
        "thickness_mm": THICKNESS_MM,
        "youngs_modulus_mpa": MODULUS_MPA,
        "sensor_radius_mm": SENSOR_RADIUS_MM,
        "d33_pc_per_n": BEST_FIT_D33_PC_PER_N,
    }
    common = {"schema": "experiment/1", "name": "prototype", "seed": _SEED}
    frfs = {
        **common,
        "skin": {**skin, "array": {"columns": 2, "rows": 2, "pitch_mm": PITCH_MM}},
        "design": {"indenters_mm": list(INDENTERS_MM), "preloads_n": list(PRELOADS_N), "dynamic_forces_n": [0.09]},
        "lines": {"low_hz": 1, "high_hz": 130, "count": 20},
        "noise": {"gain": 0.01, "line": 0.005, "averages": 16},
        "effects": {"modulus_error": {"factor": 1 / approximate}},
    }
    block = {
        **common,
        "kind": "compression",
        "skin": {**skin, "youngs_modulus_mpa": MODULUS_MPA / approximate},
        "curves": {
            "heights_mm": list(heights_mm),
            "diameters_mm": [CYLINDER_DIAMETER_MM],
            "largest_displacement_mm": 0.12 * CYLINDER_HEIGHT_MM,
            "speeds_mm_per_s": [1 / 6],  # the paper's 10 mm/min
            "samples": 120,
            "repeats": 3,
            "gain": 0.005,
            "force_noise_n": 0.05,
        },
        "effects": {"platen_friction": {"friction": 1.0}},
    }
    pressed = parse(block)
    joint = JointDocument(record_lines(parse(frfs)), CurveSet(pressed, tuple(record_curves(pressed))))
    campaign, _ = from_dict(joint.campaign())
    return Diagnosed(heights_mm, dict(underskin.diagnose(campaign, sigma_table)))


def _consequences(sigma_table: SigmaTable, lower_mpa: float) -> str:
    header = (
        "R, mm",
        "F, N",
        "a, mm",
        "a, stuck, mm",
        "σ",
        "σ, stuck",
        "d33 changes by, %",
        "q0, MPa",
        "q0, stuck, MPa",
    )
    rows = []
    for radius in INDENTERS_MM:
        stated = press(sigma_table, radius, PRELOADS_N)
        softer = press(sigma_table, radius, PRELOADS_N, youngs_modulus_mpa=lower_mpa)
        rows += [
            (
                f"{radius:g}",
                f"{preload:g}",
                f"{stated.contact_radius_mm[i]:.3f}",
                f"{softer.contact_radius_mm[i]:.3f}",
                f"{stated.table[i]:.4f}",
                f"{softer.table[i]:.4f}",
                f"{percent(stated.table[i], softer.table[i]):+.2f}",
                f"{stated.peak_pressure_mpa[i]:.2f}",
                f"{softer.peak_pressure_mpa[i]:.2f}",
            )
            for i, preload in enumerate(PRELOADS_N)
        ]
    return table(header, rows)


def _preload_at_two_megapascals(modulus_mpa: float) -> float:
    """Under the small sphere; q0³ grows like F E²."""
    return preload_at_peak_pressure(INDENTERS_MM[0], LINEAR_UP_TO_MPA) * (MODULUS_MPA / modulus_mpa) ** 2


def _reported(reports: list[Diagnosed]) -> str:
    header = ("cylinders, height mm", "verdict", "E of the cylinders, MPa", "friction", "d33, pC/N", "quotable")
    return table(header, [_row(report) for report in reports])


def _row(result: Diagnosed) -> tuple[str, ...]:
    report = result.report
    (modulus,) = (
        fitted
        for fitted in report["by_kind"]
        if fitted["parameter"] == "youngs_modulus" and fitted["kind"] == "compression"
    )
    frictions = [
        f"{parameter['low']:.2f} to {parameter['high']:.2f}"
        for mechanism in report["mechanisms"] if mechanism["name"] == "platen_friction"
        for parameter in mechanism["parameters"]
    ]  # fmt: skip
    d33 = report["d33"]
    return (
        " and ".join(f"{height:g}" for height in result.heights_mm),
        f"`{report['verdict']}`"
        + (": " + ", ".join(f"`{named['name']}`" for named in report["mechanisms"]) if report["mechanisms"] else ""),
        f"{modulus['value']:.1f} ({modulus['low']:.1f} to {modulus['high']:.1f})",
        *(frictions or ["not told"]),
        f"{d33['value']:.1f} ({d33['low']:.1f} to {d33['high']:.1f})",
        "yes" if d33["quotable"] else "no",
    )
