"""In which worlds the policy practises, and what it is told there.

The layouts and sentences of Table 1 with its fields of view, and mixtures of them that the table
does not have. Evaluation uses seeds from 20000 on, so nothing here is met again.
"""

from msgspec import Struct

from sim.experiments.montecarlo_job import Scenario
from sim.experiments.table1 import BEHIND, NEAREST, NULL, ROWS
from sim.scenes.object_relative import GOAL
from sim.world import make_world

TRAINING_SEEDS, VALIDATION_SEEDS = 100_000, 110_000
"""First seeds; there is room for ten thousand worlds between them."""

_mixtures = (
    ("one_hydrant_one_cone", NEAREST, 3.0),
    ("one_hydrant_one_cone", BEHIND, 5.0),
    ("one_hydrant_two_cones", NULL, 5.0),
    ("one_hydrant_two_cones", BEHIND, 2.0),
    ("two_hydrants_one_cone", BEHIND, 5.0),
    ("two_hydrants_one_cone", NULL, 10.0),
    ("nearest_hydrant", NEAREST, 3.0),
    ("nearest_hydrant", NEAREST, 2.0),
    ("nearest_hydrant", NULL, 3.0),
)
"""World, sentence and view range [m]; what is meant is the layout's goal in each of them."""


class Practice(Struct, frozen=True, kw_only=True):
    """One world with what is said in it."""

    scenario: Scenario
    seed: int

    @property
    def goals(self) -> tuple[str, ...]:
        """Ids of the objects that are meant: without a relation, any one of the goal's class."""
        if self.scenario.text != NULL:
            return (GOAL,)
        label = GOAL.rpartition("_")[0]
        objects = make_world(self.scenario.world, self.seed).objects
        return tuple(placed.id for placed in objects if placed.label == label)


def practices(first_seed: int, episodes: int, start: int = 0) -> list[Practice]:
    """`episodes` worlds of every row of the table and as many of mixtures.

    Args:
        first_seed: `TRAINING_SEEDS` or `VALIDATION_SEEDS`, plus a seed of the user's.
        episodes: of each row.
        start: how many of each row were practised before.
    """
    numbers = range(start, start + episodes)
    rows = [
        Practice(scenario=row.scenario, seed=first_seed + number)
        for row in ROWS
        for number in numbers
    ]
    mixed = [Practice(scenario=_mixture(number), seed=first_seed + number) for number in numbers]
    return rows + mixed


def _mixture(number: int) -> Scenario:
    world, text, view_range_m = _mixtures[number % len(_mixtures)]
    return Scenario(name="mixed", world=world, text=text, view_range_m=view_range_m)
