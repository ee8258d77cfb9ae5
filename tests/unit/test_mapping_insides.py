"""Things in boxes: seen beside their box as things of their own, and ruled out by looks into it."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from robots.husky_ur5.spec import HUSKY_UR5
from schemas.geometry import Pose2
from schemas.language import Annotation, Annotations, BehaviorSymbol, Relation
from schemas.perception import Detections, Inspection
from services.mapping.annotations import readings_of
from services.mapping.filter import SemanticFilter
from services.mapping.insides import Insides, log_missed_at_most
from services.mapping.soundness import flaw_of

HERE = Pose2(0.0, 0.0, 0.0)
CLASSES = ("ball", "box", "cracker box")
SIZES = {"ball": 0.1, "box": 0.36, "cracker box": 0.2}
NEAR, FAR = (3.5, 1.2), (4.0, -1.0)
INSIDE = Annotations(
    stamp_ns=0, instruction_id="i", text="retrieve the ball inside the box", understood=True,
    parse="", parse_probability=1.0,
    annotations=(
        Annotation(
            probability=1.0, objects=("ball", "box"), relations=(Relation("inside", "ball", "box"),)
        ),
    ),
    behaviors=(
        BehaviorSymbol(
            probability=1.0, action="retrieve", object="ball", mode="unknown", relation="inside",
            landmark="box",
        ),
    ),
    unknown_words=(), question=None, possible=(),
)  # fmt: skip


def picture(stamp_ns: int, *things: tuple[str, tuple[float, float]]) -> Detections:
    count = len(things)
    probabilities = np.full((count, len(CLASSES)), 0.02)
    for row, (label, _) in enumerate(things):
        probabilities[row, CLASSES.index(label)] = 0.9
    bearings = np.linspace(-0.6, 0.6, 25)
    return Detections(
        stamp_ns=stamp_ns, classes=CLASSES, odom_from_base=HERE, boxes_px=np.zeros((count, 4)),
        probabilities=probabilities, scores=np.full(count, 0.9),
        centers_base=np.array([(*at, 0.1) for _, at in things]).reshape(-1, 3),
        covariances=np.tile(1e-3 * np.eye(3), (count, 1, 1)),
        extents=np.array([[SIZES[label]] * 3 for label, _ in things]).reshape(-1, 3),
        view_bearings=bearings, view_ranges=np.full(25, 1.0), view_near=0.5,
        picture_size=(320, 240), inference_ms=0.0,
    )  # fmt: skip


def look(at: tuple[float, float], *found: str, seen: float = 1.0) -> Inspection:
    return Inspection(
        stamp_ns=0, odom_from_base=HERE, label="box", center_base=np.array(at), seen=seen,
        sought=CLASSES, found=found,
    )  # fmt: skip


def semantic(*things: tuple[str, tuple[float, float]]) -> SemanticFilter:
    made = SemanticFilter(HUSKY_UR5.symbols, HUSKY_UR5.camera, 100, np.random.default_rng(0))
    for number in range(4):
        made.observe(picture(number, *things))
    readings = readings_of(INSIDE, made.classes, HUSKY_UR5.symbols.containers)
    made.hear(readings, HERE)
    return made


def mass_in(made: SemanticFilter, at: tuple[float, float]) -> float:
    """Probability that the ball lies in the box at a place."""
    gap = np.hypot(*(made.particles.figure_position - np.array(at)).T)
    return float(made.particles.weights[gap < 0.5].sum())


def labels(made: SemanticFilter) -> list[str]:
    return sorted(made.classes[thing.likeliest] for thing in made.objects.confirmed)


def test_before_a_look_the_ball_is_believed_to_be_in_the_boxes_that_were_seen() -> None:
    made = semantic(("box", NEAR), ("box", FAR))
    assert mass_in(made, NEAR) > 0.1
    assert mass_in(made, FAR) > 0.2


def test_an_empty_box_is_ruled_out_and_the_other_one_gains() -> None:
    made = semantic(("box", NEAR), ("box", FAR))
    before = mass_in(made, FAR)
    made.inspect(look(NEAR))
    assert mass_in(made, NEAR) < 0.03
    assert mass_in(made, FAR) > before
    made.inspect(look(FAR, "cracker box"))
    assert mass_in(made, FAR) < 0.05
    # Then it is in a box that nobody saw yet.
    assert made.particles.landmark_position.std(axis=0).min() > 1.0


def test_half_a_look_leaves_half_a_doubt() -> None:
    whole, half = (semantic(("box", NEAR), ("box", FAR)) for _ in range(2))
    whole.inspect(look(NEAR))
    half.inspect(look(NEAR, seen=0.5))
    assert mass_in(whole, NEAR) < mass_in(half, NEAR) < mass_in(half, FAR)


def test_to_look_at_the_ground_about_a_box_says_nothing_of_what_it_holds() -> None:
    made = semantic(("box", NEAR))
    before = mass_in(made, NEAR)
    made.grid.looked[:] = -5.0
    made.observe(picture(9, ("box", NEAR)))
    assert mass_in(made, NEAR) >= before - 0.02


def test_a_ball_in_a_box_is_a_thing_of_its_own_and_is_what_is_meant() -> None:
    made = semantic(("box", NEAR), ("box", FAR))
    made.inspect(look(FAR, "ball"))
    for number in range(4):
        made.observe_closely(picture(10 + number, ("ball", (FAR[0] + 0.06, FAR[1]))))
    assert labels(made) == ["ball", "box", "box"]
    ball = next(one for one in made.objects.confirmed if made.classes[one.likeliest] == "ball")
    meant = made.particles.weights[made.particles.figure == ball.number].sum()
    assert meant > 0.9


def test_a_ball_that_hides_in_its_box_is_not_forgotten() -> None:
    things = ("box", NEAR), ("ball", (NEAR[0] + 0.05, NEAR[1]))
    made = semantic(*things)
    plain = picture(20, things[0])
    for number in range(20):
        made.observe(picture(20 + number, things[0]))
    assert labels(made) == ["ball", "box"]
    assert math.isclose(float(plain.view_near), 0.5)


@pytest.mark.parametrize("label", ["hydrant", "cone"])
def test_a_look_into_what_is_not_on_the_map_changes_nothing(label: str) -> None:
    made = semantic(("box", NEAR))
    before = mass_in(made, NEAR)
    one = look(NEAR)
    made.inspect(replace(one, label=label))
    assert mass_in(made, NEAR) == before


def test_looks_add_up_and_speak_of_what_was_sought_alone() -> None:
    insides = Insides(3)
    for _ in range(2):
        insides.look(7, 1.0, np.array([1], np.int32))
    numbers = np.array([7, 8], np.int32)
    np.testing.assert_allclose(insides.log_missed(numbers, 1), [2 * log_missed_at_most, 0.0])
    np.testing.assert_array_equal(insides.log_missed(numbers, 0), 0.0)


@pytest.mark.parametrize(
    "bad", [look((math.nan, 0.0)), look(NEAR, seen=1.2), look((1e4, 0.0))], ids=lambda one: "bad"
)
def test_a_look_that_is_none_is_refused_with_the_reason(bad: Inspection) -> None:
    assert flaw_of(bad)
    assert flaw_of(look(NEAR)) == ""
