"""Between the columns of messages and the grounding core."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.belief import MapBelief, first_topology, shared
from schemas.language import (
    Annotation,
    Annotations,
    Behaviors,
    BehaviorSymbol,
    Relation,
    Utterance,
)
from services.grounding.model import Behavior, BehaviorDistribution
from services.grounding.scene import Scene, Thing
from services.grounding.talk import Meaning
from services.grounding.understanding import Intent
from services.grounding.world import WorldObjects

_none = -1
_likely_there = 0.5
"""Existence below which a detection is too doubtful to speak of."""


@dataclass(frozen=True)
class Hypothesis:
    """One particle's map: its objects, and their ids in the belief."""

    world: WorldObjects
    nodes: NDArray[np.int32]
    """Ids (N,), in the order of the world's columns."""


def annotations_message(
    meaning: Meaning,
    implied: BehaviorDistribution,
    said: tuple[Utterance, ...],
    stamp_ns: int,
) -> Annotations:
    """What the others need to know of a meaning.

    Args:
        meaning: of an utterance.
        implied: its behaviours in the map that the best annotation implies.
        said: the conversation so far.
        stamp_ns: when the meaning became what it is.
    """
    understanding, question = meaning.understanding, meaning.question
    # An utterance about another instruction asks for nothing itself.
    behaviors = () if meaning.revises else implied.behaviors
    return Annotations(
        stamp_ns=stamp_ns,
        instruction_id=meaning.instruction_id,
        text=meaning.text,
        understood=understanding.understood,
        parse=understanding.parse,
        parse_probability=understanding.parse_probability,
        annotations=tuple(
            Annotation(
                probability=one.probability,
                objects=one.objects,
                relations=tuple(Relation(*relation) for relation in one.relations),
            )
            for one in understanding.annotations
        ),
        behaviors=tuple(_symbol(one) for one in behaviors),
        unknown_words=understanding.unknown_words,
        question=question.text if question else None,
        possible=understanding.possible,
        options=question.options if question else (),
        revision=meaning.revision,
        revises=meaning.revises,
        viewpoint=meaning.viewpoint,
        not_meant=meaning.not_meant,
        said=said,
    )


def scene_of(belief: MapBelief, behaviors: Behaviors) -> Scene:
    """What was seen, with the probability that it is what is meant."""
    share = belief.weights[behaviors.particle] * behaviors.probability
    # A hypothesis says itself what is meant; where none does, what fits tells.
    says = bool(np.any(belief.figure != _none))
    rows = np.flatnonzero(belief.particle == shared)
    return tuple(
        Thing(
            node=int(belief.node[row]),
            name=belief.classes[belief.class_index[row]],
            x=float(belief.position[row, 0]),
            y=float(belief.position[row, 1]),
            mass=float(
                belief.weights[belief.figure == belief.node[row]].sum()
                if says
                else share[behaviors.node == belief.node[row]].sum()
            ),
        )
        for row in rows
        if belief.existence[row] >= _likely_there
    )


def hypotheses(belief: MapBelief, names: Sequence[str]) -> list[Hypothesis]:
    """The belief's particles one by one: what was seen, and what each imagines.

    Args:
        belief: as published.
        names: classes in the order the grounding model counts them; objects of other classes
            are left out.
    """
    index = {name: at for at, name in enumerate(names)}
    known = np.array([index.get(name, _none) for name in belief.classes], dtype=np.int64)
    classes = known[belief.class_index]
    positions = np.column_stack([belief.position, np.zeros(len(belief.node))])
    viewer = np.array([belief.viewer.x, belief.viewer.y, belief.viewer.yaw])
    seen = belief.seen
    return [
        Hypothesis(
            WorldObjects(
                classes=_as_meant(belief, known, particle, rows),
                positions=positions[rows],
                extents=belief.extent[rows],
                observed=seen[rows],
                viewer=viewer,
            ),
            belief.node[rows],
        )
        for particle, rows in enumerate(_rows_of_each(belief, classes != _none))
    ]


def _as_meant(
    belief: MapBelief, known: NDArray[np.int64], particle: int, rows: NDArray[np.intp]
) -> NDArray[np.int64]:
    """Classes (n,) of a hypothesis's rows, in which what the words mean is what they say.

    Whatever it looks most like: what was taken for a lounge may be the kitchen.
    """
    classes, node = known[belief.class_index[rows]], belief.node[rows]
    for meant, said in (
        (belief.figure[particle], belief.figure_class[particle]),
        (belief.landmark[particle], belief.landmark_class[particle]),
    ):
        if said >= 0:
            classes[node == meant] = known[said]
    return classes


def _rows_of_each(belief: MapBelief, kept: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Rows of each hypothesis among the kept ones (M,), ascending, as `MapBelief.rows_of`."""
    kept_rows = np.flatnonzero(kept)
    by_owner = kept_rows[np.argsort(belief.particle[kept_rows], kind="stable")]
    owners = belief.particle[by_owner]

    def of(owner: int) -> NDArray[np.intp]:
        low, high = np.searchsorted(owners, [owner, owner + 1])
        return by_owner[low:high]

    count = len(belief.weights)
    own = np.split(by_owner, np.searchsorted(owners, np.arange(count + 1)))[1:-1]
    common = {
        topology: np.concatenate([of(shared), of(first_topology - topology)])
        for topology in np.unique(belief.topology).tolist()
    }
    return [
        np.sort(np.concatenate([common[topology], rows]))
        for topology, rows in zip(belief.topology.tolist(), own, strict=True)
    ]


def behaviors_message(
    belief: MapBelief,
    intent: Intent,
    worlds: Sequence[Hypothesis],
    grounded: Sequence[BehaviorDistribution],
    not_meant: tuple[int, ...] = (),
) -> Behaviors:
    """Behaviours of all particles as columns; other readings count as "nothing fits".

    So do things of which a person said that they are not meant.
    """
    rows = [
        (particle, _node(worlds[particle], one.object_index), landmark, probability)
        for particle, distribution in enumerate(grounded)
        for one, landmark, probability in _of_intent(distribution, intent, worlds[particle])
        if _node(worlds[particle], one.object_index) not in not_meant
    ]
    fitting = np.zeros(len(grounded))
    for particle, _, _, probability in rows:
        fitting[particle] += probability
    particles, nodes, landmarks, probabilities = zip(*rows, strict=True) if rows else ([],) * 4
    return Behaviors(
        stamp_ns=belief.stamp_ns,
        instruction_id=belief.instruction_id,
        particle=np.array(particles, dtype=np.int32),
        node=np.array(nodes, dtype=np.int32),
        landmark=np.array(landmarks, dtype=np.int32),
        probability=np.array(probabilities, dtype=np.float64),
        nothing_fits=np.clip(1.0 - fitting, 0.0, 1.0),
        action=intent.action,
        mode=intent.mode,
        relation=intent.relation,
        comparative=intent.comparative,
    )


def _of_intent(
    distribution: BehaviorDistribution, intent: Intent, hypothesis: Hypothesis
) -> list[tuple[Behavior, int, float]]:
    wanted = (intent.action, intent.object, intent.relation, intent.comparative)
    return [
        (one, _node(hypothesis, one.landmark_index), one.probability)
        for one in distribution.behaviors
        if (one.action, one.object, one.relation, one.comparative) == wanted
    ]


def _node(hypothesis: Hypothesis, row: int) -> int:
    return int(hypothesis.nodes[row]) if row >= 0 else _none


def _symbol(one: Behavior) -> BehaviorSymbol:
    return BehaviorSymbol(
        probability=one.probability,
        action=one.action,
        object=one.object,
        mode=one.mode,
        relation=one.relation,
        landmark=one.landmark,
        comparative=one.comparative,
    )
