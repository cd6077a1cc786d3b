"""Loops of indentation: stick, relax, give and come off as the exact laws and independent solutions say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from bench.soak import SOAK
from tests.mechanisms.contact_elements import Body, force_of_elements
from tests.mechanisms.indentation_loops import (
    CREEP,
    E_MPA,
    H_MM,
    LOOP,
    NO_CREEP,
    REDUCED,
    TIME,
    R,
    force_at,
    jkr,
    recorded,
)
from tests.support.mechanism_campaigns import fit_of, predicted, table
from tests.support.sphere_contact import SphereOnLayer
from underskin.mechanisms import compose
from underskin.mechanisms.base import Normal
from underskin.mechanisms.registry import CATALOGUE
from underskin.physics.elastic_layer import Layer
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording, SkinDescription

# A loop that relaxes.


@pytest.mark.parametrize(
    ("fraction", "tau", "work"),
    [(0.5, 3.0, 0.0), (0.8, 1.0, 0.0), (0.3, 30.0, 0.0), (0.0, 1.0, 0.3), (0.5, 3.0, 0.3), (0.5, 3.0, 2.0)],
)
def test_a_loop_with_a_hold_is_that_of_independent_elements(fraction: float, tau: float, work: float) -> None:
    values = {"relaxed_fraction": fraction, "relaxation_time": tau}
    names = ["contact_creep"]
    if work:
        names, values = [*names, "adhesion"], values | {"work_of_adhesion": work}
    exact = force_of_elements(Body(R, REDUCED, fraction, tau, work), LOOP * 1e-3, TIME * np.arange(float(len(LOOP))))
    found = force_at(names, LOOP, **values)
    assert np.abs(found - exact).max() < 4e-4 * exact.max()
    assert (found == 0).tolist() == (exact == 0).tolist()


def test_the_way_back_solves_tings_integral_equation() -> None:
    depth = np.concatenate([np.linspace(0, 0.4, 201), np.linspace(0.4, 0.0, 201)[1:]])
    found = force_at(["contact_creep"], depth, **CREEP)
    top, speed = 200 * TIME, 0.4e-3 / (200 * TIME)

    def modulus(age: float) -> float:
        return 0.5 + 0.5 * float(np.exp(-age / 3.0))

    for sample in (210, 240, 280):
        now = sample * TIME
        back, _ = quad(lambda s, now=now: modulus(now - s), top, now)
        equal = brentq(lambda t1, now=now, back=back: quad(lambda s: modulus(now - s), t1, top)[0] - back, 0, top)
        rate = 2 * REDUCED * np.sqrt(R) * speed**1.5
        exact, _ = quad(lambda s, now=now, rate=rate: modulus(now - s) * rate * np.sqrt(s), 0, equal)
        assert found[sample] == pytest.approx(exact, rel=2e-4)


def test_noise_of_the_displacement_changes_the_force_no_more_than_the_elastic_one() -> None:
    noise = 2e-4 * np.random.default_rng(1).normal(size=len(LOOP))
    elastic = np.abs(force_at([], LOOP + noise) - force_at([], LOOP)).max()
    relaxing = np.abs(force_at(["contact_creep"], LOOP + noise, **CREEP) - force_at(["contact_creep"], LOOP, **CREEP))
    assert 0 < relaxing.max() < 1.5 * elastic


@pytest.mark.slow
@pytest.mark.parametrize(("fraction", "tau", "rest"), [(0.5, 3.0, 0), (0.8, 1.0, 40), (0.3, 30.0, 40)])
def test_pressing_again_meets_unrecovered_surface(fraction: float, tau: float, rest: int) -> None:
    """Further presses, after a rest in the air or a way back in contact, are those of independent elements."""
    again = (0.01 + LOOP, np.linspace(-0.1, 0.3, 40), np.linspace(0.3, 0.1, 20), np.linspace(0.1, 0.45, 30))
    path = np.concatenate([LOOP, np.full(rest, -0.1), *again])
    exact = force_of_elements(Body(R, REDUCED, fraction, tau), path * 1e-3, TIME * np.arange(float(len(path))))
    found = force_at(["contact_creep"], path, relaxed_fraction=fraction, relaxation_time=tau)
    assert np.abs(found - exact).max() < 4e-4 * exact.max()
    assert (found == 0).tolist() == (exact == 0).tolist()


def test_pressing_again_like_once() -> None:
    """A press after a long rest is like the first one; a power law is followed too."""
    for values in (CREEP, {"relaxed_fraction": 0.0, "relaxation_time": 1.0, "relaxation_exponent": 0.15}):
        once = force_at(["contact_creep"], LOOP, **values)
        longest = TIME * len(LOOP) * (1e4 if "relaxation_exponent" in values else 10.0)
        time = TIME * np.arange(float(len(LOOP)))
        recording = IndentationRecording(
            "i", 4.0, np.tile(LOOP, 2), np.tile(once, 2), time_s=np.r_[time, time + longest]
        )
        campaign = replace(recorded(LOOP), recordings=(recording,))
        twice = predicted(["contact_creep"], campaign, **{"contact_point i": 0.0, **values})
        assert np.abs(twice[: len(LOOP)] - once).max() < 1e-3 * once.max()
        assert np.abs(twice[len(LOOP) :] - once).max() < 0.02 * once.max()


@pytest.mark.parametrize(
    ("kept", "of_kept", "gone", "limit"),
    [
        ([], {}, "contact_creep", NO_CREEP),
        (["strain_stiffening"], {"stiffening_coefficient": 0.5}, "contact_creep", NO_CREEP),
        (["adhesion"], {"work_of_adhesion": 0.5}, "contact_creep", NO_CREEP),
        (["contact_creep"], CREEP, "adhesion", {"work_of_adhesion": 0.0}),
        (["contact_creep"], CREEP, "instrument_compliance", {"stage_stiffness": np.inf}),
    ],
)
def test_pressing_again_limits(kept: list[str], of_kept: dict[str, float], gone: str, limit: dict[str, float]) -> None:
    """Each law leaves the others alone where it vanishes, also of a sphere that presses again."""
    path = np.concatenate([LOOP, LOOP])
    alone = force_at(kept, path, **of_kept)
    assert np.abs(force_at([*kept, gone], path, **of_kept, **limit) - alone).max() < 1e-4 * alone.max()


# Limits: each mechanism leaves the others' law alone where it vanishes.

STAGE = {"stage_stiffness": 20.0}
WORK = {"work_of_adhesion": 0.5}


@pytest.mark.parametrize(
    ("kept", "of_kept", "gone", "limit"),
    [
        (["contact_creep"], CREEP, "adhesion", {"work_of_adhesion": 0.0}),
        (["instrument_compliance"], STAGE, "adhesion", {"work_of_adhesion": 0.0}),
        (["contact_creep", "instrument_compliance"], CREEP | STAGE, "adhesion", {"work_of_adhesion": 0.0}),
        (["adhesion"], WORK, "contact_creep", NO_CREEP),
        (["layered_contact", "adhesion"], WORK, "contact_creep", NO_CREEP),
        (["instrument_compliance"], STAGE, "contact_creep", NO_CREEP),
        (["adhesion", "instrument_compliance"], WORK | STAGE, "contact_creep", NO_CREEP),
        (["adhesion"], WORK, "instrument_compliance", {"stage_stiffness": np.inf}),
        (["contact_creep"], CREEP, "instrument_compliance", {"stage_stiffness": np.inf}),
        (["contact_creep", "adhesion"], CREEP | WORK, "instrument_compliance", {"stage_stiffness": np.inf}),
    ],
)
def test_mechanism_limit_leaves(kept: list[str], of_kept: dict[str, float], gone: str, limit: dict[str, float]) -> None:
    """A mechanism at its limit leaves the others."""
    expected = force_at(kept, LOOP, **of_kept)
    assert force_at([*kept, gone], LOOP, **of_kept, **limit) == pytest.approx(expected, abs=2e-5 * expected.max())


# Adhesion on a stage that gives.


def test_under_stage_contact_stable_root_lasts() -> None:
    """Under a stage the contact is the stable root and lasts until the travel s least value."""
    a = np.linspace(1e-5, 2e-3, 400_001)
    depth, force = jkr(a, 0.5)
    up = np.linspace(0.3, -0.4, 1401)
    travel_mm = np.concatenate([np.linspace(-0.1, 0.3, 41), up])
    for stiffness in (0.05, 0.5, 5.0, 500.0):
        travel = depth + force / (stiffness * 1e3)
        least = int(np.argmin(travel))
        exact = np.interp(up * 1e-3, travel[least:], force[least:])
        found = force_at(
            ["adhesion", "instrument_compliance"], travel_mm, work_of_adhesion=0.5, stage_stiffness=stiffness
        )
        sticks = up * 1e-3 > travel[least]
        inside = up * 1e-3 > travel[least] + 2e-6
        assert found[41:][inside] == pytest.approx(exact[inside], abs=1e-5 * np.abs(force).max() + 2e-5)
        assert found[41:][~sticks] == pytest.approx(np.zeros((~sticks).sum()))


@pytest.mark.parametrize(("stiffness", "share"), [(1e5, 5 / 9), (1e-3, 1.0)])
def test_a_stiff_stage_loses_it_at_jkrs_depth_a_soft_one_at_jkrs_force(stiffness: float, share: float) -> None:
    deepest = 1.5 * np.pi * 0.5 * R  # N
    far = 3e3 * deepest / (stiffness * 1e3) + 0.1  # mm, beyond where it comes off
    up = np.append(0.0, np.linspace(-0.0080, -0.0087, 4001)) if stiffness > 1 else np.linspace(0.0, -1.2 * far, 4001)
    travel_mm = np.concatenate([np.linspace(-0.1, 0.05, 16), up])
    found = force_at(["adhesion", "instrument_compliance"], travel_mm, work_of_adhesion=0.5, stage_stiffness=stiffness)
    last = found[np.flatnonzero(found)[-1]]
    assert -last == pytest.approx(share * deepest, rel=1e-2)


def test_on_the_layer_a_stage_gives_by_the_exact_contacts_force() -> None:
    setup = SphereOnLayer(R, E_MPA * 1e6, H_MM * 1e-3, Layer(), work_of_adhesion=0.5)
    for ratio in (1.01, 1.5, 3.0):
        exact = setup.at_radius(ratio * setup.pull_off().contact_radius)
        travel_mm = 1e3 * (exact.indentation + exact.force / 5e3)
        path = np.concatenate([np.linspace(0, travel_mm + 0.1, 20), [travel_mm]])
        names = ["adhesion", "layered_contact", "instrument_compliance"]
        found = force_at(names, path, work_of_adhesion=0.5, stage_stiffness=5.0)
        assert found[-1] == pytest.approx(exact.force, rel=1e-6)


@pytest.mark.parametrize("names", [["adhesion"], ["adhesion", "instrument_compliance"]])
def test_after_pull_off_it_must_touch_again(names: list[str]) -> None:
    loop = np.concatenate([np.linspace(-0.1, 0.2, 31), np.linspace(0.2, -0.2, 41)[1:]])
    values = {"work_of_adhesion": 0.3} | ({"stage_stiffness": 5.0} if len(names) > 1 else {})
    once = force_at(names, loop, **values)
    twice = force_at(names, np.concatenate([loop, loop]), **values)
    assert twice == pytest.approx(np.concatenate([once, once]))
    assert once[:10] == pytest.approx(np.zeros(10))
    assert (once[31:] < 0).any()
    assert once[-10:] == pytest.approx(np.zeros(10))


# A stage that gives under a body that relaxes.


@pytest.mark.parametrize("work", [0.0, 0.5])
def test_the_stage_gives_by_the_force_of_the_whole_history(work: float) -> None:
    names, values = ["contact_creep", "instrument_compliance"], CREEP | STAGE
    if work:
        names, values = [*names, "adhesion"], values | {"work_of_adhesion": work}
    force = force_at(names, LOOP, **values)
    depth = LOOP - force / values["stage_stiffness"]
    time = TIME * np.arange(float(len(LOOP)))
    alone = force_of_elements(Body(R, REDUCED, 0.5, 3.0, work), depth * 1e-3, time)
    touching = force != 0
    assert touching.sum() > 80
    assert np.abs(alone - force)[touching].max() < 2e-3 * force.max()
    stiff = force_at(names, LOOP, **values | {"stage_stiffness": np.inf})
    assert np.abs(force - stiff).max() > 0.02 * force.max()


# Derivatives.

TWO = [
    ["contact_creep", "adhesion"],
    ["contact_creep", "layered_contact"],
    ["contact_creep", "layered_contact", "adhesion"],
    ["contact_creep", "strain_stiffening"],
    ["contact_creep", "instrument_compliance"],
    ["adhesion", "instrument_compliance"],
    ["adhesion", "layered_contact", "instrument_compliance"],
    ["contact_creep", "layered_contact", "instrument_compliance"],
    ["contact_creep", "adhesion", "instrument_compliance"],
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "begins_in_contact"),
    [*((names, False) for names in TWO), *((names, True) for names in (TWO if SOAK else TWO[2:5]))],
)
def test_derivatives_match_differences_on_the_way_in_and_back(names: list[str], begins_in_contact: bool) -> None:
    path = LOOP[8:] + 0.003 if begins_in_contact else LOOP
    model = compose(names, recorded(path), table())
    fit = fit_of(model)
    fit += 0.05 * np.random.default_rng(3).normal(size=len(fit)) * np.maximum(np.abs(fit), 0.05)
    names_of = [parameter.name for parameter in model.parameters]
    fit[names_of.index("contact_point i")] = 0.0
    exact = model.predict(fit)
    smooth = np.abs(exact.value - exact.value[-1]) > 1e-9
    smooth[:-1] &= smooth[1:]  # the last before it comes off may not be in contact a step aside
    smooth[1:] &= smooth[:-1]
    assert smooth.sum() > 80
    for number, slopes in enumerate(exact.slopes):
        step = np.zeros_like(fit)
        step[number] = 1e-5 * max(abs(fit[number]), 0.05)
        change = (model.predict(fit + step).value - model.predict(fit - step).value) / (2 * step[number])
        # At one sample the edge may pass another one within the step, where slopes have a kink
        error = np.sort(np.abs(change - slopes)[smooth])[:-1]
        assert error.max() < 5e-5 * np.abs(slopes[smooth]).max() + 3e-7 * np.abs(exact.value).max(), names_of[number]


@pytest.mark.slow
def test_every_share_and_time_of_relaxation_gives_finite_forces_and_slopes() -> None:
    for path in (LOOP, LOOP + 0.003, LOOP[8:], LOOP[8:74]):
        model = compose(["contact_creep", "layered_contact", "adhesion"], recorded(path), table())
        for fraction in (0.0, 0.027, 0.5, 0.9):
            for tau in (0.05, 1.0, 40.0, 5e4):
                answer = model.predict(fit_of(model, relaxed_fraction=fraction, relaxation_time=tau))
                assert np.isfinite(answer.value).all()
                assert np.isfinite(answer.slopes).all()


def test_two_recordings_do_not_feel_each_other() -> None:
    one = recorded(LOOP)
    first = one.recordings[0]
    assert isinstance(first, IndentationRecording)
    other = replace(first, id="j", indenter_radius_mm=8.0)
    both = replace(one, recordings=(first, other))
    names = ["contact_creep", "adhesion", "instrument_compliance"]
    values = {**CREEP, **WORK, **STAGE, "contact_point i": 0.0}
    found = predicted(names, both, **values, **{"contact_point j": 0.01})
    assert found[: len(LOOP)] == pytest.approx(force_at(names, LOOP, **CREEP, **WORK, **STAGE))
    alone = predicted(names, replace(one, recordings=(other,)), **CREEP, **WORK, **STAGE, **{"contact_point j": 0.01})
    assert found[len(LOOP) :] == pytest.approx(alone)


def test_a_stage_is_expected_as_stiff_as_the_spheres_size_says() -> None:
    """A stage of 150 N/mm and one of 150 N/m are as usual beside their spheres of 5 mm and 5 µm."""
    usual = []
    for radius in (5.0, 5e-3):
        curve = IndentationConditions("c", radius, np.linspace(0.0, 0.01, 5))
        conditions = Conditions("c", SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=1.0), (curve,))
        (stiffness,) = CATALOGUE["instrument_compliance"].parameters(conditions, "indentation")
        assert isinstance(stiffness.prior, Normal)
        usual.append(stiffness.prior.mean)
        assert stiffness.bounds[0] < np.log(1e-5)  # N/mm: the softest cantilevers
    assert usual[0] - usual[1] == pytest.approx(np.log(1000.0))
    assert np.exp(usual[0]) == pytest.approx(150.0)


def test_wobble_in_air_presses_once() -> None:
    """A sphere that moves forth and back in the air before it touches has the force of one that does not."""
    air = np.concatenate([np.linspace(-0.08, -0.03, 8), np.linspace(-0.03, -0.08, 8)])
    laws = ["adhesion", "contact_creep"]
    with_wobble = force_at(laws, np.concatenate([air, LOOP]))[len(air) :]
    assert with_wobble == pytest.approx(force_at(laws, np.concatenate([np.full(len(air), -0.08), LOOP]))[len(air) :])
