"""Learns every relation from its examples and says how good it is on examples kept apart."""

from collections.abc import Callable

import numpy as np

from services.mapping.relation_table import (
    AxisName,
    AxisWeights,
    RelationFile,
    RelationWeights,
    defaults,
)
from services.mapping.relations import Axis, Radial, Relation, features
from services.mapping.training.acceptability import degrees
from services.mapping.training.practice import practised
from services.mapping.training.relation_fit import axes_of, fit_relation, mean_log_density
from services.mapping.training.utterances import sample_examples

SEED = 7
SCENES = 2500
"""For each relation."""
HELD_OUT = 5
"""One example of so many is not fitted to."""

Progress = Callable[[str], None]


def train_relations(scenes: int, seed: int, progress: Progress) -> RelationFile:
    """Weights of all relations; the same scenes and seed give the same weights.

    Of a word that is practised half of the examples are from the practice worlds.
    """
    learned = {}
    for number, name in enumerate(degrees):
        learned[name] = one = _train(name, scenes, np.random.default_rng([seed, number]))
        progress(
            f"{name}: {one.count} examples, held-out log density {one.held_out:.3f}, "
            f"{one.held_out_default:.3f} without learning"
        )
    return RelationFile(
        source="python -m services.mapping.training: annotators of scenes, and practice worlds",
        seed=seed,
        scenes=scenes,
        relations=learned,
    )


def _train(name: str, scenes: int, rng: np.random.Generator) -> RelationWeights:
    annotated = sample_examples(name, scenes, rng)
    examples = annotated.joined(practised(name, len(annotated.offset)))
    kept_apart = np.arange(len(examples.offset)) % HELD_OUT == 0
    fitted, held_out = examples.take(~kept_apart), examples.take(kept_apart)
    relation = fit_relation(fitted, defaults[name])
    return RelationWeights(
        axes=_axes(relation),
        outlier_share=_rounded(relation.outlier_share),
        outlier_spread=_rounded(relation.outlier_spread),
        count=len(fitted.offset),
        held_out=_rounded(mean_log_density(relation, held_out)),
        held_out_default=_rounded(mean_log_density(defaults[name], held_out)),
    )


def _axes(relation: Relation) -> dict[AxisName, AxisWeights]:
    names: tuple[AxisName, ...] = ("u", "v")
    if isinstance(relation.shape, Radial):
        names = ("distance",)
    return {name: _weights(axis) for name, axis in zip(names, axes_of(relation), strict=True)}


def _weights(axis: Axis) -> AxisWeights:
    mean = zip(features, axis.mean.tolist(), strict=True)
    variance = zip(features, axis.variance.tolist(), strict=True)
    return AxisWeights(
        mean={name: _rounded(value) for name, value in mean if _rounded(value)},
        variance={name: _rounded(value) for name, value in variance if _rounded(value)},
    )


def _rounded(value: float) -> float:
    """Coarser than what differs from machine to machine."""
    return round(value, 3)
