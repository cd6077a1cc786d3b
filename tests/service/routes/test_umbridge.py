"""UM-Bridge with the protocol's own client package, over HTTP to a real server."""

from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest
import umbridge

from underskin import load_table
from underskin.units import Floats

POINTS: dict[str, list[list[float]]] = {
    "sigma": [[0.3, 0.6, 0.01], [0.01, 0.0, 0.05], [2.9, 2.9, 1e-4], [1.0, 0.3, 0.09]],
    "frf": [[2.5, 16.0, 1.5, 4.0, 1.0, 14.0], [2.5, 16.0, 1.5, 4.0, 3.0, -22.0], [1.0, 2.0, 2.5, 10.0, 0.5, 30.0]],
}
TABLE = load_table()


def model(server_url: str, name: str) -> Any:
    """The client's view of a model."""
    return umbridge.HTTPModel(f"{server_url}/umbridge", name)


def test_models_and_what_they_support(server_url: str) -> None:
    assert umbridge.supported_models(f"{server_url}/umbridge") == ["sigma", "frf"]
    for name, points in POINTS.items():
        served = model(server_url, name)
        assert served.get_input_sizes() == [len(points[0])]
        assert served.get_output_sizes() == [1]
        assert served.supports_evaluate()
        assert served.supports_gradient()
        assert served.supports_apply_jacobian()
        assert not served.supports_apply_hessian()


def test_sigma_is_the_tables(server_url: str) -> None:
    served = model(server_url, "sigma")
    corners = [[0.0, 0.0, 0.0], [3.0, 3.0, 0.1]]
    for a, rho, load in POINTS["sigma"] + corners:
        [[value]] = served([[a, rho, load]])
        assert value == pytest.approx(float(TABLE.sigma(a, rho, load).sigma), rel=1e-13)


def differences(served: Any, point: list[float]) -> Floats:
    """The gradient by central differences of fourth order, over HTTP."""
    slopes = np.zeros(len(point))
    for axis in range(len(point)):
        step = np.zeros(len(point))
        step[axis] = 1e-3 * point[axis]
        values = [served([(np.array(point) + factor * step).tolist()])[0][0] for factor in (-2, -1, 1, 2)]
        slopes[axis] = np.dot([1, -8, 8, -1], values) / (12 * step[axis])
    return slopes


@pytest.mark.parametrize(("name", "point"), [(name, point) for name in POINTS for point in POINTS[name] if all(point)])
def test_derivatives_agree_with_finite_differences(server_url: str, name: str, point: list[float]) -> None:
    served = model(server_url, name)
    slopes = differences(served, point)
    gradient = np.array(served.gradient(0, 0, [point], [2.5]))
    scale = np.abs(slopes * point).max()
    np.testing.assert_allclose(gradient / 2.5 * point / scale, slopes * point / scale, atol=2e-5)
    direction = np.cos(np.arange(len(point)))
    (along,) = served.apply_jacobian(0, 0, [point], direction.tolist())
    assert along == pytest.approx(gradient @ direction / 2.5, rel=1e-12)


def test_the_infinite_derivative_at_zero_load_is_an_error_of_the_protocol(server_url: str) -> None:
    served = model(server_url, "sigma")
    point = [[0.3, 0.6, 0.0]]
    with pytest.raises(Exception, match=r"InvalidInput.*load_parameter is infinite at 0"):
        served.gradient(0, 0, point, [1.0])
    with pytest.raises(Exception, match="infinite at 0"):
        served.apply_jacobian(0, 0, point, [0.0, 0.0, 1.0])
    (along,) = served.apply_jacobian(0, 0, point, [1.0, 0.0, 0.0])
    assert along == pytest.approx(float(TABLE.gradient(*point[0])[0]), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "point", "says"),
    [
        ("sigma", [3.1, 0.6, 0.01], "outside the domain"),
        ("sigma", [-0.1, 0.6, 0.01], "outside the domain"),
        ("sigma", [0.3, 0.6], "a_over_h, rt_over_h, load_parameter"),
        ("sigma", [0.3, 0.6, 0.01, 1.0], "a_over_h, rt_over_h, load_parameter"),
        ("frf", [2.5, 16.0, 1.5, 4.0, 300.0, 14.0], "outside the domain"),
        ("frf", [2.5, 16e6, 1.5, 4.0, 3.0, 14.0], "given in Pa"),
        ("frf", [2.5, 16.0, 1.5, 4.0, 0.0, 14.0], "preload_n"),
    ],
)
def test_wrong_input_is_an_error_of_the_protocol(server_url: str, name: str, point: list[float], says: str) -> None:
    served = model(server_url, name)
    operations: list[Callable[[], Any]] = [
        lambda: served([point]),
        lambda: served.gradient(0, 0, [point], [1.0]),
        lambda: served.apply_jacobian(0, 0, [point], [1.0] * len(point)),
    ]
    for operation in operations:
        with pytest.raises(Exception, match=f"InvalidInput.*{says}"):
            operation()


@pytest.mark.parametrize(
    ("operation", "body", "kind"),
    [
        ("Evaluate", {"name": "depth", "input": [[0.3, 0.6, 0.01]]}, "ModelNotFound"),
        ("Evaluate", {"name": "sigma", "input": [[0.3, 0.6, 0.01], [1.0]]}, "InvalidInput"),
        ("Evaluate", {"name": "sigma", "input": [[0.3, 0.6, True]]}, "InvalidInput"),
        ("Evaluate", {"name": "sigma"}, "InvalidInput"),
        ("Gradient", {"name": "sigma", "input": [[0.3, 0.6, 0.01]], "sens": [1.0, 2.0]}, "InvalidInput"),
        ("Gradient", {"name": "sigma", "input": [[0.3, 0.6, 0.01]], "sens": [1.0], "inWrt": 1}, "InvalidInput"),
        ("Gradient", {"name": "sigma", "input": [[0.3, 0.6, 1e-9]], "sens": [1e308]}, "InvalidInput"),
        ("ApplyJacobian", {"name": "sigma", "input": [[0.3, 0.6, 0.01]], "vec": [1.0]}, "InvalidInput"),
        ("ApplyHessian", {"name": "sigma"}, "UnsupportedFeature"),
    ],
)
def test_errors_have_the_protocols_shape(http: httpx.Client, operation: str, body: dict[str, Any], kind: str) -> None:
    answer = http.post(f"/umbridge/{operation}", json=body)
    assert answer.status_code == 400
    assert set(answer.json()) == {"error"}
    assert answer.json()["error"]["type"] == kind
    assert answer.json()["error"]["message"]
