"""Predictions for conditions alone: values, derivatives, and the same for a campaign as for its conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.support.mechanism_campaigns import (
    SKIN,
    compression_campaign,
    frf_campaign,
    hertz_force,
    indentation_campaign,
    table,
)
from underskin import Conditions, InvalidInput, SkinDescription, frf_conditions, predict
from underskin.mechanisms import compose
from underskin.recordings.campaign import (
    Campaign,
    CompressionConditions,
    FrfConditions,
    FrfRecording,
    IndentationConditions,
    Recording,
)
from underskin.units import Floats

DEPTH_MM = np.linspace(0.0, 0.3, 7)
COMBINED = {
    "relaxed_fraction": 0.3,
    "relaxation_time": 40.0,
    "mobile_fraction": 0.6,
    "fraction": 0.1,
    "loss": 0.2,
    "onset": 1000.0,
    "saturation": 0.5,
    "delay": 200.0,
    "d33": 14.0,
}
MECHANISMS = ("contact_creep", "moving_contact_edge", "crosstalk", "ageing", "timing_delay")


def rows(*, sensor: str | None = None, **further: ArrayLike) -> Conditions:
    lines = [30.0, 100.0]
    return frf_conditions(
        SKIN, sensor=sensor, indenter_radius_mm=4.0, preload_n=[0.5, 1.0, 2.0], frequency_hz=lines, **further
    )


def curve(skin: SkinDescription = SKIN) -> Conditions:
    return Conditions("curve", skin, (IndentationConditions("i", 4.0, DEPTH_MM),))


def test_a_campaign_and_its_conditions_alone_are_predicted_alike() -> None:
    campaign = frf_campaign()
    alone = Conditions("alone", campaign.skin, tuple(entry.without_measurements() for entry in frf_entries(campaign)))
    assert not any(isinstance(entry, FrfRecording) for entry in alone.recordings)
    of_campaign, of_conditions = (
        predict(entry, table(), COMBINED, mechanisms=MECHANISMS) for entry in (campaign, alone)
    )
    np.testing.assert_array_equal(of_campaign.value, of_conditions.value)
    assert of_campaign.derivatives.keys() == of_conditions.derivatives.keys()


def frf_entries(campaign: Conditions) -> list[FrfConditions]:
    return [entry for entry in campaign.recordings if isinstance(entry, FrfConditions)]


def test_it_is_what_a_fit_composes() -> None:
    campaign = frf_campaign()
    model = compose(MECHANISMS, campaign, table())
    fit = np.array([entry.to_fit(COMBINED.get(entry.name, 1.0)) for entry in model.parameters])
    expected = 1e12 * model.predict(fit).value
    np.testing.assert_allclose(predict(campaign, table(), COMBINED, mechanisms=MECHANISMS).value, expected, rtol=1e-14)


def test_derivatives_are_by_the_parameters_in_their_units() -> None:
    conditions = rows(dwell_s=[2.0, 60.0, 600.0], load_cycles=[0.0, 300.0, 900.0], dynamic_force_n=0.1)
    derivatives = predict(conditions, table(), COMBINED, mechanisms=MECHANISMS).derivatives
    for name, value in COMBINED.items():
        step = 1e-4 * value
        high, low = (
            predict(conditions, table(), {**COMBINED, name: value + way}, mechanisms=MECHANISMS).value
            for way in (step, -step)
        )
        np.testing.assert_allclose(derivatives[name], (high - low) / (2 * step), rtol=1e-5, atol=1e-9)


def test_single_numbers_hold_for_all_rows() -> None:
    conditions = rows(offset_x_mm=0.5, sensor="s2")
    first = conditions.recordings[0]
    assert isinstance(first, FrfConditions)
    assert (first.sensor, first.position_mm, len(conditions.recordings)) == ("s2", (4.5, 0.0), 3)
    predicted = predict(conditions, table(), {"d33": 14.0})
    assert predicted.recording.tolist() == [0, 0, 1, 1, 2, 2]
    assert predicted.inside.all()


def test_the_declared_d33_is_the_default() -> None:
    declared = replace(SKIN, d33_pc_per_n=14.0)
    own = frf_conditions(declared, indenter_radius_mm=4.0, preload_n=1.0, frequency_hz=30.0)
    given = frf_conditions(SKIN, indenter_radius_mm=4.0, preload_n=1.0, frequency_hz=30.0)
    assert predict(own, table()).value == predict(given, table(), {"d33": 14.0}).value


def test_a_skin_without_sensors_has_one_at_the_origin() -> None:
    bare = replace(SKIN, sensors=())
    conditions = frf_conditions(bare, indenter_radius_mm=4.0, preload_n=1.0, frequency_hz=30.0)
    assert [(sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors] == [(0.0, 0.0)]


def test_an_indentation_follows_hertz_from_displacement_zero() -> None:
    """Without finite strain; half of it, where nothing is said, makes the force up to 1.3 % less."""
    hertz = hertz_force(DEPTH_MM, 4.0, 2.0)
    linear = predict(curve(), table(), {"finite_strain": 0.0}).value
    np.testing.assert_allclose(linear, hertz, rtol=1e-6, atol=1e-9)
    half = predict(curve(), table()).value
    assert (half <= hertz).all()
    assert half[-1] > 0.98 * hertz[-1]


def test_a_compression_is_neo_hookean_from_displacement_zero() -> None:
    conditions = Conditions("block", SKIN, (CompressionConditions("c", 10.0, 20.0, DEPTH_MM),))
    stretch: Floats = 1.0 - DEPTH_MM / 10.0
    expected = 2.0 * np.pi / 4 * 20.0**2 * (stretch**-2 - stretch) / 3
    np.testing.assert_allclose(predict(conditions, table()).value, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("campaign", "linear"), [(indentation_campaign(), {"finite_strain": 0.0}), (compression_campaign(), {})]
)
def test_curves_measured_predicted_contact(campaign: Campaign, linear: dict[str, float]) -> None:
    """Curves that were measured are predicted from their own contact points."""
    late = replace(campaign, recordings=tuple(map(begun_late, campaign.recordings)))
    measured = np.concatenate([entry.force_n for entry in late.recordings if not isinstance(entry, FrfRecording)])
    np.testing.assert_allclose(predict(late, table(), linear).value, measured, rtol=1e-3, atol=1e-4 * measured.max())


def begun_late(entry: Recording) -> Recording:
    assert not isinstance(entry, FrfRecording)
    return replace(entry, displacement_mm=entry.displacement_mm + 0.1)


@pytest.mark.parametrize(
    ("parameters", "mechanisms", "field"),
    [
        ({}, (), "parameters.d33"),
        ({"d33": 14.0, "loss": 0.1}, (), "parameters"),
        ({"d33": 14.0}, ("moving_contact_edge",), "parameters.mobile_fraction"),
        ({"d33": 14.0, "mobile_fraction": 2.0}, ("moving_contact_edge",), "parameters.mobile_fraction"),
        ({"d33": float("nan")}, (), "parameters.d33"),
        ({"d33": 14.0}, ("contact_creep",), r"recordings[row 0].dwell_s"),
        ({"d33": 14.0}, ("platen_friction",), "mechanisms"),
        ({"d33": 14.0}, ("phlogiston",), "mechanisms"),
    ],
)
def test_what_cannot_be_predicted_is_refused(
    parameters: Mapping[str, float], mechanisms: Sequence[str], field: str
) -> None:
    with pytest.raises(InvalidInput) as refused:
        predict(rows(), table(), parameters, mechanisms=mechanisms)
    assert refused.value.field == field


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("preload_n", [1.0, -1.0]),
        ("preload_n", float("nan")),
        ("preload_n", []),
        ("preload_n", [[1.0]]),
        ("indenter_radius_mm", -4.0),
        ("frequency_hz", float("nan")),
        ("frequency_hz", -3.0),
        ("offset_x_mm", float("inf")),
        ("dynamic_force_n", -0.1),
        ("load_cycles", -1.0),
    ],
)
def test_values_that_no_recording_can_have_are_refused_by_their_column(column: str, values: ArrayLike) -> None:
    columns: dict[str, Any] = {"indenter_radius_mm": 4.0, "preload_n": 1.0, "frequency_hz": 30.0, column: values}
    with pytest.raises(InvalidInput) as refused:
        frf_conditions(SKIN, **columns)
    assert refused.value.field == column


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("youngs_modulus_mpa", -16.0),
        ("youngs_modulus_mpa", 0.0),
        ("thickness_mm", -2.5),
        ("thickness_mm", float("nan")),
        ("sensor_radius_mm", 0.0),
        ("poisson_ratio", 0.7),
    ],
)
def test_a_skin_that_cannot_be_is_refused_by_its_field(field: str, value: float) -> None:
    changed: dict[str, Any] = {field: value}
    skin = replace(SKIN, **changed)
    with pytest.raises(InvalidInput) as refused:
        frf_conditions(skin, indenter_radius_mm=4.0, preload_n=1.0, frequency_hz=30.0)
    assert refused.value.field == field
