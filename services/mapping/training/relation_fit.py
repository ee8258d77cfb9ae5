"""Maximum likelihood of a relation: a Gaussian linear in features, beside answers that miss it.

Expectation maximisation: every example is weighted with the probability that its annotator meant
the relation; with these weights each axis is fitted by L-BFGS to

    sum_n w_n [ (x_n - m . phi_n)^2 / s_n + log s_n ] / 2 + ridge . (m - m_0)^2 / 2,
    s_n = c . phi_n^2,  c >= 0

where m_0 are the defaults, so that what the data leave open stays as it is without data. That a
figure stands clear of a thing however large it is, is geometry: the weights of sizes hardly move.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from schemas.arrays import Floats
from services.mapping.relations import Axis, Directed, Frame, Radial, Relation, features, residual
from services.mapping.training.utterances import Examples

_rounds = 12
_sizes = ("figure_radius", "depth", "width")
_ridge = np.where(np.isin(features, _sizes), 300.0, 4.0)
_outlier_shares = (0.005, 0.02)
"""The share is kept within these: a skewed relation would take more of it than of error, and a
robot that reckons with more error looks everywhere before it looks farther."""
_least_variance = 0.05**2


@dataclass(frozen=True)
class _Coordinate:
    """One axis to be fitted."""

    value: Floats
    """(n,) [m]"""
    phi: Floats
    """(n, D)"""
    default: Floats
    """(D,)"""


def fit_relation(examples: Examples, default: Relation) -> Relation:
    """The relation of the default's form under which the examples are most likely."""
    coordinates = _coordinates(examples, default)
    axes = [Axis(one.default, _first_variance(one)) for one in coordinates]
    relation = Relation(_shape(axes), 0.02, default.outlier_spread)
    for _ in range(_rounds):
        meant = 1 - _outlier_probability(relation, examples)
        axes = [_fit_axis(one, meant, axis) for one, axis in zip(coordinates, axes, strict=True)]
        share = float(np.clip(np.mean(1 - meant), *_outlier_shares))
        squares = np.sum(examples.offset**2, axis=1) / 2
        spread = float(np.sqrt(np.average(squares, weights=1 - meant + 1e-6)))
        relation = Relation(_shape(axes), share, spread)
    return relation


def mean_log_density(relation: Relation, examples: Examples) -> float:
    """Of the examples, as the filter would judge figures that it sees."""
    return float(np.mean(_log_density(relation, examples)))


def _log_density(relation: Relation, examples: Examples) -> Floats:
    return relation.log_density(_frame(examples), examples.offset, examples.phi, residual**2)


def _outlier_probability(relation: Relation, examples: Examples) -> Floats:
    """That an annotator did not mean the relation (n,)."""
    shape = relation.shape.log_density(_frame(examples), examples.offset, examples.phi, residual**2)
    meant = np.log1p(-relation.outlier_share) + shape
    return 1 - np.exp(meant - _log_density(relation, examples))


def _frame(examples: Examples) -> Frame:
    """Examples are in the frame of their landmark already."""
    n = len(examples.offset)
    u, v = np.tile([1.0, 0.0], (n, 1)), np.tile([0.0, 1.0], (n, 1))
    return Frame(u, v, examples.phi[:, features.index("distance")], of_robot=False)


def _coordinates(examples: Examples, default: Relation) -> list[_Coordinate]:
    if isinstance(default.shape, Radial):
        values = [np.linalg.norm(examples.offset, axis=1)]
    else:
        values = list(examples.offset.T)
    axes = axes_of(default)
    return [
        _Coordinate(value, examples.phi, axis.mean)
        for value, axis in zip(values, axes, strict=True)
    ]


def axes_of(relation: Relation) -> list[Axis]:
    """Along u and v, or over the distance."""
    shape = relation.shape
    if isinstance(shape, Radial):
        return [shape.distance]
    assert isinstance(shape, Directed)
    return [shape.along, shape.across]


def _shape(axes: list[Axis]) -> Radial | Directed:
    return Radial(axes[0]) if len(axes) == 1 else Directed(axes[0], axes[1])


def _first_variance(coordinate: _Coordinate) -> Floats:
    off = coordinate.value - coordinate.phi @ coordinate.default
    size = np.mean(coordinate.phi**2, axis=0)
    # A feature that never occurs has no say.
    return np.where(size > 0, np.mean(off**2) / np.maximum(size, 1e-6) / len(size), 0.0)


def _fit_axis(coordinate: _Coordinate, meant: Floats, start: Axis) -> Axis:
    phi, value, count = coordinate.phi, coordinate.value, coordinate.phi.shape[1]
    square = phi**2

    def loss(both: Floats) -> tuple[float, Floats]:
        mean, variance = np.split(both, 2)
        off, spread = value - phi @ mean, square @ variance + _least_variance
        from_default = mean - coordinate.default
        total = np.sum(meant * (off**2 / spread + np.log(spread)))
        total += np.sum(_ridge * from_default**2)
        slope_mean = -phi.T @ (meant * off / spread) + _ridge * from_default
        slope_variance = square.T @ (meant * (1 / spread - (off / spread) ** 2)) / 2
        return 0.5 * float(total), np.concatenate([slope_mean, slope_variance])

    first = np.concatenate([start.mean, np.maximum(start.variance, 0.0)])
    bounds = [(None, None)] * count + [(0.0, None)] * count
    found = minimize(loss, first, jac=True, bounds=bounds, method="L-BFGS-B")
    mean, variance = np.split(found.x, 2)
    variance[features.index("one")] += _least_variance
    return Axis(mean, variance)
