"""Every mechanism keeps the contract: documented, proper priors, known units, limits, derivatives, honest refusals."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from tests.support.mechanism_campaigns import (
    SKIN,
    campaign,
    compression_campaign,
    fit_of,
    frf_campaign,
    frf_recording,
    indentation_campaign,
    table,
)
from underskin.mechanisms import CATALOGUE, Mechanism, Model, Parameter, compose
from underskin.mechanisms.base import UNITS, Kind
from underskin.mechanisms.contract import check
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.registry import built_in
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.units import Floats

CAMPAIGNS: dict[Kind, Campaign] = {
    "frf": frf_campaign(),
    "indentation": indentation_campaign(),
    "compression": compression_campaign(),
}
NAMES = tuple(mechanism.name for mechanism in built_in())
EACH = [(name, kind) for name in NAMES for kind in CATALOGUE[name].kinds]
TRIPLES: list[tuple[tuple[str, ...], Kind]] = [
    (("layered_contact", "adhesion", "moving_contact_edge"), "frf"),
    (("compressible_layer", "interface_slip", "layered_contact"), "frf"),
    (("interface_slip", "film_shear", "layered_contact"), "frf"),
    (("compressible_layer", "film_shear", "moving_contact_edge"), "frf"),
    (("adhesion", "elastic_tip", "layered_contact"), "frf"),
    (("compressible_layer", "elastic_tip", "contact_resonance"), "frf"),
    (("thickness_error", "misalignment", "contact_resonance"), "frf"),
    (("contact_creep", "strain_stiffening", "moving_contact_edge"), "frf"),
    (("crosstalk", "preload_dependent_d33", "ageing"), "frf"),
    (("sensor_relaxation", "amplifier_high_pass", "timing_delay"), "frf"),
    (("layered_contact", "adhesion", "strain_stiffening"), "indentation"),
    (("instrument_compliance", "contact_creep", "adhesion"), "indentation"),
    (("compressible_layer", "layered_contact", "instrument_compliance"), "indentation"),
    (("strain_stiffening", "contact_creep", "platen_friction"), "compression"),
    (("cell_collapse", "contact_creep", "cyclic_softening"), "compression"),
]


def model_of(names: Sequence[str], kind: Kind) -> Model:
    return compose(names, CAMPAIGNS[kind], table())


def parameters() -> dict[str, Parameter]:
    found: dict[str, Parameter] = {}
    for kind in CAMPAIGNS:
        names = [name for name in NAMES if kind in CATALOGUE[name].kinds]
        found |= {f"{kind} {p.name}": p for p in model_of(names, kind).parameters}
    return found


def test_the_catalogue_is_in_order_of_composition() -> None:
    """A model composes by stage; the page that lists the names is held to the catalogue by its own test."""
    stages = [mechanism.rank for mechanism in built_in()]
    assert stages == sorted(stages)
    assert [name for name in CATALOGUE if name in NAMES] == list(NAMES)
    assert len({(mechanism.stage, mechanism.order) for mechanism in built_in()}) == len(NAMES)
    assert all(mechanism.name == name for name, mechanism in CATALOGUE.items())


@pytest.mark.parametrize("mechanism", built_in(), ids=lambda mechanism: mechanism.name)
def test_it_keeps_the_contract_that_those_of_other_packages_are_held_to(mechanism: Mechanism) -> None:
    check(mechanism, [other for other in built_in() if other is not mechanism])
    assert re.fullmatch(r"[A-Z][A-Za-z0-9', -]{60,230}\.", mechanism.plain), "one sentence, no formula"
    assert min(map(len, (mechanism.law, mechanism.assumptions))) > 20
    assert len(mechanism.source) > 10


@pytest.mark.parametrize("parameter", parameters().values(), ids=parameters())
def test_parameters_have_units_bounds_reasons_and_proper_priors(parameter: Parameter) -> None:
    assert parameter.unit in UNITS
    assert parameter.reason
    low, high = parameter.bounds
    assert np.isfinite([low, high]).all()
    assert low <= parameter.start <= high
    total, _ = quad(lambda fit: np.exp(parameter.log_prior(fit)), low, high, points=[parameter.start], limit=200)
    assert total == pytest.approx(1, abs=1e-6)
    assert parameter.log_prior(low - 1e-6) == parameter.log_prior(high + 1e-6) == -np.inf
    median = parameter.quantile(0.5)
    below, _ = quad(lambda fit: np.exp(parameter.log_prior(fit)), low, median, limit=200)
    assert below == pytest.approx(0.5, abs=1e-6)
    assert parameter.from_fit(parameter.to_fit(parameter.high)) == pytest.approx(parameter.high)


def with_limits() -> list[tuple[str, Kind]]:
    """Without those whose limit is the campaign's, not a parameter's: tested with their physics."""
    return [
        (name, kind)
        for name, kind in EACH
        if any(parameter.limit is not None for parameter in CATALOGUE[name].parameters(CAMPAIGNS[kind], kind))
    ]


@pytest.mark.parametrize(("name", "kind"), with_limits())
def test_its_limits_recover_the_base_model(name: str, kind: Kind) -> None:
    model, base = model_of([name], kind), model_of([], kind)
    own = model.parameters[: len(model.parameters) - len(base.parameters)]
    limits = {parameter.name: parameter.limit for parameter in own if parameter.limit is not None}
    expected = base.predict(fit_of(base)).value
    found = model.predict(fit_of(model, **limits))
    assert np.abs(found.value - expected).max() < 2e-5 * np.abs(expected).max()
    if found.pickup is not None:
        assert found.pickup.max() < 1e-5 * np.abs(expected).min()
    assert all(parameter.limit == SENSOR_SPREAD for parameter in own if parameter.acts_on == "gain_spread")


def with_smooth_steps() -> list[tuple[tuple[str, ...], Kind]]:
    """Each alone, and the triples but the stage under a body that relaxes: tested with the contact's history."""
    held = ("instrument_compliance", "contact_creep", "adhesion")
    return [*(((name,), kind) for name, kind in EACH), *(each for each in TRIPLES if each[0] != held)]


@pytest.mark.parametrize(("names", "kind"), with_smooth_steps())
def test_derivatives_match_finite_differences(names: tuple[str, ...], kind: Kind) -> None:
    model = model_of(names, kind)
    random = np.random.default_rng(len("".join(names)))
    fit = np.array([parameter.quantile(random.uniform(0.25, 0.75)) for parameter in model.parameters])
    exact = model.predict(fit)
    smooth = _away_from_first_contact(exact.value, kind)
    for number, slopes in enumerate(exact.slopes):
        step = np.zeros_like(fit)
        step[number] = 3e-5 * max(abs(fit[number]), 0.1)
        ahead, behind = model.predict(fit + step), model.predict(fit - step)
        change = (ahead.value - behind.value) / (2 * step[number])
        assert np.abs(change - slopes)[smooth].max() < 2e-5 * np.abs(slopes).max() + 1e-7 * np.abs(exact.value).max()


FRF_SETS = [*((name,) for name, kind in EACH if kind == "frf"), *(names for names, kind in TRIPLES if kind == "frf")]


@pytest.mark.parametrize("names", FRF_SETS)
def test_several_points_at_once_are_each_point_alone(names: tuple[str, ...]) -> None:
    model = model_of(names, "frf")
    assert isinstance(model, FrfModel)
    random = np.random.default_rng(5)
    fits = np.array([[entry.quantile(random.uniform(0.1, 0.9)) for entry in model.parameters] for _ in range(3)])
    together = model.respond(fits, place=True)
    for number, fit in enumerate(fits):
        alone, own = model.respond(fit, place=True), together.part(number)
        assert own.level.value == pytest.approx(alone.level.value, rel=1e-12)
        assert own.level.slopes == pytest.approx(
            alone.level.slopes, rel=1e-9, abs=1e-12 * np.abs(alone.level.value).max()
        )
        assert own.place_slopes == pytest.approx(
            alone.place_slopes, rel=1e-9, abs=1e-6 * np.abs(alone.level.value).max()
        )
        if alone.lines is not None:
            assert own.lines is not None
            assert own.lines.value == pytest.approx(alone.lines.value, rel=1e-12)
            assert own.lines.slopes == pytest.approx(alone.lines.slopes, rel=1e-9, abs=1e-12)


def _away_from_first_contact(value: Floats, kind: Kind) -> Floats:
    """Rows where the force is not that of a contact about to begin or end, where it has a kink."""
    if kind == "indentation":
        return np.abs(value) > 0.05 * np.abs(value).max()
    return np.ones(len(value), dtype=bool)


@pytest.mark.parametrize(
    "names", [(), ("moving_contact_edge",), ("crosstalk", "preload_dependent_d33", "misalignment")]
)
def test_the_slope_by_position_is_that_of_a_moved_contact(names: tuple[str, ...]) -> None:
    fit = fit_of(model_of(names, "frf"))
    slopes = model_of(names, "frf").predict(fit).position_slopes
    assert slopes is not None
    step = 1e-3  # mm
    for axis, slope in enumerate(slopes):
        values = [compose(names, _moved(axis, sign * step), table()).predict(fit).value for sign in (1, -1)]
        change = (values[0] - values[1]) / (2e-3 * step)
        assert np.abs(change - slope).max() < 1e-5 * np.abs(slope).max()


def _moved(axis: int, shift_mm: float) -> Campaign:
    recordings = []
    for recording in frf_campaign().recordings:
        assert isinstance(recording, FrfRecording)
        position = np.array(recording.position_mm)
        position[axis] += shift_mm
        recordings.append(replace(recording, position_mm=(float(position[0]), float(position[1]))))
    return campaign(recordings)


def test_order_of_names_does_not_matter_and_parameters_follow_the_order_of_composition() -> None:
    forward = model_of(["ageing", "moving_contact_edge"], "frf")
    assert forward.names == ("moving_contact_edge", "ageing")
    assert [parameter.name for parameter in forward.parameters] == [
        "mobile_fraction",
        "loss",
        "onset",
        "saturation",
        "d33",
        "youngs_modulus",
        "thickness",
    ]


def test_rows_run_over_recordings_and_sensors_are_numbered() -> None:
    model = model_of([], "frf")
    assert model.recording.tolist() == np.repeat(np.arange(12), 13).tolist()
    assert model.sensor is not None
    assert model.sensor.tolist() == [0, 1, 2] * 4
    assert model.valid.all()


def test_contacts_beyond_the_table_are_marked_and_continued() -> None:
    soft = replace(SKIN, youngs_modulus_mpa=0.05)
    model = compose([], campaign([frf_recording(), frf_recording(id="q", preload_n=0.01)], soft), table())
    assert model.valid.reshape(2, -1).all(axis=1).tolist() == [False, True]
    answer = model.predict(fit_of(model))
    assert (answer.inside == model.valid).all()
    assert np.isfinite(answer.value).all()


def test_contacts_beside_the_profile_are_marked_and_feel_nothing() -> None:
    beside = campaign([frf_recording(position_mm=(19.0, 0.0)), frf_recording(id="far", position_mm=(25.0, 0.0))])
    model = compose([], beside, table())
    assert not model.valid.any()
    answer = model.predict(fit_of(model))
    assert not answer.inside.any()
    assert (answer.value.reshape(2, -1)[1] == 0).all()
    assert answer.position_slopes is not None
    assert (answer.position_slopes.reshape(2, 2, -1)[:, 1] == 0).all()


@pytest.mark.parametrize(
    ("name", "values"),
    [("misalignment", {"offset_x": 1.9, "offset_y": 0.0}), ("thickness_error", {"thickness_factor": 0.7})],
)
def test_what_a_fit_moves_beside_the_profile_is_marked_there(name: str, values: dict[str, float]) -> None:
    near, far = frf_recording(position_mm=(1.0, 0.0)), frf_recording(id="far", position_mm=(18.3, 0.0))
    model = compose([name], campaign([near, far]), table())
    assert model.valid.all()
    assert model.predict(fit_of(model)).inside.all()
    answer = model.predict(fit_of(model, **values))
    assert answer.inside.reshape(2, -1).all(axis=1).tolist() == [True, False]
    assert (answer.value.reshape(2, -1)[1] == 0).all()
    assert (answer.value.reshape(2, -1)[0] != 0).all()


@pytest.mark.parametrize(("names", "kind"), [*(((name,), kind) for name, kind in EACH), *TRIPLES])
def test_predictions_are_finite_at_every_bound(names: tuple[str, ...], kind: Kind) -> None:
    model = model_of(names, kind)
    low, high = np.array([parameter.bounds for parameter in model.parameters]).T
    random = np.random.default_rng(7)
    corners = [np.where(random.random(len(low)) < 0.5, low, high) for _ in range(4)]
    for fit in (low, high, *corners):
        answer = model.predict(fit)
        assert np.isfinite(answer.value).all()
        assert np.isfinite(answer.slopes).all()
