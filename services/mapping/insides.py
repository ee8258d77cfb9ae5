"""What was looked into: things in a box are hidden from everywhere but above.

That the ground about a box was looked at says nothing of what the box holds. A look into it does:
it is the negative evidence (Eq. likelihood_appearance) for all that lies "inside".
"""

import numpy as np

from schemas.arrays import Floats, Ints

log_missed_at_most = float(np.log(0.002))
"""No box is ever ruled out further than this by one look, as places are not."""


class Insides:
    """By the ids of seen things: how likely it is that something in them was missed.

    Args:
        classes: C of the map's vocabulary.
    """

    def __init__(self, classes: int) -> None:
        self._classes = classes
        self._log_missed: dict[int, Floats] = {}

    def look(self, number: int, seen: float, missing: Ints) -> None:
        """Take a look into a thing.

        Args:
            number: id of the thing.
            seen: share of its floor that was in view.
            missing: indices (N,) of the classes that were sought there and not found.
        """
        log_missed = self._log_missed.setdefault(number, np.zeros(self._classes))
        miss = 1.0 - min(max(seen, 0.0), 1.0) * (1.0 - np.exp(log_missed_at_most))
        log_missed[missing] += np.log(miss)

    def log_missed(self, numbers: Ints, class_index: int) -> Floats:
        """Log probability (n,) that a thing of a class would have been missed in things (n,)."""
        known = {n: float(one[class_index]) for n, one in self._log_missed.items()}
        return np.array([known.get(number, 0.0) for number in numbers.tolist()], np.float64)
