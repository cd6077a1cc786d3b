"""The pressed skin: Hertz, σ, stress and FRF together, their limits, and the FRF's gradient."""

from typing import Any

import numpy as np
import pytest

from tablegen import linear_layer
from underskin import Indenter, Skin, load_table, transmission
from underskin.prediction.pressed_skin import frf_gradient
from underskin.units import Floats

TABLE = load_table()
D33 = 14e-12
GENERATOR = np.random.default_rng(16)

# Rows well inside the table, in SI: a/h 0.1 to 1, rT/h 0.1 to 2.5, L 2e-4 to 0.05.
ROWS = {
    "thickness": np.exp(GENERATOR.uniform(np.log(1e-3), np.log(4e-3), 40)),
    "youngs_modulus": np.exp(GENERATOR.uniform(np.log(1e6), np.log(20e6), 40)),
    "sensor_radius": np.exp(GENERATOR.uniform(np.log(0.4e-3), np.log(2.4e-3), 40)),
    "indenter_radius": np.exp(GENERATOR.uniform(np.log(4e-3), np.log(10e-3), 40)),
    "preload": np.exp(GENERATOR.uniform(np.log(0.3), np.log(0.8), 40)),
    "d33": GENERATOR.choice([-1.0, 1.0], 40) * GENERATOR.uniform(5e-12, 40e-12, 40),
}


def parts(rows: dict[str, Any]) -> tuple[Skin, Indenter, Any]:
    skin = Skin(rows["thickness"], rows["youngs_modulus"], rows["sensor_radius"], np.array(0.5))
    return skin, Indenter(rows["indenter_radius"]), rows["preload"]


def frf(rows: dict[str, Any]) -> Floats:
    return transmission(TABLE, *parts(rows)).frf(rows["d33"])


def prototype(**lab: Any) -> tuple[Skin, Indenter]:
    values = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4.0} | lab
    return Skin.from_lab(**{name: value for name, value in values.items() if name != "indenter_radius_mm"}), (
        Indenter.from_lab(indenter_radius_mm=values["indenter_radius_mm"])
    )


def test_the_prototype_by_hand() -> None:
    skin, indenter = prototype()
    reached = transmission(TABLE, skin, indenter, 1.0)
    a = (0.75 * 1.0 * 4e-3 * 0.75 / 16e6) ** (1 / 3)
    assert reached.contact_radius == pytest.approx(a, rel=1e-14)
    assert reached.a_over_h == pytest.approx(a / 2.5e-3, rel=1e-14)
    assert reached.rt_over_h == pytest.approx(0.6, rel=1e-14)
    assert reached.load_parameter == pytest.approx(1 / 256, rel=1e-14)
    sigma = TABLE.sigma(a / 2.5e-3, 0.6, 1 / 256)
    assert reached.sigma == pytest.approx(float(sigma.sigma), rel=1e-12)
    assert reached.rel_error == sigma.rel_error
    assert reached.frf(D33) == pytest.approx(D33 * 1.5 * 0.36 * float(sigma.sigma), rel=1e-12)


def test_stress_times_area_is_the_charge_over_d33() -> None:
    rows = ROWS
    reached = transmission(TABLE, *parts(rows))
    charge = reached.frf(D33) * rows["preload"]
    area = np.pi * rows["sensor_radius"] ** 2
    assert reached.mean_stress * area == pytest.approx(charge / D33, rel=1e-13)


def test_lengths_and_forces_scale_out() -> None:
    """With all lengths × s and the force × s² every stress stays, and so does the FRF."""
    scaled = {name: values * 3.0 for name, values in ROWS.items()}
    scaled |= {"preload": ROWS["preload"] * 9.0, "youngs_modulus": ROWS["youngs_modulus"], "d33": ROWS["d33"]}
    assert frf(scaled) == pytest.approx(frf(ROWS), rel=1e-12)
    stress = [transmission(TABLE, *parts(rows)).mean_stress for rows in (ROWS, scaled)]
    assert stress[1] == pytest.approx(stress[0], rel=1e-12)


def test_a_light_touch_is_a_point_load_on_the_linear_layer() -> None:
    reached = transmission(TABLE, *prototype(), 1e-9)
    assert reached.sigma == pytest.approx(float(linear_layer.sigma(0.0, 0.6)), rel=1e-5)


def test_a_sensor_three_times_as_wide_as_the_skin_is_thick_catches_the_force() -> None:
    reached = transmission(TABLE, *prototype(sensor_radius_mm=7.5), 0.1)
    assert reached.frf(D33) == pytest.approx(D33, rel=2e-3)


def test_shapes_broadcast() -> None:
    skin, indenter = prototype(thickness_mm=[[2.0], [2.5], [3.0]], indenter_radius_mm=[4.0, 10.0])
    reached = transmission(TABLE, skin, indenter, 1.0)
    for values in (reached.sigma, reached.mean_stress, reached.inside, reached.contact_radius, reached.frf(D33)):
        assert values.shape == (3, 2)
    alone = transmission(TABLE, *prototype(thickness_mm=3.0, indenter_radius_mm=10.0), 1.0)
    assert reached.sigma[2, 1] == pytest.approx(float(alone.sigma), rel=1e-14)


def test_rows_outside_are_nan_and_spoil_no_other() -> None:
    skin, indenter = prototype(poisson_ratio=[0.5, 0.49, 0.5])
    reached = transmission(TABLE, skin, indenter, [1.0, 1.0, 300.0])
    assert reached.inside.tolist() == [True, False, False]
    for values in (reached.sigma, reached.rel_error, reached.mean_stress, reached.frf(D33)):
        assert np.isnan(values).tolist() == [False, True, True]
    assert np.isfinite(reached.contact_radius).all()
    assert reached.sigma[0] == transmission(TABLE, *prototype(), 1.0).sigma
    slopes = frf_gradient(TABLE, skin, indenter, np.array([1.0, 1.0, 300.0]), D33)
    for name in ("thickness", "preload", "d33"):
        assert np.isnan(slopes[name]).tolist() == [False, True, True]


@pytest.mark.parametrize("name", ROWS)
def test_gradient_equals_finite_differences(name: str) -> None:
    step = 1e-5
    up, down = (frf(ROWS | {name: ROWS[name] * (1 + sign * step)}) for sign in (1, -1))
    difference = (up - down) / (2 * step)
    skin, indenter, preload = parts(ROWS)
    exact = frf_gradient(TABLE, skin, indenter, preload, ROWS["d33"])[name] * ROWS[name]
    assert np.isfinite(exact).all()
    assert exact == pytest.approx(difference, rel=1e-5, abs=1e-8 * np.abs(frf(ROWS)).max())


def test_gradient_knows_dimensions() -> None:
    """FRF does not change with all lengths × s and F × s², nor with E × s and F × s, and is proportional to d33."""
    skin, indenter, preload = parts(ROWS)
    slopes = frf_gradient(TABLE, skin, indenter, preload, ROWS["d33"])
    parted = {name: slopes[name] * ROWS[name] / frf(ROWS) for name in ROWS}
    lengths = parted["thickness"] + parted["sensor_radius"] + parted["indenter_radius"]
    assert lengths + 2 * parted["preload"] == pytest.approx(0, abs=1e-12)
    assert parted["youngs_modulus"] + parted["preload"] == pytest.approx(0, abs=1e-12)
    assert parted["d33"] == pytest.approx(1, rel=1e-14)
