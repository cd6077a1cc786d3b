"""An explained report as a model: the composed mechanisms at its values, and campaigns translated to the base model."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.mechanism_campaigns import SKIN, frf_campaign, table
from underskin import InvalidInput
from underskin.mechanisms import CATALOGUE, compose
from underskin.prediction.adopted_model import AdoptedModel, adopted
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings

D33 = 14.0
VALUES = {
    "contact_creep": (0.3, 40.0),
    "moving_contact_edge": (0.6,),
    "crosstalk": (0.1,),
    "ageing": (0.2, 1000.0, 0.5),
    "timing_delay": (200.0,),
    "sensor_spread": (0.1,),
}


def report(values: dict[str, tuple[float, ...]], **changes: Any) -> dict[str, Any]:
    mechanisms = []
    for name, found in values.items():
        parameters = CATALOGUE[name].parameters(frf_campaign())
        mechanisms.append(
            {
                "name": name,
                "parameters": [
                    {"name": entry.name, "value": value} for entry, value in zip(parameters, found, strict=True)
                ],
            }
        )
    d33 = {"low": 0.9 * D33, "high": 1.1 * D33}
    return {"verdict": "explained", "mechanisms": mechanisms, "d33": d33, **changes}


def recorded(values: dict[str, tuple[float, ...]]) -> Campaign:
    """The campaign as these mechanisms make it, without noise."""
    campaign = frf_campaign()
    model = compose(tuple(values), campaign, table())
    ordered = [value for name in model.names for value in values[name]]
    fit = [
        parameter.to_fit(value) for parameter, value in zip(model.parameters, [*ordered, D33, 1.0, 1.0], strict=True)
    ]
    rows = np.split(1e12 * model.predict(np.array(fit)).value, len(campaign.recordings))
    entries = zip(frf_recordings(campaign), rows, strict=True)
    return replace(
        campaign,
        recordings=tuple(replace(entry, frf_re_pc_per_n=row.real, frf_im_pc_per_n=row.imag) for entry, row in entries),
    )


def lines(campaign: Campaign) -> Any:
    return np.concatenate(
        [
            entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n  # type: ignore[operator]
            for entry in frf_recordings(campaign)
        ]
    )


def test_a_response_times_d33_is_what_the_mechanisms_record() -> None:
    campaign = recorded(VALUES)
    found = adopted(report(VALUES), campaign).response(campaign, table())
    np.testing.assert_allclose(D33 * found.value, lines(campaign), rtol=1e-12)
    assert found.inside.all()


def test_what_the_mechanisms_record_is_translated_to_what_the_base_model_would() -> None:
    campaign = recorded(VALUES)
    translated, left_out = adopted(report(VALUES), campaign).as_base_model(campaign, table())
    assert left_out == []
    np.testing.assert_allclose(lines(translated), lines(recorded({})), rtol=1e-12)


def test_a_level_leaves_out_what_acts_line_by_line() -> None:
    campaign = recorded(VALUES)
    without = {name: values for name, values in VALUES.items() if name != "timing_delay"}
    model = adopted(report(VALUES), campaign)
    level = model.response(campaign, table(), level=True)
    flat = adopted(report(without), campaign).response(campaign, table())
    np.testing.assert_allclose(level.value[flat.recording], flat.value, rtol=1e-12)
    assert np.abs(level.value.imag).max() == 0
    assert model.of_lines == ["timing_delay"]
    assert model.needs == {"dwell_s": "contact_creep", "sensor": "crosstalk", "load_cycles": "ageing"}


def test_a_recording_that_lacks_what_a_mechanism_needs_is_named() -> None:
    campaign = recorded(VALUES)
    first, *others = frf_recordings(campaign)
    lacking = replace(campaign, recordings=(replace(first, load_cycles=None), *others))
    with pytest.raises(InvalidInput, match=r"recordings\[r0\].load_cycles.*ageing"):
        adopted(report(VALUES), campaign).as_base_model(lacking, table())


def centred(campaign: Campaign) -> Campaign:
    return replace(campaign, recordings=tuple(replace(one, position_mm=None) for one in frf_recordings(campaign)))


def test_a_misalignment_found_beside_the_sensors_serves_presses_on_their_centres() -> None:
    values: dict[str, tuple[float, ...]] = {"misalignment": (0.6, -0.8)}
    model = adopted(report(values), recorded(values))
    asked = centred(frf_campaign())
    parameters = compose(["misalignment"], asked, table()).parameters
    assert parameters[0].name == "offset"
    found = model.response(asked, table())
    shifted = replace(asked, recordings=tuple(_shifted(one, 0.6, -0.8) for one in frf_recordings(frf_campaign())))
    expected = adopted(report({}), frf_campaign()).response(shifted, table())
    np.testing.assert_allclose(found.value, expected.value, rtol=1e-6)


def _shifted(entry: FrfRecording, x_mm: float, y_mm: float) -> FrfRecording:
    centre = next(sensor for sensor in SKIN.sensors if sensor.id == entry.sensor)
    return replace(entry, position_mm=(centre.x_mm + x_mm, centre.y_mm + y_mm))


def test_a_misalignment_of_unknown_direction_serves_no_press_beside_a_centre() -> None:
    found = report({})
    found["mechanisms"] = [{"name": "misalignment", "parameters": [{"name": "offset", "value": 0.7}]}]
    model = adopted(found, centred(frf_campaign()))
    assert model.response(centred(frf_campaign()), table()).inside.all()
    with pytest.raises(InvalidInput, match=r"position_mm.*not in which direction"):
        model.response(frf_campaign(), table())


def test_beside_crosstalk_a_misalignment_has_a_direction_on_centres_too() -> None:
    found = report({})
    found["mechanisms"] = [
        {"name": "misalignment", "parameters": [{"name": f"offset_{axis}", "value": 0.7} for axis in "xy"]},
        {"name": "crosstalk", "parameters": [{"name": "fraction", "value": 0.1}]},
    ]
    assert adopted(found, centred(frf_campaign())).response(centred(frf_campaign()), table()).inside.all()


def test_a_skin_that_is_declared_otherwise_is_not_translated() -> None:
    campaign = recorded({})
    other = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=3.0))
    with pytest.raises(InvalidInput, match="youngs_modulus_mpa"):
        adopted(report({}), campaign).as_base_model(other, table())


@pytest.mark.parametrize(
    "changes",
    [
        {"d33": {"low": 2000.0, "high": 2400.0}},  # no PVDF has it
        {"verdict": "ambiguous"},
        {"mechanisms": [{"name": "phlogiston", "parameters": []}]},
        {"mechanisms": [{"name": "platen_friction", "parameters": []}]},
        {"mechanisms": [{"name": "timing_delay", "parameters": [{"name": "lag", "value": 1.0}]}]},
    ],
)
def test_what_cannot_serve_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput, match="diagnosis_id"):
        adopted(report({}, **changes), frf_campaign())


def test_its_uncertainty_is_that_of_the_diagnosed_d33() -> None:
    model = adopted(report({}, d33={"low": D33 * np.exp(-0.0196), "high": D33 * np.exp(0.0196)}), frf_campaign())
    assert isinstance(model, AdoptedModel)
    assert model.unsure == pytest.approx(0.01, rel=1e-3)
