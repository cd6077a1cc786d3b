"""Gaussian processes over an axis: Matérn-3/2, as features at landmarks (Nyström), so that time is linear in rows."""

import numpy as np

from underskin.units import Floats

AMPLITUDES = np.array([0.015, 0.05, 0.15, 0.5])  # of an unmodelled discrepancy, relative to the model, equally probable
LANDMARKS = 24


def matern(distance: Floats) -> Floats:
    """The covariance at a distance, over the process' length."""
    scaled = np.sqrt(3.0) * distance
    return (1 + scaled) * np.exp(-scaled)


def features(axis: Floats, length: float, landmarks: int = LANDMARKS) -> Floats:
    """Features whose products are the process' covariance, at up to so many places (rows, landmarks)."""
    values = np.unique(np.round(axis, 9), axis=0)
    chosen = values[np.unique(np.linspace(0, len(values) - 1, landmarks).round().astype(int))]

    def kernel(a: Floats, b: Floats) -> Floats:
        return matern(np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2)) / length)

    root = np.linalg.cholesky(kernel(chosen, chosen) + 1e-8 * np.eye(len(chosen)))
    return np.linalg.solve(root, kernel(chosen, axis)).T


def normalised(column: Floats) -> Floats:
    """An axis (rows, 1 or 2) from 0 to 1 over its range."""
    return (column - column.min(axis=0)) / np.ptp(column, axis=0).max()
