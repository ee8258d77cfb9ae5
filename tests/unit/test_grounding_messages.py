"""The objects of each hypothesis are the rows that the belief says are its own."""

import msgspec
import numpy as np

from schemas.belief import MapBelief, first_topology
from services.grounding.messages import hypotheses
from tests.unit.test_montecarlo_ablations import belief_of

NAMES = ("hydrant", "cone")


def with_topologies() -> MapBelief:
    """Four hypotheses in two topologies, each of which has a row that the others lack."""
    belief = belief_of([0.0, 1.0, 2.0, 3.0], [0.25] * 4)
    particle = belief.particle.copy()
    particle[:2] = (first_topology, first_topology - 1)
    rows = np.random.default_rng(0).permutation(len(particle))
    hydrant = belief.classes.index("hydrant")
    columns = ("node", "class_probability", "position", "covariance", "extent", "existence")
    return msgspec.structs.replace(
        belief,
        particle=particle[rows],
        class_index=np.full(len(rows), hydrant, np.int32),
        topology=np.array([0, 1, 1, 0], np.int32),
        **{name: getattr(belief, name)[rows] for name in columns},
    )


def test_each_hypothesis_has_its_own_rows_in_the_order_of_the_belief() -> None:
    belief = with_topologies()
    for number, one in enumerate(hypotheses(belief, NAMES)):
        rows = belief.rows_of(number)
        assert one.nodes.tolist() == belief.node[rows].tolist()
        assert one.world.positions[:, :2].tolist() == belief.position[rows].tolist()
        assert one.world.observed.tolist() == belief.seen[rows].tolist()


def test_objects_of_classes_that_are_no_words_are_left_out() -> None:
    belief = with_topologies()
    assert all(len(one.nodes) == 0 for one in hypotheses(belief, ("tree",)))


def test_what_the_words_mean_is_what_they_say_whatever_it_looks_like() -> None:
    belief = with_topologies()
    cone, shared_node = belief.classes.index("cone"), int(belief.node[belief.particle == -1][0])
    meant = msgspec.structs.replace(
        belief,
        figure=np.array([shared_node, -1, -1, -1], np.int32),
        figure_class=np.array([cone, -1, -1, -1], np.int32),
    )
    first, *others = hypotheses(meant, NAMES)
    assert first.world.classes[first.nodes == shared_node].tolist() == [NAMES.index("cone")]
    assert first.world.classes[first.nodes != shared_node].tolist().count(NAMES.index("cone")) == 0
    for one in others:
        assert set(one.world.classes.tolist()) == {NAMES.index("hydrant")}
