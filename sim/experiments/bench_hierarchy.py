"""HDCG against DCG: the same answers from fewer symbols, in less time (paper, sec:nlu)."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from services.grounding.dcg import CorrespondenceGraph
from services.grounding.hdcg import HierarchicalGraph
from services.grounding.model import GroundingModel
from services.grounding.tree import parse_bracket
from services.grounding.understanding import Understanding
from sim.experiments.report import (
    Peer,
    Row,
    bootstrap_median_interval,
    rate_row,
    time_row,
)

FLAT = "DCG, the same without pruning"


def hierarchy_rows(
    robot: str, model: GroundingModel, texts: Sequence[str], rng: Generator
) -> list[Row]:
    """Agreement, pruning and time of a robot whose symbols a first pass prunes; none of others."""
    if model.weights.rules is None:
        return []
    flat = GroundingModel(model.lexicon, replace(model.weights, rules=None))
    hierarchical, ours_ms = _understand_all(model, texts)
    plain, flat_ms = _understand_all(flat, texts)
    agree = [_best(a) == _best(b) for a, b in zip(hierarchical, plain, strict=True)]
    ratios = [_pruning(model, one.parse) for one in hierarchical if one.parse]
    fewer = Row(
        row=robot,
        metric="symbols scored by DCG for each scored by HDCG",
        unit="",
        better="higher",
        ours=float(np.median(ratios)),
        interval=bootstrap_median_interval(ratios, rng),
    )
    peer = Peer(FLAT, float(np.median(flat_ms)))
    return [
        rate_row(robot, "HDCG and DCG agree on the best answer", agree),
        fewer,
        time_row(robot, "annotation inference by HDCG", ours_ms, rng, peer=peer),
    ]


def _understand_all(
    model: GroundingModel, texts: Sequence[str]
) -> tuple[list[Understanding], list[float]]:
    """What a model makes of each text, and how long it took [ms]."""
    found: list[Understanding] = []
    times: list[float] = []
    for text in texts:
        started = time.perf_counter()
        found.append(model.understand(text))
        times.append(1000 * (time.perf_counter() - started))
    return found, times


def _pruning(model: GroundingModel, parse: str) -> float:
    """How many times fewer factors two passes evaluate than one, for the tree of a sentence."""
    assert model.weights.rules is not None
    tree = parse_bracket(parse)
    one = CorrespondenceGraph(model.features, model.weights.factors)
    two = HierarchicalGraph(model.features, model.weights.factors, model.weights.rules)
    one.infer(tree)
    two.infer(tree)
    return one.scored / two.scored


def _best(found: Understanding) -> object:
    """The best annotation and behaviour without their probabilities."""
    annotation = found.annotations[0] if found.annotations else None
    intent = next(iter(found.intents), None)
    acts = intent is not None and intent.probability >= found.statement_mass
    said = (annotation.objects, annotation.relations) if annotation else None
    return said, replace(intent, probability=1.0) if acts and intent else None
