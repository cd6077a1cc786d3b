"""Noise levels brought to rest at given predictions.

What only enters the covariance (gain and position scatter, line level, and a mechanism's spread or pick-up) moves by
Newton steps on the likelihood of the predictions at hand, which costs no model evaluation.
"""

from dataclasses import replace

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.inference.frf_products import FrfProducts
from underskin.diagnosis.inference.objective import Evaluator
from underskin.diagnosis.inference.points import Evaluated
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.units import Floats


class SettlingEvaluator(Evaluator):
    """Evaluates points, and moves their covariance parameters towards the least cost."""

    def settle(self, at: Evaluated, steps: int, held: int | None = None) -> Evaluated:
        """Newton steps of the covariance parameters, one of which may be held, at fixed predictions.

        Several of a mechanism's own hang together, so that steps of one at a time would creep.
        """
        if isinstance(at.products, FrfProducts) and not self.own.size and self.hypotheses[0].model.pickup is None:
            return self._settled_apart(at, at.products, steps, held)
        from underskin.diagnosis.inference.settle_kernel import LARGEST_STEP, LEAST_GAIN, SHORTER, TRIES

        low, high = self._lowest, self._highest
        points, cost, moving = at.points, at.cost.copy(), np.arange(len(at))
        products = at.products.values
        for _ in range(steps):
            part = Evaluated(points, products, cost.copy()).some(moving)
            gradient, hessian = self.covariance_equations(part, first_mixed=self._common)
            if held is not None:
                hessian[:, held, :] = hessian[:, :, held] = gradient[:, held] = 0.0
            eigenvalues, vectors = np.linalg.eigh(hessian)
            along = np.einsum("nij,ni->nj", vectors, gradient) / np.maximum(np.abs(eigenvalues), 1.0)
            step = -np.einsum("nij,nj->ni", vectors, along)
            here = part.points.covariance
            outwards = ((here <= low) & (step < 0)) | ((here >= high) & (step > 0))
            step = np.where(outwards, 0.0, step)
            step *= np.minimum(1.0, LARGEST_STEP / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
            covariance, reached, gained = here.copy(), part.cost.copy(), np.zeros(len(part))
            trying = np.arange(len(part))
            for _ in range(TRIES):
                tried = np.clip(here[trying] + step[trying], low, high)
                costs = self.costs(part.some(trying), tried[:, None])[:, 0]
                lower = costs < part.cost[trying]
                better = trying[lower]
                covariance[better], reached[better] = tried[lower], costs[lower]
                gained[better] = part.cost[better] - costs[lower]
                trying = trying[~lower]
                if not len(trying):
                    break
                step = step / SHORTER
            whole = points.covariance.copy()
            whole[moving] = covariance
            points = self.with_covariance(points, whole)
            cost[moving] = reached
            moving = moving[gained >= LEAST_GAIN]
            if not len(moving):
                break
        return Evaluated(points, at.products, cost, at.growth)

    def _settled_apart(self, at: Evaluated, products: FrfProducts, steps: int, held: int | None) -> Evaluated:
        """The same where no mechanism acts on the covariance: each parameter moves on its own."""
        from underskin.diagnosis.inference.settle_kernel import settle

        covariance, cost = at.points.covariance.copy(), at.cost.copy()
        about_means, numbers = self.lines.about_means
        place = products.place_slopes
        size = np.zeros((len(at), 0)) if place is None or not self.placed else place[0] ** 2 + place[1] ** 2
        settle(
            *map(contiguous, (products.level, products.uu, products.uy, products.yy, size)),
            self.lines.sensor,
            contiguous(at.points.bend),
            self.curvature.laplacian,
            self.curvature.square,
            about_means,
            float(numbers),
            SENSOR_SPREAD,
            self.placed,
            self._covariance_prior,
            self._lowest,
            self._highest,
            steps,
            -1 if held is None else held,
            covariance,
            cost,
        )
        return replace(at, points=replace(at.points, covariance=covariance), cost=cost)

    def covariance_equations(self, at: Evaluated, *, first_mixed: int = 0) -> tuple[Floats, Floats]:
        """Gradient and Hessian of the costs in the covariance parameters, by differences; without mixed terms of the
        parameters before the `first_mixed`."""
        from underskin.diagnosis.inference.settle_kernel import STEP

        here = at.points.covariance
        count = here.shape[1]
        steps = STEP * np.eye(count)
        # Far enough inside the bounds for the differences
        centre = np.clip(here, self._lowest + 2 * STEP, self._highest - 2 * STEP)
        pairs = [(a, b) for a in range(count) for b in range(first_mixed, a)]
        both = [steps[a] + steps[b] for a, b in pairs]
        shifts = np.array([np.zeros(count), *steps, *-steps, *both, *(-step for step in both)])
        costs = self.costs(at, centre[:, None] + shifts)
        middle, up, down = costs[:, :1], costs[:, 1 : count + 1], costs[:, count + 1 : 2 * count + 1]
        alone = up + down - 2 * middle
        gradient = (up - down) / (2 * STEP)
        hessian = alone[:, :, None] / STEP**2 * np.eye(count)
        together = costs[:, 2 * count + 1 :].reshape(len(at), 2, -1).sum(axis=1) - 2 * middle
        for place, (a, b) in enumerate(pairs):
            hessian[:, a, b] = (together[:, place] - alone[:, a] - alone[:, b]) / (2 * STEP**2)
            hessian[:, b, a] = hessian[:, a, b]
        return gradient + np.einsum("nij,nj->ni", hessian, here - centre), hessian
