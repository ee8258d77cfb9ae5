"""A point robot in a toy world: what the node's belief must come to, whatever its insides."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec
import numpy as np
import pytest

from schemas import codec, topics
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.language import Annotation, Annotations, BehaviorSymbol, Relation
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.topics import Output
from services.mapping.node import MappingNode

pytestmark = pytest.mark.usefixtures("without_learning")

CLASSES = ("cone", "hydrant", "barrel")
HALF_VIEW = math.radians(34.5)
SIGHT = 7.0
FRAME_NS = 200_000_000
START = Pose2(0.0, 0.0, 0.0)


def says(
    figure: str, relation: str = "", landmark: str = "", comparative: bool = False, id: str = "i1"
) -> Annotations:
    relations = (Relation(relation, figure, landmark),) if relation else ()
    objects = (landmark, figure) if relation else (figure,)
    behavior = BehaviorSymbol(
        probability=1.0,
        action="navigate",
        object=figure,
        mode="unknown",
        relation=relation or "unknown",
        landmark=landmark or "unknown",
        comparative=comparative,
    )
    return Annotations(
        stamp_ns=0,
        instruction_id=id,
        text="",
        understood=True,
        parse="",
        parse_probability=1.0,
        annotations=(Annotation(probability=1.0, objects=objects, relations=relations),),
        behaviors=(behavior,),
        unknown_words=(),
        question=None,
        possible=(),
    )


@dataclass
class World:
    """Objects (class, x, y) of radius 0.2 m, a camera with misses, false boxes, occlusion."""

    objects: list[tuple[str, float, float]]
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))
    false_rate: float = 0.02
    variance_per_metre: float = 0.0
    variance_per_radian: float = 0.0
    time_ns: int = 0
    true: Pose2 = START
    odom: Pose2 = START

    def step(self, goal: tuple[float, float], node: MappingNode) -> list[Output]:
        """Turn and drive towards a place for one frame, then look."""
        bearing = math.atan2(goal[1] - self.true.y, goal[0] - self.true.x) - self.true.yaw
        turn = max(-0.3, min(0.3, (bearing + math.pi) % (2 * math.pi) - math.pi))
        gap = math.hypot(goal[0] - self.true.x, goal[1] - self.true.y)
        move = Pose2(min(0.2, gap) if abs(turn) < 0.2 else 0.0, 0.0, turn)
        self.true = self.true @ move
        self.odom = self.odom @ self._slipped(move)
        self.time_ns += FRAME_NS
        out = list(node.on_odometry(self.odometry()))
        return out + list(node.on_detections(self.look()))

    def odometry(self) -> Odometry:
        return Odometry(
            stamp_ns=self.time_ns,
            odom_from_base=self.odom,
            linear=0.0,
            angular=0.0,
            variance_per_metre=self.variance_per_metre,
            variance_per_radian=self.variance_per_radian,
        )

    def _slipped(self, move: Pose2) -> Pose2:
        position = math.sqrt(self.variance_per_metre * move.x)
        yaw = math.sqrt(self.variance_per_radian * abs(move.yaw))
        dx, dy, turn = self.rng.standard_normal(3).tolist()
        return Pose2(move.x + position * dx, position * dy, move.yaw + yaw * turn)

    def look(self) -> Detections:
        bearings = np.linspace(-HALF_VIEW, HALF_VIEW, 31)
        found = [self._box(name, p) for name, p in self._in_view() if self.rng.random() < 0.9]
        if self.rng.random() < self.false_rate:
            range_, angle = self.rng.uniform(2, 6), self.rng.uniform(-0.5, 0.5)
            place = np.array([range_ * math.cos(angle), range_ * math.sin(angle)])
            found.append(self._box("hydrant", place))
        centers = np.array([center for _, center in found]).reshape(-1, 3)
        n = len(found)
        return Detections(
            stamp_ns=self.time_ns,
            classes=CLASSES,
            odom_from_base=self.odom,
            boxes_px=np.zeros((n, 4)),
            probabilities=np.array([p for p, _ in found]).reshape(-1, len(CLASSES)),
            scores=np.full(n, 0.8),
            centers_base=centers,
            covariances=np.tile(0.1**2 * np.eye(3), (n, 1, 1)),
            extents=np.tile([0.4, 0.4, 0.7], (n, 1)),
            view_bearings=bearings,
            view_ranges=np.array([self._reach(bearing) for bearing in bearings]),
            view_near=0.8,
            picture_size=(320, 240),
            inference_ms=0.0,
        )

    def _local(self) -> list[tuple[str, np.ndarray]]:
        base_from_map = self.true.inverse()
        return [(name, base_from_map.apply(np.array([x, y]))) for name, x, y in self.objects]

    def _in_view(self) -> list[tuple[str, np.ndarray]]:
        shown = []
        for name, point in self._local():
            distance, bearing = math.hypot(*point), math.atan2(point[1], point[0])
            framed = 0.8 < distance < SIGHT and abs(bearing) < HALF_VIEW
            if framed and distance < self._reach(bearing, but=point) + 0.1:
                shown.append((name, point))
        return shown

    def _reach(self, bearing: float, but: np.ndarray | None = None) -> float:
        reach = SIGHT
        for _, point in self._local():
            if but is not None and (point == but).all():
                continue
            distance = math.hypot(*point)
            if abs(math.atan2(point[1], point[0]) - bearing) < math.atan2(0.2, distance):
                reach = min(reach, distance - 0.2)
        return reach

    def _box(self, name: str, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        likely = np.full(len(CLASSES), 0.03)
        likely[CLASSES.index(name)] = 0.88
        return likely, np.append(point + 0.08 * self.rng.standard_normal(2), 0.4)


def make_node(seed: int = 0, particles: int = 100) -> MappingNode:
    return MappingNode(RunConfig(particles=particles), np.random.default_rng(seed))


def last_belief(outputs: Iterable[Output]) -> MapBelief:
    return [o.message for o in outputs if o.topic is topics.BELIEF][-1]  # type: ignore[return-value]


def drive(node: MappingNode, world: World, path: list[tuple[float, float]]) -> list[Output]:
    outputs: list[Output] = []
    for goal in path:
        for _ in range(200):
            outputs += world.step(goal, node)
            if math.hypot(goal[0] - world.true.x, goal[1] - world.true.y) < 0.1:
                break
    return outputs


def mass_on(belief: MapBelief, x: float, y: float) -> float:
    """Weight of the hypotheses whose figure is a seen object within a metre of a place."""
    seen = belief.particle == -1
    near = np.linalg.norm(belief.position - [x, y], axis=1) < 1.0
    ids = belief.node[seen & near]
    return float(belief.weights[np.isin(belief.figure, ids)].sum())


BEHIND = says("hydrant", "back", "cone")
AROUND_THE_CONE = [(3.0, 0.0), (5.0, -1.5), (7.5, -0.5), (8.2, 0.8), (7.5, 1.5), (7.0, 2.0)]


@pytest.mark.parametrize("seed", range(3))
def test_hydrant_behind_cone_is_found(seed: int) -> None:
    world = World([("cone", 6.0, 1.0), ("hydrant", 9.0, 1.6)], np.random.default_rng(seed))
    node = make_node(seed)
    node.on_annotations(BEHIND)
    belief = last_belief(drive(node, world, AROUND_THE_CONE))
    assert mass_on(belief, 9.0, 1.6) > 0.9


@pytest.mark.parametrize("seed", range(3))
def test_of_two_hydrants_the_one_behind_the_cone_is_meant(seed: int) -> None:
    things = [("cone", 6.0, 1.0), ("hydrant", 9.0, 1.6), ("hydrant", 4.5, -3.0)]
    world, node = World(things, np.random.default_rng(seed)), make_node(seed)
    node.on_annotations(BEHIND)
    first = last_belief(drive(node, world, [(2.0, -1.2)]))
    assert mass_on(first, 4.5, -3.0) < 0.5
    belief = last_belief(drive(node, world, AROUND_THE_CONE))
    assert mass_on(belief, 9.0, 1.6) > 0.9


def test_nearest_is_the_one_without_a_nearer_competitor() -> None:
    things = [("cone", 6.0, 0.0), ("hydrant", 7.0, 1.5), ("hydrant", 6.0, -4.0)]
    world, node = World(things), make_node()
    node.on_annotations(says("hydrant", "near", "cone", comparative=True))
    belief = last_belief(drive(node, world, [(3.0, 0.0), (3.0, -2.0), (6.0, -2.0), (8.0, 0.0)]))
    assert mass_on(belief, 7.0, 1.5) > 0.9


def test_figure_alone_is_grounded_when_seen() -> None:
    world, node = World([("hydrant", 5.0, 0.0)]), make_node()
    node.on_annotations(says("hydrant"))
    assert mass_on(last_belief(drive(node, world, [(2.0, 0.0)])), 5.0, 0.0) > 0.5


def test_where_nothing_was_found_hypotheses_move_on() -> None:
    world, node = World([], false_rate=0.0), make_node()
    before = last_belief(node.on_annotations(says("hydrant")))
    after = last_belief(drive(node, world, [(9.0, 0.0)]))
    assert corridor_mass(before) > 0.1
    assert corridor_mass(after) < 0.3 * corridor_mass(before)
    assert len(np.unique(after.position[:, 0])) > 50


def corridor_mass(belief: MapBelief) -> float:
    """Weight of hypothesised figures in the strip that the robot drives along."""
    x, y = belief.position.T
    rows = (belief.node == 1000) & (x > 3) & (x < 9) & (np.abs(y) < 2.0)
    return float(belief.weights[belief.particle[rows]].sum())


def test_a_hypothesised_landmark_is_evidence_too() -> None:
    """A hydrant is in sight, but the place before it, where its cone should be, is empty."""
    world, node = World([("hydrant", 6.0, 0.0)], false_rate=0.0), make_node()
    node.on_annotations(BEHIND)
    assert mass_on(last_belief(drive(node, world, [(2.0, 0.5)])), 6.0, 0.0) < 0.3


def test_one_false_detection_does_not_enter_the_map() -> None:
    world, node = World([], false_rate=0.0), make_node()
    drive(node, world, [(1.0, 0.0)])
    world.false_rate = 1.0
    world.step((2.0, 0.0), node)
    world.false_rate = 0.0
    assert not (last_belief(drive(node, world, [(3.0, 0.0)])).particle == -1).any()


def test_weights_are_a_distribution_at_every_step() -> None:
    world, node = World([("cone", 6.0, 1.0), ("hydrant", 9.0, 1.6)]), make_node()
    node.on_annotations(BEHIND)
    for output in drive(node, world, AROUND_THE_CONE):
        belief = output.message
        assert isinstance(belief, MapBelief)
        assert belief.weights.sum() == pytest.approx(1.0)
        assert 1.0 <= belief.effective_particles <= 100.0 + 1e-6
        assert_grounded(belief)


def assert_grounded(belief: MapBelief) -> None:
    """Every figure and landmark is a seen row, or a row of its own particle; ids are unique."""
    seen = set(belief.node[belief.particle == -1].tolist())
    own = set(zip(belief.particle.tolist(), belief.node.tolist(), strict=True))
    assert len(own) == len(belief.node)
    for particle, pair in enumerate(np.stack([belief.figure, belief.landmark], 1)):
        assert set(pair.tolist()) <= seen | {-1} | {n for p, n in own if p == particle}


def test_beliefs_survive_the_wire_and_one_seed_gives_one_run() -> None:
    def run() -> list[bytes]:
        things = [("cone", 6.0, 1.0), ("hydrant", 9.0, 1.6)]
        node = make_node(5)
        node.on_annotations(BEHIND)
        outputs = drive(node, World(things), [(3.0, 0.0), (5.0, -1.5)])
        return [codec.encode(output.message) for output in outputs]

    first = run()
    assert first == run()
    assert codec.encode(codec.decode(first[-1], MapBelief)) == first[-1]


def test_before_anything_is_said_there_is_only_the_observed_map() -> None:
    node, world = make_node(), World([("cone", 4.0, 0.0)], false_rate=0.0)
    belief = last_belief(drive(node, world, [(1.0, 0.0)]))
    assert (belief.particle == -1).all()
    assert belief.classes[belief.class_index[0]] == "cone"
    assert (belief.figure == -1).all()
    np.testing.assert_allclose(belief.weights, 0.01)


def test_what_is_not_understood_or_repeated_changes_nothing() -> None:
    node = make_node()
    assert not list(node.on_annotations(says_nothing("i0")))
    assert list(node.on_annotations(BEHIND))
    assert not list(node.on_annotations(BEHIND))
    assert list(node.on_annotations(says("cone", id="i2")))


def says_nothing(id: str) -> Annotations:
    return msgspec.structs.replace(says("hydrant", id=id), understood=False)


def test_a_killed_process_goes_on_where_it_was() -> None:
    things = [("cone", 6.0, 1.0), ("hydrant", 9.0, 1.6)]
    world, node = World(things), make_node()
    node.on_annotations(BEHIND)
    last = last_belief(drive(node, world, [(2.5, -0.5)]))
    heir = make_node(seed=9)
    own = heir.resume()
    own[topics.BELIEF](codec.decode(codec.encode(last), MapBelief))
    again = last_belief(heir.on_annotations(BEHIND))
    for name in ("weights", "figure", "landmark", "viewer", "instruction_id", "node"):
        np.testing.assert_array_equal(getattr(again, name), getattr(last, name))
    np.testing.assert_allclose(again.position, last.position, atol=1e-6)
    end = last_belief(drive(heir, world, AROUND_THE_CONE[1:]))
    assert mass_on(end, 9.0, 1.6) > 0.9
    cones = (end.particle == -1) & (end.class_index == end.classes.index("cone"))
    assert cones.sum() == 1


def test_seen_objects_correct_the_drift() -> None:
    landmarks = [("barrel", x, y) for x in (0.0, 6.0) for y in (-3.0, 3.0, 0.5)]
    loop = [(6.0, -1.5), (7.5, 1.5), (0.0, 1.8), (-1.5, -1.5)]
    errors = [drift_error(things, seed, loop) for seed in range(3) for things in (landmarks, [])]
    assert np.mean(errors[0::2]) < 0.5 * np.mean(errors[1::2])


def drift_error(things: list[tuple[str, float, float]], seed: int, path: list) -> float:
    world = World(things, np.random.default_rng(seed), 0.0, 4e-3, 1e-2)
    belief = last_belief(drive(make_node(particles=2), world, path))
    step = world.true.inverse() @ belief.map_from_base
    return math.hypot(step.x, step.y)
