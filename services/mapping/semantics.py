"""The semantic layer L: a factor graph over region types (Figure semantic-graph).

Variables are the type l_R of a region, the appearance a_n of each of its nodes, and lambda_R, what
an utterance would call it; observed are the classifier's outputs i_n and the correspondence phi_R.

    i_n -- [P(i|a)] -- a_n -- [P(a|l)] -- l_R -- [P(lambda|l, phi)] -- lambda_R

The graph is a forest, so that messages in closed form are exact. With phi_R = 0 the language factor
is flat: an utterance about something else says nothing about this region's type. With phi_R = 1 its
message to lambda_R is how well the region explains being called that; in a particle that grounds
the utterance to R it enters the weight.
"""

import numpy as np

from schemas.arrays import Floats, Ints

_atypical = 0.1
"""P(a != l): a corner of a kitchen that looks like a lounge."""
_misnamed = 0.01
"""P(lambda != l | phi = 1): people call a place by another name."""


def appearance_message(classifier_log: Floats) -> Floats:
    """From nodes to their region's type: log sum_a P(i|a) P(a|l), from log P(i|a) (n, T)."""
    return _through(classifier_log, _atypical)


def type_belief(messages: Floats, region: Ints, count: int) -> tuple[Floats, Floats]:
    """Log distributions of l_R (R, T) under a flat prior, and the log evidence (R,).

    Args:
        messages: of the nodes (n, T), log.
        region: (n,) region of each node.
        count: number of regions R; those without nodes are believed to be anything.
    """
    types = messages.shape[1]
    joint = np.full((count, types), -np.log(types))
    np.add.at(joint, region, messages)
    evidence = np.logaddexp.reduce(joint, axis=1)
    return joint - evidence[:, None], evidence


def name_message(type_log: Floats) -> Floats:
    """From regions to what they are called: log sum_l P(lambda | l, phi=1) P(l) (R, T)."""
    return _through(type_log, _misnamed)


def _through(log_values: Floats, confusion: float) -> Floats:
    """Sum out a variable that equals its neighbour except for `confusion` among the others."""
    types = log_values.shape[1]
    top = log_values.max(axis=1, keepdims=True, initial=-np.inf)
    values = np.exp(log_values - top)
    other = confusion / max(types - 1, 1)
    mixed = (1 - confusion) * values + other * (values.sum(axis=1, keepdims=True) - values)
    return np.log(mixed) + top
