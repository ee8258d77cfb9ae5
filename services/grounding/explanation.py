"""What the correspondence graph says at every phrase of a tree, for people to look at."""

from dataclasses import dataclass

import numpy as np

from services.grounding.dcg import CorrespondenceGraph
from services.grounding.model import GroundingModel
from services.grounding.possession import spelled_out
from services.grounding.tree import Phrase, parse_bracket
from services.grounding.understanding import Understanding

NEGLIGIBLE_SYMBOL = 0.01
"""Symbols below this probability are not worth a line."""


@dataclass(frozen=True)
class PhraseReading:
    """One phrase λ_i with its correspondence variables (paper, sec:nlu)."""

    phrase: Phrase
    symbols: tuple[tuple[str, float], ...]
    """Symbols with the probability that each is true here, best first."""
    best: tuple[str, ...]
    """The most probable set of true symbols."""
    probability: float
    """Of that set."""


def read_phrases(model: GroundingModel, understanding: Understanding) -> tuple[PhraseReading, ...]:
    """Every phrase of the best tree, parents first; none where there is no tree.

    The whole symbol space is scored, also for a robot whose own inference prunes it. The phrases
    are those of the parser, but for "contains the ball", which is read as "has the ball in it".
    """
    if not understanding.parse:
        return ()
    graph = CorrespondenceGraph(model.features, model.weights.factors)
    tree = parse_bracket(understanding.parse)
    read = tuple(spelled_out(tree).preorder())
    said = tuple(tree.preorder())
    shown = said if len(said) == len(read) else read
    pairs = zip(read, shown, strict=True)
    return tuple(_reading(phrase, as_said, graph, model) for phrase, as_said in pairs)


def _reading(
    phrase: Phrase, shown: Phrase, graph: CorrespondenceGraph, model: GroundingModel
) -> PhraseReading:
    marginals = graph.marginals(phrase)
    likely = np.flatnonzero(marginals >= NEGLIGIBLE_SYMBOL)
    ranked = likely[np.argsort(-marginals[likely], kind="stable")].tolist()
    best, probability = next(iter(graph.infer(phrase).items()))
    return PhraseReading(
        phrase=shown,
        symbols=tuple((model.table.text(at), float(marginals[at])) for at in ranked),
        best=tuple(model.table.text(at) for at in sorted(best)),
        probability=probability,
    )
