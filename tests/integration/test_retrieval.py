"""The whole way: a ball is found in a box that nobody has seen, taken, and brought."""

import pytest

from schemas.run import RunConfig
from sim.experiments.episode import Episode, Trial
from sim.experiments.montecarlo import run_job
from sim.experiments.montecarlo_job import Job
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.table5 import PARTICLES, SCENARIOS
from sim.scenes.boxes import INDOORS, OUTDOORS, Site

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]


@pytest.mark.parametrize(
    ("site", "seconds"), [(INDOORS, 120.0), (OUTDOORS, 200.0)], ids=["indoor", "outdoor"]
)
def test_the_ball_in_the_far_box_is_found_and_brought(site: Site, seconds: float) -> None:
    result = run_job(Job(SCENARIOS[site][0], "ours", 0, PerceptionSettings(), PARTICLES[site]))
    assert (result.success, result.failure) == (True, None)
    assert result.time_s < seconds


def test_who_knows_the_map_goes_straight_there() -> None:
    job = Job(SCENARIOS[INDOORS][0], "known", 0, PerceptionSettings(), PARTICLES[INDOORS])
    result = run_job(job)
    assert (result.success, result.failure) == (True, None)
    assert result.time_s < 60.0
    assert result.distance_m < 1.6 * result.shortest_m + 2.0


def test_what_is_only_to_be_picked_up_is_held_where_it_was() -> None:
    run = RunConfig(robot="husky_ur5", world="box_indoor", seed=3, particles=10)
    trial = Trial(perception=PerceptionSettings())
    result = Episode(run, "pick up the cracker box inside the box", trial=trial).run(
        lambda seconds, status: None
    )
    assert (result.success, result.failure) == (True, None)
    assert result.reason == "the cracker box is in the gripper"
