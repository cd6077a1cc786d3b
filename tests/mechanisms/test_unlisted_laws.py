"""Laws of the grammar: finite, right derivatives, nothing at amplitudes of 0, and the physics of where they enter."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from bench.soak import SOAK
from underskin.mechanisms import CATALOGUE
from underskin.mechanisms.declared.document import parse
from underskin.mechanisms.declared.mechanism import value_of
from underskin.mechanisms.declared.saving import document
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.mechanisms.unlisted.expressions import change_along
from underskin.mechanisms.unlisted.forms import Axis, axes_of, shapes
from underskin.mechanisms.unlisted.grammar import Grammar, combination
from underskin.mechanisms.unlisted.laws import LevelTables, RecordingLaw, UnlistedLaw
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, frf_of
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Array, Floats


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    """The reference campaign on two days, with a temperature and an operator."""
    recordings: list[FrfRecording] = []
    for number, entry in enumerate(reference_campaign("frf").recordings):
        assert isinstance(entry, FrfRecording)
        noted: dict[str, float | str] = {"temperature_c": 20.0 + 0.7 * number, "operator": "ab"[number % 2]}
        at = f"2020-01-0{1 + number // 7}T{9 + number % 7:02d}:00:00Z"
        recordings.append(replace(entry, recorded_at=at, conditions=noted))
    return replace(reference_campaign("frf"), recordings=tuple(recordings))


@pytest.fixture(scope="module")
def grammar(campaign: Campaign, table: SigmaTable) -> Grammar:
    return Grammar.of(campaign, lines_of(campaign), table, CATALOGUE)


def lines_of(conditions: Conditions) -> Floats:
    lines = frf_of(conditions)[0].frequency_hz
    assert lines is not None
    return lines


def of_each_combination(grammar: Grammar) -> list[UnlistedLaw]:
    return list({(*combination(law), law.name.split("__")[-1][:3]): law for law in grammar.laws}.values())


def predicted(model: FrfModel, own: Sequence[float]) -> Array:
    return model.predict(point(model, own), slopes=False).value


def point(model: FrfModel, own: Sequence[float]) -> Floats:
    fit = np.array([entry.start for entry in model.parameters])
    fit[: len(own)] = own
    return fit


def coordinates(law: UnlistedLaw, amplitude: float) -> list[float]:
    """All amplitudes at a share of their priors' sd, what bends the law at the first of its grid."""
    count = len(law.amplitudes)
    sds = [entry.prior.sd for entry in law.parameters_stated[:count]]  # type: ignore[union-attr]
    return [*(amplitude * sd for sd in sds), *law.grid[0][: len(law.parameters_stated) - count]]


def test_the_grammar_holds_several_hundred_laws_whose_shares_are_a_prior(grammar: Grammar) -> None:
    assert len(grammar.laws) > 500
    assert len({law.name for law in grammar.laws}) == len(grammar.laws)
    assert 0.3 < np.exp(grammar.log_shares).sum() <= 1.0
    shares: dict[tuple[str, str, str], float] = {}
    for law, share in zip(grammar.laws, np.exp(grammar.log_shares), strict=True):
        shares[combination(law)] = shares.get(combination(law), 0.0) + share
    # Always below a named law that does the same: 0.34 over all mechanisms against 0.05
    assert 0.05 * max(shares.values()) < 0.34 / len(CATALOGUE)


@pytest.mark.slow
def test_amplitudes_of_0_are_the_base_model(grammar: Grammar, campaign: Campaign, table: SigmaTable) -> None:
    base = predicted(FrfModel((), campaign, table), ())
    for law in of_each_combination(grammar)[:: 1 if SOAK else 3]:
        model = FrfModel([law], campaign, table)
        assert predicted(model, coordinates(law, 0.0)) == pytest.approx(base, rel=1e-9), law.name


@pytest.mark.slow
def test_derivatives_are_those_of_differences(grammar: Grammar, campaign: Campaign, table: SigmaTable) -> None:
    for law in of_each_combination(grammar)[:: 1 if SOAK else 3]:
        model = FrfModel([law], campaign, table)
        fit = point(model, coordinates(law, 0.31))
        exact = model.predict(fit).slopes
        for place in range(len(law.parameters_stated)):
            step = np.zeros(len(fit))
            step[place] = 1e-6
            ahead, behind = (model.predict(fit + sign * step, slopes=False).value for sign in (1, -1))
            scale = np.abs(exact[place]).max() + 1e-6 * np.abs(ahead).max()
            assert np.abs((ahead - behind) / 2e-6 - exact[place]).max() < 2e-4 * scale, (law.name, place)


def one_law(acts_on: str, axis: Axis, campaign: Campaign, table: SigmaTable) -> tuple[RecordingLaw, FrfModel]:
    """A linear law over an axis, from its least value on, in a model."""
    shape = next(entry for entry in shapes(axis) if entry.form == "linear")
    law = RecordingLaw(acts_on, axis, shape, LevelTables(campaign, table))  # type: ignore[arg-type]
    return law, FrfModel([law], campaign, table)


def along(campaign: Campaign, name: str) -> Axis:
    return next(axis for axis in axes_of(campaign) if axis.name == name)


@pytest.mark.parametrize(("acts_on", "size"), [("modulus", 0.8), ("thickness", 0.2), ("contact_radius", -0.3)])
def test_law_base_model_skin_changes(acts_on: str, size: float, campaign: Campaign, table: SigmaTable) -> None:
    """A law is the base model of a skin that changes.

    Each recording against a base model of its own, with that modulus, thickness, or sphere and modulus.
    """
    axis = along(campaign, "order")
    _, model = one_law(acts_on, axis, campaign, table)
    found = predicted(model, [size])
    for number, entry in enumerate(frf_of(campaign)):
        factor = 1 + size * axis.values[entry.id] / axis.span
        radius, modulus, thickness = entry.indenter_radius_mm, 2.0, 2.5
        if acts_on == "contact_radius":  # at the same L: R a, E/a²
            radius, modulus = radius * factor, modulus / factor**2
        elif acts_on == "modulus":
            modulus *= factor
        else:
            thickness *= factor
        skin = replace(campaign.skin, youngs_modulus_mpa=modulus, thickness_mm=thickness)
        alone = Conditions("one", skin, (replace(entry, indenter_radius_mm=radius),))
        expected = predicted(FrfModel((), alone, table), ())
        assert found[model.recording == number] == pytest.approx(expected, rel=2e-3), (acts_on, number)


def test_a_force_that_is_lost_is_a_smaller_preload(campaign: Campaign, table: SigmaTable, grammar: Grammar) -> None:
    lost = next(law for law in grammar.laws if combination(law) == ("force", "preload_n", "threshold"))
    model = FrfModel([lost], campaign, table)
    found = predicted(model, [0.2])
    for number, entry in enumerate(frf_of(campaign)):
        alone = Conditions("one", campaign.skin, (replace(entry, preload_n=entry.preload_n - 0.2),))
        expected = predicted(FrfModel((), alone, table), ())
        assert found[model.recording == number] == pytest.approx(expected, rel=2e-3), number


def test_a_place_that_wanders_is_a_press_elsewhere(campaign: Campaign, table: SigmaTable) -> None:
    axis = along(campaign, "order")
    _, model = one_law("position", axis, campaign, table)
    found = predicted(model, [0.8, -0.5])
    for number, entry in enumerate(frf_of(campaign)):
        share = axis.values[entry.id] / axis.span
        assert entry.position_mm is not None
        there = entry.position_mm[0] + 0.8 * share, entry.position_mm[1] - 0.5 * share
        alone = Conditions("one", campaign.skin, (replace(entry, position_mm=there),))
        expected = predicted(FrfModel((), alone, table), ())
        assert found[model.recording == number] == pytest.approx(expected, rel=3e-3), number


@pytest.mark.slow
def test_what_is_kept_of_a_law_over_recordings_is_that_law(grammar: Grammar) -> None:
    for law in grammar.laws[:: 1 if SOAK else 4]:
        if not isinstance(law, RecordingLaw) or law.axis.words or law.description.form == "free":
            continue
        values = {entry.name: entry.from_fit(entry.quantile(0.7)) for entry in law.parameters_stated}
        said = {"acts_on": law.description.acts_on, "axis": law.axis.name, "form": law.description.form}
        stated = {**said, "expression": "E", "range": {law.axis.name: [law.axis.low, law.axis.high]}}
        found = {"law": law.name, "parameters": values}
        report = {"unnamed": stated, "provenance": {"unnamed": found}, "campaign": "c", "verdict": "unexplained"}
        kept = parse(document(report, "kept").encode(), "kept.yaml")
        short = {name.removeprefix("law_"): value for name, value in values.items()}
        x = np.linspace(law.axis.low, law.axis.high, 7)
        exact = change_along(law, values, x).reshape(len(x), -1)
        axes = {law.axis.name: x, **({"preload_n": np.ones(len(x))} if law.axis.relative else {})}
        for place, expected in zip(kept.laws, exact.T, strict=True):
            told = np.broadcast_to(np.asarray(value_of(place, {**short, **axes})), x.shape)
            change = told if law.description.acts_on in ("force", "position") else told - 1
            assert change == pytest.approx(expected, abs=2e-3 * float(np.abs(exact).max())), law.name
