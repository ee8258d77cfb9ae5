"""One question, answered from the truth, leads to the thing that was meant."""

import msgspec
import numpy as np
import pytest

from robots.catalogue import robot_of
from schemas.geometry import Pose2
from schemas.language import Annotations, Answer, Instruction
from services.mapping.annotations import readings_of
from services.mapping.filter import SemanticFilter
from sim.experiments.arms import Truthful
from sim.experiments.montecarlo import run_job
from sim.experiments.montecarlo_job import Job
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.simulated_user import SimulatedUser
from sim.experiments.table1 import CLARIFIED
from sim.world import make_world
from tests.unit.test_montecarlo_arms import RUN, heard, picture

WORLD = make_world(RUN.world, RUN.seed)
BARE = Instruction(stamp_ns=1, id="a", text="go to the hydrant", source="test")


def beside(object_id: str) -> Pose2:
    pose = WORLD.find(object_id).world_from_object
    return Pose2(pose.x - 1.0, pose.y, 0.0)


def answers(*options: str, robot_at: str = "hydrant_1", intended: str = "hydrant_1") -> list[str]:
    """What the person says when the same question is put twice."""
    truth = Truthful(lambda: beside(robot_at), lambda annotations: ())
    user = SimulatedUser(RUN, (intended,), truth)
    asked = msgspec.structs.replace(heard(BARE), question="?", options=options)
    outputs = [*user.on_annotations(asked), *user.on_annotations(asked)]
    messages = [output.message for output in outputs]
    return [message.text for message in messages if isinstance(message, Answer)]


@pytest.mark.parametrize(("robot_at", "said"), [("hydrant_1", "yes"), ("hydrant_2", "no")])
def test_yes_or_no_is_about_the_thing_beside_the_robot(robot_at: str, said: str) -> None:
    assert answers("yes", "no", robot_at=robot_at) == [said]


@pytest.mark.parametrize(
    ("intended", "said"),
    [("hydrant_1", "go to the hydrant near the cone"), ("hydrant_2", "go to the other hydrant")],
)
def test_of_several_options_the_one_that_names_it_is_picked(intended: str, said: str) -> None:
    options = ("go to the hydrant near the cone", "go to the other hydrant")
    assert answers(*options, intended=intended) == [said]


def test_an_open_question_is_answered_with_a_place_that_fits_no_other() -> None:
    assert answers() == ["behind the cone"]


def test_nothing_is_said_without_a_question() -> None:
    user = SimulatedUser(RUN, ("hydrant_1",), Truthful(lambda: beside("cone_1"), lambda _: ()))
    assert not list(user.on_annotations(heard(BARE)))


def seeing_both(annotations: Annotations) -> SemanticFilter:
    """A filter that has seen all things of the world and then heard this."""
    robot = robot_of(msgspec.structs.replace(RUN, view_range_m=14.0))
    made = SemanticFilter(robot.symbols, robot.camera, 50, np.random.default_rng(0))
    seen = picture()
    places = [(one.world_from_object.x, one.world_from_object.y, 0.4) for one in WORLD.objects]
    table = np.full((len(places), len(seen.classes)), 0.02)
    table[range(len(places)), [seen.classes.index(one.label) for one in WORLD.objects]] = 0.9
    for number in range(8):
        made.observe(
            msgspec.structs.replace(
                seen,
                stamp_ns=number * 200_000_000,
                boxes_px=np.zeros((len(places), 4)),
                probabilities=table,
                scores=np.full(len(places), 0.9),
                centers_base=np.array(places),
                covariances=np.tile(0.01 * np.eye(3), (len(places), 1, 1)),
                extents=np.full((len(places), 3), 0.4),
            )
        )
    made.hear(readings_of(annotations, made.classes), Pose2(0.0, 0.0, 0.0))
    return made


def test_no_hypothesis_takes_what_was_said_no_to_for_the_figure() -> None:
    both = seeing_both(heard(BARE))
    hydrants = [
        int(number)
        for number, row in zip(
            both.objects.columns.number, both.objects.columns.class_log, strict=True
        )
        if both.classes[int(np.argmax(row))] == "hydrant"
    ]
    assert len(hydrants) == 2
    assert set(hydrants) <= set(both.particles.figure.tolist())
    refused = msgspec.structs.replace(heard(BARE), not_meant=(hydrants[0],))
    after = set(seeing_both(refused).particles.figure.tolist())
    assert hydrants[0] not in after
    assert hydrants[1] in after


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_after_a_no_the_robot_finds_the_other_hydrant() -> None:
    (row,) = CLARIFIED
    result = run_job(Job(row.scenario, "ours", 5000, PerceptionSettings()))
    assert result.success
    assert result.questions == 1
    silent = msgspec.structs.replace(row.scenario, answers=False)
    assert not run_job(Job(silent, "ours", 5000, PerceptionSettings())).success
