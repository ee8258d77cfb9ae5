"""A step of the filter and a decision, beside the paper's literal algorithm.

The peer keeps one iSAM2 for each particle, as Algorithm 1 is written; it does nothing but the
metric part of a step that adds a pose node. Ours does all of the step, from the odometry and the
picture to the belief. Times are those of the processor: others on the machine do not count.
"""

import time
from importlib.metadata import version

import gtsam
import numpy as np

from schemas.geometry import Pose2
from services.mapping import graph
from services.policy.policy import BeliefPolicy, Memory
from services.policy.referents import from_figures
from services.policy.rule import load_rule
from tests.benchmarks.ring import SPEC, Ring
from tests.benchmarks.rows import Row, Samples, compared, quantile, quantile_interval

ASKED = (100, 200, 20)
"""Particles, pose nodes, objects."""
PEER = f"one ISAM2 a particle, gtsam {version('gtsam')}"

_steps_a_round = 4
_stride = 0.25
_sightings = 6
_drift = 3.0


def measure(rounds: int) -> list[Row]:
    """Steps and decisions; four steps a round, one of which adds a pose node."""
    ring = settled(*ASKED)
    steps, nodes = timed_steps(ring, rounds)
    peer = _peer_ms(*ASKED, rounds)
    name = name_of(*ASKED)
    return [
        _plain(name, "filter step, p50", "ms", steps),
        _plain(name, "filter step, p95", "ms", steps, 0.95),
        compared(
            name, "step with a pose node, p50", "ms", steps[nodes], (PEER, peer), drift=_drift
        ),
        *_decisions(ring, rounds),
    ]


def name_of(particles: int, nodes: int, objects: int) -> str:
    """What a row is called."""
    return f"{particles} particles, {nodes} pose nodes, {objects} objects"


def settled(particles: int, nodes: int, objects: int) -> Ring:
    """A filter that has driven past so many pose nodes and heard an instruction."""
    ring = Ring(particles, objects)
    ring.drive_until(nodes)
    ring.hear()
    return ring


def _plain(row: str, metric: str, unit: str, samples: Samples, q: float = 0.5) -> Row:
    return Row(
        row=row,
        metric=metric,
        unit=unit,
        better="lower",
        ours=quantile(samples, q),
        interval=quantile_interval(samples, q),
    )


def timed_steps(ring: Ring, rounds: int) -> tuple[Samples, np.ndarray]:
    """Time of each step [ms], and which of them added a pose node."""
    times: list[float] = []
    added: list[bool] = []
    for _ in range(rounds * _steps_a_round):
        readings = ring.ahead(_stride)
        before = len(ring.belief.trajectory) if ring.belief else 0
        started = time.process_time()
        belief = ring.step(*readings)
        times.append(1000 * (time.process_time() - started))
        added.append(len(belief.trajectory) > before)
    return np.array(times), np.array(added)


def _peer_ms(particles: int, nodes: int, objects: int, rounds: int) -> Samples:
    """Time of adding a pose, its edges and reading the sighted objects out, in every particle."""
    first = _graph_of(nodes, objects)
    copies = [gtsam.ISAM2(first) for _ in range(particles)]
    times: list[float] = []
    for number in range(rounds):
        started = time.process_time()
        for isam in copies:
            _extend(isam, nodes + number, objects)
        times.append(1000 * (time.process_time() - started))
    return np.array(times)


def _graph_of(nodes: int, objects: int) -> gtsam.ISAM2:
    parameters = gtsam.ISAM2Params()
    parameters.setFactorization("QR")
    isam = gtsam.ISAM2(parameters)
    problem = graph.Problem()
    graph.add_pose_prior(problem, 0, Pose2(0.0, 0.0, 0.0), (0.01, 0.01, 0.003))
    for number in range(objects):
        graph.add_object_prior(problem, number, _place(number), np.eye(2))
    isam.update(problem.factors, problem.values)
    for node in range(1, nodes):
        _extend(isam, node, objects)
    return isam


def _extend(isam: gtsam.ISAM2, node: int, objects: int) -> None:
    problem = graph.Problem()
    step = Pose2(1.0, 0.0, 0.2)
    variances = (1e-3, 1e-3, 1e-4)
    before = isam.calculateEstimatePose2(graph.pose_key(node - 1))
    here = Pose2(before.x(), before.y(), before.theta())
    graph.add_motion(problem, graph.Motion(node - 1, node, step, variances, here @ step))
    seen = [(node + offset) % objects for offset in range(_sightings)]
    for number in seen:
        point = here.inverse().apply(_place(number))
        sighting = graph.Sighting(node - 1, number, point, 0.02 * np.eye(2), None)
        graph.add_sighting(problem, sighting)
    isam.update(problem.factors, problem.values)
    for number in seen:
        isam.marginalCovariance(graph.object_key(number))


def _place(number: int) -> np.ndarray:
    return np.array([7.0 * np.sin(number), 5.0 - 7.0 * np.cos(number)])


def _decisions(ring: Ring, rounds: int) -> list[Row]:
    """The whole of a decision, from the belief to the choice."""
    belief, grid = ring.belief, ring.scan()
    assert belief is not None
    policy = BeliefPolicy(SPEC, load_rule("husky"))
    memory = Memory(np.zeros((0, 2)), np.zeros((0, 3)), None, 0.0)
    times: list[float] = []
    count = 0
    for _ in range(rounds):
        started = time.process_time()
        choice = policy.decide(belief, from_figures(belief), grid, belief.map_from_base, memory)
        times.append(1000 * (time.process_time() - started))
        count = len(choice.candidates)
    name, counts = name_of(*ASKED), np.array([float(count)])
    return [
        _plain(name, "decision, p50", "ms", np.array(times)),
        _plain(name, "candidates of the decision", "", counts),
    ]
