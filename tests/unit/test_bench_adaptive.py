"""The figures of attention come from the right episodes."""

import numpy as np
import pytest

from sim.experiments.bench_adaptive import EVERYTHING, Pair, rows_of
from sim.experiments.episode import EpisodeResult


def episode(ms: float, success: bool, way: float) -> EpisodeResult:
    return EpisodeResult(
        success=success,
        stopped=True,
        reason="",
        distance_m=way,
        shortest_path_m=5.0,
        time_s=10.0,
        final_error_m=0.5,
        decisions=3,
        failure=None,
        seed=0,
        arm="ours",
        perception_cycles=10,
        perception_ms_mean=ms,
        behavior_inference_ms_per_particle=0.1,
        mapping_ms_mean=5.0,
        objects_detected=2,
        log_sha256="",
    )


def test_each_figure_stands_beside_that_without_attention():
    pairs = [
        Pair(episode(8.0, True, 9.0), episode(16.0, True, 10.0)),
        Pair(episode(9.0, True, 9.0), episode(18.0, False, 11.0)),
        Pair(episode(5.0, False, 12.0), episode(20.0, True, 12.0)),
    ]
    spent, share, success, way = rows_of("yard", pairs, np.random.default_rng(0))
    assert (spent.ours, spent.arms[EVERYTHING]) == (8.0, 18.0)
    assert (share.ours, share.unit) == (50.0, "%")
    assert success.ours == success.arms[EVERYTHING] == pytest.approx(200 / 3)
    assert (way.ours, way.arms[EVERYTHING], way.unit) == (9.0, 11.0, "m")
