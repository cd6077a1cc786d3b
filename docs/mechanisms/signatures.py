"""The effect of each mechanism on the recordings, over the axes on which it is visible: the panels of its figure.

A soft skin (h 2.5 mm, rT 1.5 mm, E 2 MPa) under spheres of 4 and 10 mm; each parameter at its stated value, or at a
typical strength. The mechanism names the axes of its figure.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.mechanisms import CATALOGUE, Kind, Mechanism, Model, Parameter, compose
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    FrfRecording,
    IndentationRecording,
    Sensor,
    SkinDescription,
)
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

SPHERES_MM = (4.0, 10.0)
PRELOADS_N = (0.5, 3.0)
_SKIN = SkinDescription(
    poisson_ratio=0.5,
    thickness_mm=2.5,
    youngs_modulus_mpa=2.0,
    sensor_radius_mm=1.5,
    sensors=tuple(Sensor(f"s{number}", 5.0 * number, 0.0) for number in range(8)),
)


@dataclass(frozen=True)
class Panel:
    """Curves over one axis; `logarithmic` says how the axis is drawn."""

    axis: str
    unit: str
    curves: dict[str, tuple[Floats, Floats]]
    logarithmic: bool = False


_AXES = {  # of figures, where they are not the first two on which the mechanism shows
    "compressible_layer": ("preload_n", "position_mm"),
    "contact_creep": ("dwell_s", "time_s"),
    "crosstalk": ("position_mm",),
    "interface_slip": ("preload_n", "position_mm"),
    "layered_contact": ("preload_n", "force_n"),
    "mains_pickup": ("mains",),
    "misalignment": ("preload_n", "position_mm"),
    "platen_friction": ("displacement_mm",),
    "strain_stiffening": ("preload_n", "displacement_mm"),
    "timing_delay": ("phase",),
}


def panels(name: str, table: SigmaTable) -> list[Panel]:
    """The panels of one mechanism."""
    return [PANELS[axis][1](name, table) for axis in axes(CATALOGUE[name])]


def axes(mechanism: Mechanism) -> tuple[str, ...]:
    """The axes of its figure: those that it names, else the first two on which it shows and that have a panel."""
    usual = [axis for axis in mechanism.axes if axis in PANELS and PANELS[axis][0] in mechanism.kinds]
    return _AXES.get(mechanism.name) or tuple(usual[:2])


def shown(parameter: Parameter) -> float:
    """The value at which a figure has it, in its unit."""
    return parameter.from_fit(parameter.typical) if parameter.shown is None else parameter.shown


def _recording(number: int, **changes: Any) -> FrfRecording:
    frequency = np.array([30.0])
    plain = FrfRecording(
        f"r{number}",
        "s0",
        indenter_radius_mm=4.0,
        preload_n=1.0,
        dynamic_force_n=0.09,
        load_cycles=number,
        dwell_s=float(number),
        frequency_hz=frequency,
        frf_re_pc_per_n=np.ones(1),
        frf_im_pc_per_n=np.zeros(1),
    )
    return replace(plain, **changes)


def _fit(model: Model, base: Model) -> Floats:
    """The mechanism's own parameters, which come first, as shown; those of the base model at their priors' centres."""
    count_of_effect = len(model.parameters) - len(base.parameters)
    values = [parameter.to_fit(shown(parameter)) for parameter in model.parameters[:count_of_effect]]
    return np.array([*values, *(parameter.start for parameter in base.parameters)])


def _ratio(name: str, recordings: Sequence[FrfRecording], table: SigmaTable) -> Floats:
    campaign = Campaign("signature", _SKIN, tuple(recordings))
    with_it, base = compose([name], campaign, table), compose([], campaign, table)
    value = with_it.predict(_fit(with_it, base)).value / base.predict(_fit(base, base)).value
    return np.asarray(value)


def _percent(name: str, recordings: Sequence[FrfRecording], table: SigmaTable) -> Floats:
    return 100 * (_ratio(name, recordings, table).real - 1)


def _over_preload(name: str, table: SigmaTable) -> Panel:
    preload = np.geomspace(0.1, 3.0, 40)
    curves = {}
    for sphere in SPHERES_MM:
        rows = [_recording(i, preload_n=float(f), indenter_radius_mm=sphere) for i, f in enumerate(preload)]
        curves[f"R = {sphere:g} mm"] = preload, _percent(name, rows, table)
    return Panel("preload, N", "change of FRF, %", curves, logarithmic=True)


def _over_position(name: str, table: SigmaTable) -> Panel:
    """The FRF itself, since it nearly vanishes where the sphere is far."""
    offset = np.linspace(-2.5, 4.5, 71)
    rows = [_recording(i, position_mm=(float(x), 0.0)) for i, x in enumerate(offset)]
    campaign = Campaign("signature", _SKIN, tuple(rows))
    with_it, base = compose([name], campaign, table), compose([], campaign, table)
    response = with_it.predict(_fit(with_it, base)).value.real * 1e12
    usual = base.predict(_fit(base, base)).value.real * 1e12
    return Panel("position of the sphere, mm", "FRF, pC/N", {"base": (offset, usual), name: (offset, response)})


def _over_dwell(name: str, table: SigmaTable) -> Panel:
    dwell = np.geomspace(1, 1000, 40)
    curves = {}
    for preload in PRELOADS_N:
        rows = [_recording(i, preload_n=preload, dwell_s=float(t)) for i, t in enumerate(dwell)]
        curves[f"{preload:g} N"] = dwell, _percent(name, rows, table)
    return Panel("dwell, s", "change of FRF, %", curves, logarithmic=True)


def _over_cycles(name: str, table: SigmaTable) -> Panel:
    cycles = np.geomspace(10, 1e5, 40)
    rows = [_recording(i, load_cycles=int(n)) for i, n in enumerate(cycles)]
    return Panel("load cycles", "change of FRF, %", {"": (cycles, _percent(name, rows, table))}, logarithmic=True)


def _over_amplitude(name: str, table: SigmaTable) -> Panel:
    amplitude = np.linspace(0.02, 0.95, 40)
    curves = {}
    for sphere in SPHERES_MM:
        rows = [_recording(i, dynamic_force_n=float(a), indenter_radius_mm=sphere) for i, a in enumerate(amplitude)]
        curves[f"R = {sphere:g} mm"] = amplitude, _percent(name, rows, table)
    return Panel("dynamic force over preload", "change of FRF, %", curves)


def _over_sensors(name: str, table: SigmaTable) -> Panel:
    rows = [_recording(i, sensor=sensor.id) for i, sensor in enumerate(_SKIN.sensors)]
    campaign = Campaign("signature", _SKIN, tuple(rows))
    model = compose([name], campaign, table)
    fit = _fit(model, compose([], campaign, table))
    spread = next(
        parameter.from_fit(at)
        for parameter, at in zip(model.parameters, fit, strict=True)
        if parameter.name == "spread"
    )
    number = np.arange(1.0, len(rows) + 1)
    gains = np.random.default_rng(5).normal(0, spread, len(rows))
    band = 100 * np.expm1(np.full(len(rows), spread))
    curves = {"one draw": (number, 100 * np.expm1(gains)), "± one sd": (number, band), "": (number, -band)}
    return Panel("sensor", "change of FRF, %", curves)


def _swept(name: str, table: SigmaTable, of: Callable[[Floats], Floats], unit: str) -> Panel:
    frequency = np.geomspace(1, 1000, 300)
    curves = {}
    for preload in PRELOADS_N:
        line = _recording(
            0, preload_n=preload, frequency_hz=frequency, frf_re_pc_per_n=np.ones(300), frf_im_pc_per_n=np.zeros(300)
        )
        curves[f"{preload:g} N"] = frequency, of(_ratio(name, [line], table))
    return Panel("frequency, Hz", unit, curves, logarithmic=True)


def _over_frequency(name: str, table: SigmaTable) -> Panel:
    return _swept(name, table, np.abs, "|FRF| over base")


def _over_phase(name: str, table: SigmaTable) -> Panel:
    return _swept(name, table, lambda ratio: np.degrees(np.angle(ratio)), "phase, degrees")


def _pickup(name: str, table: SigmaTable) -> Panel:
    frequency = np.linspace(30, 320, 600)
    curves = {}
    for force in (0.05, 0.2):
        line = _recording(0, dynamic_force_n=force, frequency_hz=frequency, frf_re_pc_per_n=np.ones(600))
        campaign = Campaign("signature", _SKIN, (replace(line, frf_im_pc_per_n=np.zeros(600)),))
        model = compose([name], campaign, table)
        variance = model.predict(_fit(model, compose([], campaign, table))).pickup_variance
        curves[f"Fd = {force:g} N"] = frequency, 1e12 * np.sqrt(variance)
    return Panel("frequency, Hz", "sd of pick-up, pC/N", curves)


def _over_depth(name: str, table: SigmaTable) -> Panel:
    way = np.append(np.linspace(0, 0.4, 60), np.linspace(0.4, -0.05, 60))
    force = 4 / 3 * 2.0 / 0.75 * np.sqrt(4.0) * np.maximum(way, 0) ** 1.5
    recording = IndentationRecording("i", 4.0, way, force, time_s=np.arange(120.0))
    return _curve(name, Campaign("signature", _SKIN, (recording,)), table, "displacement, mm", way)


def _over_strain(name: str, table: SigmaTable) -> Panel:
    strain = np.tile(np.append(np.linspace(0, 0.4, 60), np.linspace(0.4, 0, 60)), 2)
    force = 2.0 * np.pi / 4 * 20.0**2 * strain
    recording = CompressionRecording("c", 10.0, 20.0, 10.0 * strain, force, time_s=np.arange(240.0))
    return _curve(name, Campaign("signature", _SKIN, (recording,)), table, "strain of a 20 mm × 10 mm cylinder", strain)


def _curve(name: str, campaign: Campaign, table: SigmaTable, axis: str, way: Floats) -> Panel:
    with_it, base = compose([name], campaign, table), compose([], campaign, table)
    curves = {
        "base": (way, base.predict(_fit(base, base)).value),
        name: (way, with_it.predict(_fit(with_it, base)).value),
    }
    return Panel(axis, "force, N", curves)


MakePanel = Callable[[str, SigmaTable], Panel]
PANELS: dict[str, tuple[Kind, MakePanel]] = {  # by axis
    "preload_n": ("frf", _over_preload),
    "position_mm": ("frf", _over_position),
    "dwell_s": ("frf", _over_dwell),
    "load_cycles": ("frf", _over_cycles),
    "dynamic_force_n": ("frf", _over_amplitude),
    "sensor": ("frf", _over_sensors),
    "frequency_hz": ("frf", _over_frequency),
    "phase": ("frf", _over_phase),
    "mains": ("frf", _pickup),
    "force_n": ("indentation", _over_depth),
    "time_s": ("indentation", _over_depth),
    "displacement_mm": ("compression", _over_strain),
}
