# SPDX-License-Identifier: Apache-2.0
"""Least squares where residuals and derivatives are Monte Carlo estimates themselves.

Products of two noisy numbers are biased: own noise makes J^T J too large, so that steps are too short, and pulls J^T r
towards solutions with less noise. Products of independent samples are not. `cross_equations` averages the products of
every pair of different samples (a U-statistic, W. Hoeffding 1948); two samples are enough. What is left is noise, so
the matrix may be indefinite and `SafeMatrix` raises its eigenvalues.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .bounded_least_squares import NormalEquations
from .box_quadratic import minimise_in_box
from .leverage import residuals_left_out

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


class CrossProducts:
    """Sums over samples X (n, 1 + k), the residual and its derivatives, that give every product of two of them.

    `fade` makes all samples so far count less: a sample of long ago was taken where the derivatives were others.
    """

    def __init__(self, rows: int, columns: int) -> None:
        self.total: Vector = np.zeros((rows, columns))
        self._own: Vector = np.zeros((columns, columns))
        self._weight = 0.0
        self._weight_squares = 0.0

    def add(self, sample: Array, weight: float = 1.0) -> None:
        """Take one more sample; `weight` is best proportional to 1 over its variance."""
        sample = sample.astype(np.float64)
        self.total += weight * sample
        self._own += weight**2 * (sample.T @ sample)
        self._weight += weight
        self._weight_squares += weight**2

    def fade(self, factor: float) -> None:
        """Multiply the weight of all samples so far."""
        self.total *= factor
        self._own *= factor**2
        self._weight *= factor
        self._weight_squares *= factor**2

    @property
    def mean(self) -> Vector:
        """The mean sample (n, 1 + k)."""
        return self.total / max(self._weight, 1e-30)

    def gram(self) -> Vector:
        """The mean product of two different samples (1 + k, 1 + k), per row."""
        pairs = self._weight**2 - self._weight_squares
        return (self.total.T @ self.total - self._own) / (max(pairs, 1e-30) * len(self.total))

    def gradient_noise(self, rows_of_group: int) -> Vector:
        """Covariance (k, k) of the gradient of `cross_equations`, from its scatter over groups of rows.

        Rows that share their noise, such as the channels of a tile, belong to one group of `rows_of_group`.
        """
        rows = self._groups(rows_of_group)
        return self._scatter(rows[:, :, 1:], rows[:, :, :1])

    def jackknife_noise(self, rows_of_group: int, matrix: SafeMatrix) -> Vector:
        """`gradient_noise` where few groups rule the solution; `matrix` is that of the equations.

        Each of them counts with the residual that a solution without it would leave (`leverage`).
        """
        rows = self._groups(rows_of_group)
        derivatives, residual = rows[:, :, 1:], rows[:, :, :1]
        inverse = matrix.inverse / len(self.total)
        inverse[matrix.blind] = inverse[:, matrix.blind] = 0.0
        return self._scatter(derivatives, residuals_left_out(derivatives, residual, inverse))

    def _groups(self, rows_of_group: int) -> Vector:
        return self.mean.reshape(-1, rows_of_group, self.total.shape[1])

    def _scatter(self, derivatives: Vector, residual: Vector) -> Vector:
        """Covariance of a sum over groups of derivatives (g, n, k) by residuals (g, n, 1), per row."""
        groups = (derivatives.transpose(0, 2, 1) @ residual)[:, :, 0]
        groups = groups - groups.mean(axis=0)
        count = len(groups)
        return groups.T @ groups * (count / max(count - 1, 1)) / len(self.total) ** 2

    def own_share(self) -> Vector:
        """Which part (k,) of the variances in `gradient_noise` is the samples' own, so that more of them take it away.

        Of the mean residual's square a part r is own noise, of the mean derivative's a part d. Both are independent, so
        1 - (1 - r) (1 - d) of their product's is.
        """
        single = np.diag(self._own) / max(self._weight_squares, 1e-30)
        shared = np.maximum(np.diag(self.gram()) * len(self.total), 0.0)
        own = np.maximum(single - shared, 0.0) * self._weight_squares / max(self._weight**2, 1e-30)
        left = shared / np.maximum(shared + own, 1e-300)
        return 1.0 - left[0] * left[1:]

    def shifted(self, step: Vector) -> None:
        """Count the residuals from a point `step` further on, by the samples' own derivatives."""
        # sums of X T with T = [[1, 0], [step, 1]] instead of X
        change = np.eye(len(self._own))
        change[1:, 0] = step
        self.total = self.total @ change
        self._own = change.T @ self._own @ change


def cross_equations(gram: Vector) -> NormalEquations:
    """Half the squared residual, its gradient and matrix from a gram matrix (1 + k, 1 + k)."""
    return NormalEquations(0.5 * float(gram[0, 0]), gram[1:, 0].copy(), gram[1:, 1:].copy())


class SafeMatrix:
    """The matrix of noisy equations with its eigenvalues raised, so that it can be inverted.

    `width` scales the unknowns. After scaling by the diagonal no eigenvalue is below `FLOOR`; a column whose product
    with itself is negative counts as one without effect (`blind`), so its products with others are noise, too.
    """

    FLOOR = 0.03
    SURE = 0.003  # the same in a covariance: a step must not follow noise, but what trades against another is not sure

    def __init__(self, equations: NormalEquations, width: Vector) -> None:
        hessian = equations.hessian * np.outer(width, width)
        diagonal = np.diag(hessian)
        self.blind = diagonal <= 1e-6 * max(float(diagonal.max()), 1e-12)
        self._width = width
        self.scale: Vector = np.sqrt(np.maximum(diagonal, 1e-4 * max(float(diagonal.max()), 1e-12))) / width
        scaled = equations.hessian / np.outer(self.scale, self.scale)
        scaled[self.blind] = scaled[:, self.blind] = 0.0
        self._raw, self.vectors = np.linalg.eigh(scaled)
        self.values: Vector = np.maximum(self._raw, self.FLOOR)

    def covariance(self, noise: Vector, floor: float = SURE) -> Vector:
        """Covariance (k, k) of the solution: the sandwich H^-1 noise H^-1 (P. Huber 1967; H. White 1980).

        A column without effect may lie anywhere in its width, and none is less sure than that.
        """
        inverse = self._inverse_of(floor)
        result = inverse @ noise @ inverse
        sd = np.sqrt(np.maximum(np.diag(result), 1e-300))
        shrink = np.minimum(self._width / sd, 1.0)
        result *= np.outer(shrink, shrink)
        result[self.blind] = result[:, self.blind] = 0.0
        result[self.blind, self.blind] = self._width[self.blind] ** 2
        return result

    def solution_covariance(self, noise: Vector) -> Vector:
        """The sandwich itself, however wide it is."""
        return self.inverse @ noise @ self.inverse

    def expected_error(self, noise: Vector) -> float:
        """Mean square of the weighted rows that noise of this covariance in the gradient leaves at the solution."""
        return float(np.trace(self.inverse @ noise))

    @cached_property
    def inverse(self) -> Vector:
        """The inverse (k, k)."""
        return self._inverse_of(self.FLOOR)

    def _inverse_of(self, floor: float) -> Vector:
        values = np.maximum(self._raw, floor)
        return (self.vectors / values) @ self.vectors.T / np.outer(self.scale, self.scale)


def cautious_step(
    equations: NormalEquations,
    lower: Vector,
    upper: Vector,
    width: Vector,
    damping: float,
    noise: Vector | None = None,
) -> Vector:
    """The step within lower <= s <= upper (0 inside) that minimises the damped quadratic of the safe matrix.

    Along each eigenvector the gradient is shrunk by 1 - 1 / z^2, z its size in standard deviations by its covariance
    `noise`: what noise alone explains moves nothing. Nor does a column without effect.
    """
    safe = SafeMatrix(equations, width)
    matrix = (safe.vectors * safe.values) @ safe.vectors.T + damping * np.eye(len(width))
    gradient = np.where(safe.blind, 0.0, equations.gradient / safe.scale)
    if noise is not None:
        along = safe.vectors.T @ gradient
        spread = np.diag(safe.vectors.T @ (noise / np.outer(safe.scale, safe.scale)) @ safe.vectors)
        share = np.divide(spread, along**2, out=np.ones_like(along), where=along**2 > spread)
        gradient = safe.vectors @ (along * (1.0 - share))
    return minimise_in_box(matrix, gradient, lower * safe.scale, upper * safe.scale) / safe.scale
