"""The figures of one campaign, from its inversion, and a page that shows them without network or server."""

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment, PackageLoader, StrictUndefined

from underskin.diagnosis.reporting.page_styles import SCHEME
from underskin.figures.array import frf_versus_preload, response_per_sensor
from underskin.figures.array_map import array_map
from underskin.inversion.invert import Inversion
from underskin.physics.charge_response import gain
from underskin.recordings.campaign import Campaign
from underskin.units import Floats, to_lab


def figures(campaign: Campaign, inversion: Inversion) -> tuple[go.Figure, go.Figure, go.Figure]:
    """The map of the array, FRF against preload per indenter, and the response of each sensor.

    The model's line is the array's d33 times (3/2) ρ² σ, with σ at the commanded offset, averaged over the recordings
    of the same sphere and preload.
    """
    names, sensors, array = inversion.sensor_ids, inversion.sensors, inversion.campaign_d33
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    x_mm, y_mm = zip(*(positions[name] for name in names), strict=True)
    reasons = ["; ".join(flag.reason for flag in inversion.flags if flag.sensor == name) for name in names]
    d33, uncertainty, low, high = (
        to_lab("d33_pc_per_n", part) for part in (sensors.value, sensors.uncertainty, sensors.low, sensors.high)
    )
    limits = None
    if array is not None:
        limits = (float(to_lab("d33_pc_per_n", array.low)), float(to_lab("d33_pc_per_n", array.high)))
    rows = inversion.recordings
    return (
        array_map(names, x_mm, y_mm, d33, uncertainty, reasons, sensor_radius_mm=campaign.skin.sensor_radius_mm),
        frf_versus_preload(
            [f"{name}, sensor {names[sensor]}" for name, sensor in zip(rows.ids, rows.sensor, strict=True)],
            to_lab("indenter_radius_mm", rows.indenter_radius),
            to_lab("preload_n", rows.preload),
            to_lab("frf_pc_per_n", rows.frf),
            to_lab("frf_pc_per_n", rows.frf_uncertainty),
            to_lab("frf_pc_per_n", model_frf(campaign, inversion)),
        ),
        response_per_sensor(names, d33, low, high, limits, reasons),
    )


def page(campaign: Campaign, inversion: Inversion) -> str:
    """An HTML page with the figures one below the other; it contains plotly's script once."""
    environment = Environment(loader=PackageLoader("underskin.figures"), autoescape=True, undefined=StrictUndefined)
    parts = [
        figure.to_html(full_html=False, include_plotlyjs=number == 0, div_id=f"figure-{number}")
        for number, figure in enumerate(figures(campaign, inversion))
    ]
    zone = inversion.zone
    return environment.get_template("campaign.html").render(
        title=campaign.name,
        band=f"{zone.low_hz:.4g} to {zone.high_hz:.4g} Hz" if zone.chosen_by_user else zone.reason,
        notes=[*inversion.findings, *inversion.left_out],
        figures=parts,
        scheme=SCHEME.read_text("utf-8"),
    )


def model_frf(campaign: Campaign, inversion: Inversion) -> Floats:
    """FRF of the model [C/N] for each recording; NaN where the array has no d33."""
    rows = inversion.recordings
    assert campaign.skin.sensor_radius_mm is not None
    assert campaign.skin.thickness_mm is not None
    rho = campaign.skin.sensor_radius_mm / campaign.skin.thickness_mm
    inside = rows.inside
    count = np.bincount(rows.condition, inside)
    with np.errstate(invalid="ignore"):
        sigma = np.bincount(rows.condition, np.where(inside, rows.sigma, 0.0)) / count
    d33 = np.nan if inversion.campaign_d33 is None else float(inversion.campaign_d33.value)
    return d33 * gain(sigma[rows.condition], rho)
