"""The wheelchair finds a kitchen on a floor it has never seen, with perception modelled."""

import pytest

from schemas.run import RunConfig
from sim.experiments.episode import run_episode
from sim.experiments.montecarlo import run_job
from sim.experiments.montecarlo_job import Job
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.table2 import SCENARIOS, TEXT


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_chair_goes_to_the_kitchen_down_the_hallway():
    run = RunConfig(robot="wheelchair", world="office", seed=5001)
    result = run_episode(run, TEXT, None, lambda seconds, status: None)
    assert result["success"]
    assert result["reason"] == "goal confirmed"
    assert result["distance_m"] < 1.5 * result["shortest_path_m"]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_known_map_is_driven_as_far_as_in_the_paper():
    result = run_job(Job(SCENARIOS[0], "known", 5002, PerceptionSettings()))
    assert result.success
    assert result.distance_m == pytest.approx(12.88, abs=0.4)
    assert result.time_s == pytest.approx(18.32, abs=1.5)
