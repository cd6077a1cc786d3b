"""The stress in the layer under a sphere: a section through its depth and the base from above, and frames for a growing
load."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.colors import sample_colorscale

from underskin.diagnosis.reporting.page_styles import BOUND
from underskin.figures.style import COLOURS, styled
from underskin.prediction.stress_field import StressField
from underskin.units import Floats, to_lab

SENSOR, CONTACT, SPHERE = COLOURS[1], COLOURS[3], "#55626f"
_AROUND_CONTACT, _AROUND_SENSOR, _LEAST = 1.0, 0.5, 2.0  # thicknesses that are drawn to each side of the axis
_ABOVE = 1.0  # thicknesses above the surface
_GRID = 41  # points each way, of the base from above
_DIGITS = 4
_HEIGHT = 470  # pixels
_STEPS = 24  # of the colours' scale


def stress_section(field: StressField, row: int) -> go.Figure:
    """Compression (−σ_zz) in the plane through the axis, at the force of `row`; the colours' scale is that of the
    largest force."""
    heat, contact, sphere = _section(field, row)
    depth = to_lab("depth_mm", field.depth)
    h, sensor = float(depth[-1]), _sensor(field)
    figure = go.Figure(_heatmap({**heat, "y": depth}, "depth", _largest(field, 0), power=2.0))
    figure.add_scatter(**contact, name="contact", line={"color": CONTACT, "width": 5})
    figure.add_scatter(**sphere, name="sphere", line={"color": SPHERE, "width": 2})
    figure.add_scatter(x=[-sensor, sensor], y=[h, h], name="sensor", line={"color": SENSOR, "width": 5})
    figure.update_yaxes(title="depth [mm]", range=[1.05 * h, -_ABOVE * h])
    return _equal(styled(figure, "Section through the layer", _HEIGHT), _half_width(field))


def stress_on_base(field: StressField, row: int) -> go.Figure:
    """Compression (−σ_zz) on the base from above, at the force of `row`; the colours' scale is that of the largest
    force."""
    heat, contact = _base(field, row)
    half = _half_width(field)
    figure = go.Figure(_heatmap({**heat, "y": heat["x"]}, "y", _largest(field, -1), power=1.0))
    figure.add_scatter(**contact, name="contact", line={"color": CONTACT, "width": 2, "dash": BOUND})
    figure.add_scatter(**_circle(_sensor(field)), name="sensor", line={"color": SENSOR, "width": 3})
    figure.update_yaxes(title="y [mm]", range=[-half, half])
    return _equal(styled(figure, "The base from above", _HEIGHT), half)


def frames(field: StressField, row: int) -> dict[str, Sequence[dict[str, Any]]]:
    """The changes in the traces of `section` and `base`, in their order, for the force of `row`."""
    heat, contact, sphere = _section(field, row)
    on_base, edge = _base(field, row)
    return {"section": [{"z": heat["z"]}, contact, sphere], "base": [{"z": on_base["z"]}, edge]}


def _section(field: StressField, row: int) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """The compression, the contact and the sphere, mirrored about the axis."""
    r = to_lab("r_mm", field.r)
    drawn = r <= _half_width(field) * (1 + 1e-9)
    x, stress = r[drawn], to_lab("sigma_zz_mpa", -field.sigma_zz[row][:, drawn])
    heat = {"x": np.append(-x[:0:-1], x), "z": _rounded(np.hstack([stress[:, :0:-1], stress]))}
    a, h = float(to_lab("contact_radius_mm", field.contact.contact_radius[row])), float(to_lab("r_mm", field.depth[-1]))
    sphere = float(to_lab("indenter_radius_mm", field.indenter_radius))
    top = max(a, min(sphere, float(np.sqrt(a**2 + 2 * sphere * _ABOVE * h))))
    outline = np.linspace(a, top, 30)
    height = np.sqrt(np.clip(sphere**2 - outline**2, 0, None)) - np.sqrt(max(sphere**2 - a**2, 0.0))
    side = {
        "x": [*_rounded(-outline[::-1]), None, *_rounded(outline)],
        "y": [*_rounded(height[::-1]), None, *_rounded(height)],
    }
    return heat, {"x": [-a, a], "y": [0.0, 0.0]}, side


def _base(field: StressField, row: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """The compression and the edge of the contact."""
    x = np.linspace(-1.0, 1.0, _GRID) * _half_width(field)
    distance = np.hypot(x[:, None], x)
    stress = np.interp(distance, to_lab("r_mm", field.r), to_lab("sigma_zz_mpa", -field.sigma_zz[row, -1]))
    edge = _circle(float(to_lab("contact_radius_mm", field.contact.contact_radius[row])))
    return {"x": x, "z": _rounded(stress)}, edge


def _largest(field: StressField, depth: int) -> float:
    """The largest compression at a depth, of all forces [MPa]."""
    return float(np.nanmax(to_lab("sigma_zz_mpa", -field.sigma_zz[:, depth])))


def _heatmap(heat: dict[str, Any], along: str, largest: float, power: float) -> go.Heatmap:
    """Compression in colours; with a power of 2 they follow its square root, so that stress below a small contact is
    visible."""
    shade = np.linspace(0.0, 1.0, _STEPS + 1)
    colours = sample_colorscale("Cividis", shade.tolist())
    return go.Heatmap(
        **heat,
        hovertemplate=f"x %{{x:.3g}} mm, {along} %{{y:.3g}} mm<br>compression %{{z:.4g}} MPa",
        zmin=0.0,
        zmax=largest,
        zsmooth="best",
        colorscale=[[float(part**power), colour] for part, colour in zip(shade, colours, strict=True)],
        colorbar={
            "title": {"text": "compression −σ<sub>zz</sub> [MPa]", "side": "top"},
            "orientation": "h",
            "y": -0.2,
            "yanchor": "top",
            "thickness": 14,
        },
    )


def _half_width(field: StressField) -> float:
    """[mm]"""
    inside = field.contact.a_over_h[field.contact.inside]
    widest = max(_LEAST, float(inside.max()) + _AROUND_CONTACT, float(field.contact.rt_over_h[0]) + _AROUND_SENSOR)
    return widest * float(to_lab("depth_mm", field.depth[-1]))


def _sensor(field: StressField) -> float:
    """[mm]"""
    return float(field.contact.rt_over_h[0]) * float(to_lab("depth_mm", field.depth[-1]))


def _circle(radius: float) -> dict[str, Any]:
    angle = np.linspace(0, 2 * np.pi, 65)
    return {"x": _rounded(radius * np.cos(angle)), "y": _rounded(radius * np.sin(angle))}


def _equal(figure: go.Figure, half: float) -> go.Figure:
    """Equal scales of both axes, this far to each side, and the colour bar below."""
    figure.update_traces(mode="lines", hoverinfo="skip", selector={"type": "scatter"})
    figure.update_xaxes(title="x [mm]", range=[-half, half], constrain="domain", showgrid=False, zeroline=False)
    figure.update_layout(margin={"l": 60, "r": 10, "b": 115})
    return figure.update_yaxes(scaleanchor="x", scaleratio=1, constrain="domain", showgrid=False, zeroline=False)


def _rounded(values: Floats) -> Any:
    """Lists, rounded to a number of digits of the largest value."""
    largest = float(np.abs(values).max())
    digits = _DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0 else 0
    return (0.0 + np.round(values, digits)).tolist()
