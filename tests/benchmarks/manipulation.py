"""The arm's kinematics and its plans for taking a ball out of a box, by processor time."""

import math
import time

import numpy as np

from robots.arm_kinematics import forward
from robots.husky_ur5.spec import HUSKY_UR5, UR5
from services.manipulation.errors import RefusalError
from services.manipulation.grasps import Thing
from services.manipulation.inverse import inverse
from services.manipulation.obstacles import Obstacle, box, own_body
from services.manipulation.picking import plan_pick
from tests.benchmarks.rows import Row, Samples, quantile, quantile_interval

_poses = 40
"""A round."""
_worst_inverse_ms, _worst_plan_ms = 2.0, 500.0
_wall = 0.012


def measure(rounds: int) -> list[Row]:
    """Both on random questions that have an answer."""
    rng = np.random.default_rng(0)
    joints = rng.uniform(-math.pi, math.pi, (_poses * rounds, 6))
    solved = np.array([_recovered(posture) for posture in joints])
    plans = np.array([_planned(rng) for _ in range(rounds)])
    found = np.isfinite(plans)
    return [
        _row(
            "inverse kinematics", "time, median", "ms", 1e3 * solved[:, 1], 0.5, _worst_inverse_ms
        ),
        _share("inverse kinematics", "pose reached", solved[:, 0] > 0, limit=99.5),
        _row(
            "pick from a box", "time to plan, 95 %", "ms", 1e3 * plans[found], 0.95, _worst_plan_ms
        ),
        _share("pick from a box", "planned", found, limit=80.0),
    ]


def _recovered(posture: np.ndarray) -> tuple[float, float]:
    """Whether the posture's pose is reached on all branches, one of them its own, and the time."""
    pose = forward(UR5, posture[None])
    started = time.process_time()
    answers = inverse(UR5, pose)
    spent = time.process_time() - started
    reached = forward(UR5, answers.joints[answers.valid])
    exact = answers.valid.any() and bool(np.abs(reached - pose).max() < 1e-9)
    gaps = np.abs(answers.joints[answers.valid] - posture)
    own = np.minimum(gaps, 2 * math.pi - gaps).max(axis=1, initial=0.0)
    return float(exact and own.min() < 1e-6), spent


def _planned(rng: np.random.Generator) -> float:
    """Time for all motions of a pick [s]; NaN if it was refused."""
    length, width, height = rng.uniform((0.30, 0.30, 0.18), (0.44, 0.40, 0.27))
    x, y = rng.uniform((0.78, -0.2), (0.95, 0.2))
    radius = rng.uniform(0.03, 0.063)
    free = np.array([length, width]) / 2 - radius - 0.03
    place = np.eye(4)
    place[:2, 3] = np.array([x, y]) + rng.uniform(-1, 1, 2) * free
    place[2, 3] = _wall + radius
    ball = Thing("ball", place, np.full(3, 2 * radius))
    obstacles = [*own_body(HUSKY_UR5), *_open_box(x, y, length, width, height)]
    started = time.process_time()
    try:
        plan_pick(UR5, ball, obstacles, np.array(UR5.poses["look"]), rng)
    except RefusalError:
        return math.nan
    return time.process_time() - started


def _open_box(x: float, y: float, length: float, width: float, height: float) -> list[Obstacle]:
    return [
        box("box", (x, y, _wall / 2), (length, width, _wall)),
        *(
            box("box", (x + side * length / 2, y, height / 2), (_wall, width, height))
            for side in (-1, 1)
        ),
        *(
            box("box", (x, y + side * width / 2, height / 2), (length, _wall, height))
            for side in (-1, 1)
        ),
    ]


def _row(row: str, metric: str, unit: str, times: Samples, share: float, limit: float) -> Row:
    return Row(
        row=row,
        metric=metric,
        unit=unit,
        better="lower",
        ours=quantile(times, share),
        interval=quantile_interval(times, share),
        limit=limit,
    )


def _share(row: str, metric: str, done: np.ndarray, limit: float) -> Row:
    share = 100 * float(done.mean())
    spread = 196 * math.sqrt(max(done.mean() * (1 - done.mean()), 0.0) / len(done))
    return Row(
        row=row,
        metric=metric,
        unit="%",
        better="higher",
        ours=share,
        interval=(max(share - spread, 0.0), min(share + spread, 100.0)),
        limit=limit,
    )
