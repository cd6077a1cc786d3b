"""The layer of any Poisson ratio and glue line: independent values (good to about 5e-10), limits, derivatives."""

import numpy as np
import pytest

from tablegen import linear_layer
from tests.support.oracle import layer_rows
from underskin.errors import InvalidInput
from underskin.physics import elastic_layer
from underskin.physics.elastic_layer import Layer, slip
from underskin.physics.hankel_transform import normal_stress, punch_transform
from underskin.units import Floats

K = np.array([1e-6, 1e-3, 0.1, 0.2499, 0.2501, 1.0, 3.0, 10.0, 40.0])
LAYERS = [Layer(), Layer(0.5, 1.0), Layer(0.5, 0.999), Layer(0.3), Layer(0.0, 0.4), Layer(0.45, 1.0)]
FUNCTIONS = ["transmission", "tangential_transmission", "compliance", "stiffening"]


def _oracle(quantity: str) -> dict[Layer, Floats]:
    """Columns rt_over_h, a_over_h, offset_over_h and value, (4, rows), of every layer; κ is twice the file's column."""
    rows: dict[Layer, list[list[float]]] = {}
    for row in layer_rows(quantity):
        body = Layer(float(row["poisson_ratio"]), slip(2 * float(row["glue_stiffness_h_over_2g"])))
        names = ("rt_over_h", "a_over_h", "offset_over_h", "value")
        rows.setdefault(body, []).append([float(row[name] or "nan") for name in names])
    return {body: np.array(values).T for body, values in rows.items()}


def _punch_sigma(body: Layer, a: Floats, rho: Floats) -> Floats:
    return normal_stress(lambda k: body.transmission(k).value, punch_transform, a, rho)


@pytest.mark.parametrize(
    ("quantity", "layers"), [("sigma_hertz", 8), ("sigma_edge", 8), ("gamma_n", 8), ("gamma_t", 5)]
)
def test_every_row_of_the_oracle(quantity: str, layers: int) -> None:
    oracle = _oracle(quantity)
    assert len(oracle) == layers
    for body, (rho, a, offset, value) in oracle.items():
        if quantity == "sigma_hertz":
            found = elastic_layer.sigma(body, a, rho, offset)
        elif quantity == "sigma_edge":
            found = _punch_sigma(body, a, rho)
        elif quantity == "gamma_n":
            found = elastic_layer.gamma_n(body, offset, rho)
        else:
            found = elastic_layer.gamma_t(body, offset, rho)
        assert found == pytest.approx(value, abs=2e-8), body


def test_the_incompressible_bonded_layer_has_its_closed_form() -> None:
    assert Layer().transmission(K).value == pytest.approx(linear_layer.transmission(K), rel=1e-13)
    k = K[2:-1]
    closed = (np.sinh(2 * k) - 2 * k) / (1 + 2 * k**2 + np.cosh(2 * k))
    assert Layer().compliance(k).value == pytest.approx(closed, rel=1e-12)


def test_a_frictionless_base_transmits_alike_for_every_poisson_ratio() -> None:
    """(sinh k + k cosh k)/(sinh k cosh k + k), as for the half of a plate of thickness 2h pressed from both sides."""
    k = K[2:-1]
    closed = (np.sinh(k) + k * np.cosh(k)) / (np.sinh(k) * np.cosh(k) + k)
    for poisson_ratio in (0.0, 0.3, 0.5):
        assert Layer(poisson_ratio, 1.0).transmission(k).value == pytest.approx(closed, rel=1e-13)


def test_small_wave_numbers() -> None:
    """One-dimensional compression: K → k (1 − 2ν)/(2 (1 − ν)²); an incompressible layer gives only as (2/3) k³."""
    k = np.array([1e-6, 1e-4])
    for poisson_ratio in (0.0, 0.3, 0.499):
        expected = k * (1 - 2 * poisson_ratio) / (2 * (1 - poisson_ratio) ** 2)
        assert Layer(poisson_ratio).compliance(k).value == pytest.approx(expected, rel=2e-4)
    assert Layer().compliance(k).value == pytest.approx(2 / 3 * k**3, rel=1e-7)
    for body in LAYERS:
        assert body.transmission(k).value == pytest.approx(1.0, abs=1e-6)


def test_nothing_overflows_and_a_thick_layer_is_a_half_space() -> None:
    k = np.array([0.0, 60.0, 800.0, 1e5])
    for body in LAYERS:
        for name in FUNCTIONS:
            differentiated = getattr(body, name)(k)
            assert np.isfinite([differentiated.value, *differentiated.slopes]).all()
        assert body.compliance(k).value == pytest.approx([0, 1, 1, 1], abs=1e-9)
        assert body.compliance(K).value + body.stiffening(K).value == pytest.approx(1, abs=1e-14)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives(name: str) -> None:
    step = 1e-5
    for poisson_ratio, slippage in ((0.3, 0.2), (0.49, 0.9), (0.1, 0.02)):
        differentiated = getattr(Layer(poisson_ratio, slippage), name)(K)
        higher = getattr(Layer(poisson_ratio + step, slippage), name)(K).value
        lower = getattr(Layer(poisson_ratio - step, slippage), name)(K).value
        assert differentiated.slopes[0] == pytest.approx((higher - lower) / (2 * step), abs=1e-8)
        higher = getattr(Layer(poisson_ratio, slippage + step), name)(K).value
        lower = getattr(Layer(poisson_ratio, slippage - step), name)(K).value
        assert differentiated.slopes[1] == pytest.approx((higher - lower) / (2 * step), abs=1e-7)


def test_the_base_carries_the_whole_force() -> None:
    """On a disc of thirty thicknesses; a nearly frictionless base spreads it further, over 1/√κ."""
    for body in (Layer(), Layer(0.3), Layer(0.0, 0.4), Layer(0.45, 1.0)):
        assert 1.5 * 30.0**2 * elastic_layer.sigma(body, 1.0, 30.0) == pytest.approx(1.0, abs=1e-6)


def test_slip_of_a_glue_line() -> None:
    assert (slip(np.inf), slip(1.0), slip(0.0)) == (0.0, 0.5, 1.0)
    for bad in (-0.1, np.nan):
        with pytest.raises(InvalidInput, match="glue_stiffness"):
            slip(bad)
    with pytest.raises(InvalidInput, match="poisson_ratio"):
        Layer(0.51)
    with pytest.raises(InvalidInput, match="slip"):
        Layer(0.5, 1.1)
