"""Arms are compared world by world, and the verdict knows which way is better."""

import msgspec
import numpy as np
import pytest

from sim.experiments.comparison import DISTANCE, EFFICIENCY, SUCCESS, compared
from sim.experiments.montecarlo_job import Result
from tests.unit.test_montecarlo import GOOD, LOST


def runs(arm: str, distances: list[float]) -> list[Result]:
    return [
        msgspec.structs.replace(GOOD, arm=arm, seed=seed, distance_m=metres)
        for seed, metres in enumerate(distances)
    ]


def test_only_worlds_that_both_met_count() -> None:
    results = [*runs("ours", [10.0, 12.0, 99.0]), *runs("frontier", [11.0, 13.0])]
    (one,) = compared("behind", results, ["frontier"], [DISTANCE], np.random.default_rng(0))
    assert (one.worlds, one.ours, one.theirs) == (2, 11.0, 12.0)
    assert one.difference == pytest.approx(-1.0)
    assert one.verdict == "better"


def test_the_spread_between_worlds_is_no_doubt_where_all_of_them_agree() -> None:
    near, far = runs("ours", [5.0, 50.0] * 10), runs("frontier", [6.0, 51.0] * 10)
    (one,) = compared("behind", [*near, *far], ["frontier"], [DISTANCE], np.random.default_rng(0))
    assert one.interval == pytest.approx((-1.0, -1.0))


def test_the_verdict_turns_with_the_metric() -> None:
    failed = [msgspec.structs.replace(LOST, arm="frontier", seed=seed) for seed in range(3)]
    results = [*runs("ours", [10.0] * 3), *failed]
    metrics = [SUCCESS, EFFICIENCY, DISTANCE]
    made = compared("behind", results, ["frontier"], metrics, np.random.default_rng(0))
    assert [one.verdict for one in made] == ["better", "better", "better"]
    assert [one.difference for one in made] == pytest.approx([100.0, 0.8, -80.0])


def test_equal_arms_are_level_and_absent_ones_are_left_out() -> None:
    results = [*runs("ours", [10.0, 20.0]), *runs("rate_rule", [20.0, 10.0])]
    arms = ["rate_rule", "pomcp"]
    (one,) = compared("behind", results, arms, [DISTANCE], np.random.default_rng(0))
    assert (one.arm, one.verdict) == ("rate_rule", "level")
