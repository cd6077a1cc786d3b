"""Accuracy of the shipped table: against exact values, against fresh finite-element solves, and its own report."""

import os

import numpy as np

from bench.figures import Figure
from tablegen import linear_layer
from tablegen.sigma import Nodes, solve_column
from tests.support.oracle import linear_layer_values
from underskin.surrogate.sigma_table import SigmaTable, load_table

FRESH_POINTS = 50
REFERENCE = ([1e-3, 1e-2, 3e-2, 1e-1], [1.01293, 1.02966, 1.04522, 1.07489])  # Richardson, ± 5e-5


def measure() -> list[Figure]:
    """Largest errors over the domain; lower is better."""
    table = load_table()
    return [*_linear(table), *_finite_strain(table), *_report(table)]


def _linear(table: SigmaTable) -> list[Figure]:
    generator = np.random.default_rng(1)
    a, rho = generator.uniform(0, 3, 300), generator.uniform(0, 3, (300, 1))
    error = np.abs(table.sigma(a, rho).sigma / linear_layer.sigma(a, rho) - 1).max()
    figures = [_bound("σ at L = 0 against the exact layer, 90,000 points", error, 1e-5)]
    if "UNDERSKIN_ORACLE" in os.environ:
        rho, a, offset, value = linear_layer_values("sigma_hertz")
        used = (offset == 0) & (value > 0.01) & (a <= 3) & (rho <= 3)
        error = np.abs(table.sigma(a[used], rho[used]).sigma / value[used] - 1).max()
        figures.append(_bound(f"σ at L = 0 against {used.sum()} independent values", error, 1e-5))
    force = float(table.attributes["force_balance_error"])
    return [
        *figures,
        _bound("the elements' own σ at L = 0, worst of the table's nodes", np.abs(table.fem_linear_error).max(), None),
        _bound("total force on the base over the load, minus 1", force, 1e-6),
    ]


def _finite_strain(table: SigmaTable) -> list[Figure]:
    load, ratio = REFERENCE
    ratios = table.sigma(0.3, 0.6, load).sigma / table.sigma(0.3, 0.6).sigma
    errors, shares = zip(*(_fresh(table, number) for number in range(FRESH_POINTS)), strict=True)
    return [
        _bound("σ(L)/σ(0) at a/h 0.3, rT/h 0.6 against four reference values", np.abs(ratios - ratio).max(), 1e-4),
        _bound(f"σ against {FRESH_POINTS} fresh solves, mesh twice as fine", max(errors), 1e-4),
        Figure("the same error over the reported one, largest", max(shares), "", 1.0, "lower"),
    ]


def _fresh(table: SigmaTable, number: int) -> tuple[float, float]:
    """Error at a random point and at the point sensor there: relative, and as a share of the reported one."""
    generator = np.random.default_rng([50, number])
    a = generator.uniform(0.02, 0.5) if number % 3 == 0 else generator.uniform(0, 3)
    rho, load = generator.uniform(0, 3), generator.uniform(0, 0.1)
    rho_nodes = np.array([0.0, rho])
    nodes = Nodes(np.zeros(1), rho_nodes, np.cbrt([0.0, load / 4, load]), np.zeros(1))
    fresh = linear_layer.sigma(a, rho_nodes) + solve_column(a, nodes, order=5, refinement=2).sigma_change[:, -1]
    answer = table.sigma(a, rho_nodes, load)
    error = np.abs(answer.sigma / fresh - 1)
    return float(error.max()), float((error / answer.rel_error).max())


def _report(table: SigmaTable) -> list[Figure]:
    generator = np.random.default_rng(2)
    error = table.sigma(*(generator.uniform(low, high, 100_000) for low, high in table.domain.values())).rel_error
    return [
        _bound("reported error of σ, median over the domain", np.median(error), 2e-5),
        _bound("reported error of σ, largest", error.max(), 1e-4),
    ]


def _bound(name: str, value: float, target: float | None) -> Figure:
    return Figure(name, float(value), "", target, "lower")
