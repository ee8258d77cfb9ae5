"""What several utterances say stays in the distribution over maps."""

import numpy as np
import pytest

from schemas import topics
from schemas.belief import MapBelief
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.language import Annotations
from schemas.run import RunConfig
from services.grounding import messages
from services.grounding.conformal import load_conformal
from services.grounding.dialogue import Dialogue
from services.grounding.model import GroundingModel
from services.grounding.talk import Meaning
from services.mapping.annotations import readings_of
from services.mapping.clues import Clue, log_factor, unseen_places
from services.mapping.node import MappingNode
from services.mapping.objects import columns
from services.mapping.relation_table import relation_named
from tests.unit.test_mapping_episode import World

pytestmark = pytest.mark.usefixtures("without_learning")

MODEL = GroundingModel.load("husky")
VOCABULARY = ("cone", "hydrant", "building", "tree")


class Talk:
    """A conversation with the grounding, heard by the mapping."""

    def __init__(self, seed: int = 0) -> None:
        self.dialogue = Dialogue(MODEL.understand, MODEL.lexicon, load_conformal("husky"))
        self.node = MappingNode(RunConfig(particles=200), np.random.default_rng(seed))
        self.said: list[Annotations] = []
        self.beliefs: list[MapBelief] = []

    def say(self, text: str, running: str = "") -> None:
        number = len(self.dialogue.said)
        for meaning in self.dialogue.hear(f"i{number}", text, running):
            self.hear(self.message(meaning, number))

    def message(self, meaning: Meaning, number: int) -> Annotations:
        implied = MODEL.behaviors(meaning.understanding)
        said = messages.annotations_message(meaning, implied, self.dialogue.said, number)
        return decode(encode(said), Annotations)

    def hear(self, message: Annotations) -> None:
        self.said.append(message)
        outputs = self.node.on_annotations(message)
        self.beliefs += [one.message for one in outputs if isinstance(one.message, MapBelief)]

    @property
    def belief(self) -> MapBelief:
        return self.beliefs[-1]


def hypotheses(belief: MapBelief, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 2) of hypothesised things of a class, and their particles' weights (n,)."""
    rows = (belief.particle >= 0) & (belief.class_index == belief.classes.index(name))
    return belief.position[rows], belief.weights[belief.particle[rows]]


def share_behind(belief: MapBelief, figure: str, landmark: str) -> float:
    """Weight of the hypotheses in which a figure lies behind its own landmark."""
    total = 0.0
    for particle, weight in enumerate(belief.weights):
        own = belief.particle == particle
        places = [
            belief.position[own & (belief.class_index == belief.classes.index(name))]
            for name in (figure, landmark)
        ]
        if all(len(place) for place in places):
            ray = places[1][0] - [belief.viewer.x, belief.viewer.y]
            total += weight * float((places[0][0] - places[1][0]) @ ray > 0)
    return total


def test_after_a_statement_the_instruction_is_about_the_thing_that_was_stated() -> None:
    talk = Talk()
    talk.say("there is a hydrant behind the building")
    assert share_behind(talk.belief, "hydrant", "building") > 0.95
    talk.say("go to the hydrant")
    assert talk.belief.instruction_id == "i1"
    assert share_behind(talk.belief, "hydrant", "building") > 0.8


def test_without_the_statement_the_hydrant_may_be_anywhere() -> None:
    talk = Talk()
    talk.say("go to the hydrant")
    assert share_behind(talk.belief, "hydrant", "building") == 0.0


def test_the_frame_of_behind_is_that_of_the_moment_when_it_was_said() -> None:
    talk, world = Talk(), World([], false_rate=0.0)
    talk.say("there is a hydrant behind the building")
    for _ in range(40):
        world.step((4.0, 4.0), talk.node)
    talk.say("go to the hydrant")
    assert (talk.belief.viewer.x, talk.belief.viewer.y) == pytest.approx((0.0, 0.0), abs=0.05)
    talk.say("go to the tree behind the cone")
    assert talk.belief.viewer.x > 2.0


def test_extra_information_moves_the_hypotheses_of_what_runs() -> None:
    talk = Talk()
    talk.say("go to the hydrant behind the cone")
    before = len(talk.beliefs)
    talk.say("the cone is near the tree", "i0")
    assert len(talk.beliefs) == before + 1
    assert talk.belief.instruction_id == "i0"
    assert share_behind(talk.belief, "hydrant", "cone") > 0.9


def test_a_clue_tells_two_landmarks_apart() -> None:
    """Two cones are seen, and a barrel beyond the left one."""
    world = World([("cone", 4.0, 2.5), ("cone", 4.0, -2.5), ("barrel", 6.0, 2.0)], false_rate=0.0)
    talk = Talk()
    talk.say("go to the hydrant behind the cone")
    for _ in range(8):
        world.step((0.0, 0.0), talk.node)
    talk.say("the hydrant is near the barrel", "i0")
    assert weight_on_the_left(talk.beliefs[-2]) < 0.8
    assert weight_on_the_left(talk.belief) > 0.85


def weight_on_the_left(belief: MapBelief) -> float:
    places, weights = hypotheses(belief, "hydrant")
    return float(weights[places[:, 1] > 0].sum() / weights.sum())


def test_a_correction_replaces_where_it_is() -> None:
    talk = Talk()
    talk.say("go to the hydrant behind the cone")
    talk.say("no, the one behind the tree", "i0")
    assert talk.belief.instruction_id == "i0"
    assert share_behind(talk.belief, "hydrant", "tree") > 0.9
    assert share_behind(talk.belief, "hydrant", "cone") < 0.1


def test_the_same_evidence_again_changes_nothing() -> None:
    talk = Talk()
    talk.say("there is a hydrant behind the building")
    talk.say("go to the hydrant")
    before = len(talk.beliefs)
    for message in talk.said[-1:]:
        talk.hear(message)
    assert len(talk.beliefs) == before


def test_a_further_relation_becomes_a_clue() -> None:
    talk = Talk()
    talk.say("go to the hydrant behind the cone")
    talk.say("the hydrant is near the building", "i0")
    noted, revised = talk.said[-2:]
    assert readings_of(noted, VOCABULARY) == ()
    reading = readings_of(revised, VOCABULARY)[0]
    assert reading.relation == relation_named("back", comparative=False)
    assert (reading.figure, reading.landmark) == (1, 0)
    (clue,) = reading.clues
    assert (clue.of_figure, clue.other, clue.other_is_landmark) == (True, 2, True)


def test_a_killed_process_gets_all_evidence_from_the_last_message() -> None:
    talk = Talk()
    talk.say("go to the hydrant behind the cone")
    talk.say("the hydrant is near the building", "i0")
    heir = MappingNode(RunConfig(particles=200), np.random.default_rng(5))
    heir.resume()[topics.BELIEF](talk.belief)
    (again,) = heir.on_annotations(talk.said[-1])
    np.testing.assert_array_equal(again.message.weights, talk.belief.weights)  # type: ignore[attr-defined]
    assert not list(heir.on_annotations(talk.said[-1]))


def near_a_building(buildings: list[tuple[float, float]], anchors: np.ndarray) -> np.ndarray:
    """Log factors of "it is near the building" when buildings were seen at some places."""
    things = columns([], len(VOCABULARY))
    if buildings:
        count = len(buildings)
        class_log = np.log(np.tile([0.01, 0.01, 0.97, 0.01], (count, 1)))
        things = type(things)(
            number=np.arange(count, dtype=np.int32),
            mean=np.array(buildings),
            covariance=np.tile(0.01 * np.eye(2), (count, 1, 1)),
            radius=np.full(count, 2.5),
            half_extent=np.full((count, 2), 2.5),
            class_log=class_log,
            existence=np.full(count, 0.97),
        )
    clue = Clue(relation_named("near", False), True, 2, True, 0.2, 2.5)
    here = Pose2(0.0, 0.0, 0.0)
    missed = np.zeros(len(unseen_places(here)))
    return log_factor(
        clue, "figure" if clue.of_figure else "landmark", anchors, things, missed, here
    )


def test_a_clue_prefers_places_near_what_was_seen() -> None:
    anchors = np.array([[10.0, 4.0], [10.0, -6.0], [3.0, -4.0]])
    factors = near_a_building([(10.0, 0.0)], anchors)
    assert factors[0] > 0.5
    assert factors[0] > factors[2] + 1.0


def test_a_clue_about_an_unseen_thing_says_little() -> None:
    anchors = np.array([[x, y] for x in (4.0, 8.0, 12.0) for y in (-4.0, 0.0, 4.0)])
    factors = near_a_building([], anchors)
    assert np.abs(factors).max() < 1.0


def test_a_wrong_clue_is_never_the_end_of_a_hypothesis() -> None:
    assert near_a_building([(10.0, 0.0)], np.array([[-30.0, 20.0]]))[0] > -4.0
