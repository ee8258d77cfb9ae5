"""What the robot could do next, as places to draw."""

import numpy as np

from schemas.arrays import Floats
from schemas.task import Decision

_shown = 16
_apart = 0.6


def cheapest_places(decision: Decision) -> tuple[Floats, Floats]:
    """Positions (N, 2) [m] and costs (N,) of the best candidates, cheapest first.

    Many candidates are about one place, seen from different sides: of those the cheapest counts.
    """
    order = np.argsort(decision.costs, kind="stable")
    order = order[np.isfinite(decision.costs[order])]
    kept: list[int] = []
    for row in order.tolist():
        gaps = np.hypot(*(decision.positions[kept] - decision.positions[row]).T)
        if len(kept) < _shown and np.all(gaps > _apart):
            kept.append(row)
    return decision.positions[kept], decision.costs[kept]
