"""Grounding as a process: sentences in, annotations out; beliefs in, behaviours out."""

from collections.abc import Iterable

import numpy as np

from schemas import topics
from schemas.belief import MapBelief
from schemas.language import Annotations, Answer, Behaviors, Instruction
from schemas.run import RunConfig
from schemas.task import InstructionStatus, TaskState
from schemas.topics import Handlers, Output
from services.grounding import messages
from services.grounding.conformal import load_conformal
from services.grounding.dialogue import Dialogue
from services.grounding.model import GroundingModel
from services.grounding.talk import Meaning


class GroundingNode:
    """Annotation inference for every utterance, behaviour inference in every belief after it."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng  # Inference is exact: nothing is drawn at random.
        self._model = GroundingModel.load(run.robot)
        conformal = load_conformal(run.robot)
        self._dialogue = Dialogue(self._model.understand, self._model.lexicon, conformal)
        self._meaning: Meaning | None = None
        self._heard_ns = 0
        self._running = ""

    def handlers(self) -> Handlers:
        """What people say, what became of it, and the beliefs that it is carried out in."""
        return {
            topics.INSTRUCTION: self.on_instruction,
            topics.ANSWER: self.on_answer,
            topics.BELIEF: self.on_belief,
            topics.INSTRUCTION_STATUS: self.on_status,
        }

    def resume(self) -> Handlers:
        """What was understood before; it is not said again."""
        return {topics.ANNOTATIONS: self.on_own_annotations}

    def on_own_annotations(self, told: Annotations) -> Iterable[Output]:
        """Take up the conversation where it was."""
        self._dialogue.restore(told.said, told.revision, told.instruction_id, told.not_meant)
        self._heard_ns = told.stamp_ns
        return ()

    def on_instruction(self, instruction: Instruction) -> Iterable[Output]:
        """Annotation inference: p(alpha_t | all utterances), without a map."""
        if self._dialogue.knows(instruction.id):
            return
        for meaning in self._dialogue.hear(instruction.id, instruction.text, self._running):
            yield self._tell(meaning, instruction.stamp_ns)

    def on_answer(self, answer: Answer) -> Iterable[Output]:
        """The same again, with an answer; without an open question it says nothing."""
        meaning = self._dialogue.answer(answer.text, answer.instruction_id)
        if meaning is not None:
            yield self._tell(meaning, answer.stamp_ns)

    def on_status(self, status: InstructionStatus) -> Iterable[Output]:
        """Know which instruction later utterances are about."""
        if status.state is TaskState.ACTIVE:
            self._running = status.instruction_id
        else:
            self._dialogue.close(status.instruction_id)
            self._running = "" if self._running == status.instruction_id else self._running
        return ()

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Behaviour inference: p(beta_t | S_t, utterances) in every hypothesis."""
        if self._meaning is None or belief.instruction_id != self._meaning.instruction_id:
            self._meaning = self._dialogue.meaning_of(belief.instruction_id)
        if self._meaning is None or not self._meaning.understanding.intents:
            return
        understanding = self._meaning.understanding
        worlds = messages.hypotheses(belief, self._model.names)
        grounded = self._model.behaviors_in_belief(understanding, [one.world for one in worlds])
        intent = understanding.intents[0]
        behaviors = messages.behaviors_message(
            belief, intent, worlds, grounded, self._meaning.not_meant
        )
        yield topics.BEHAVIORS.of(behaviors)
        yield from self._doubt(belief, behaviors)

    def _doubt(self, belief: MapBelief, behaviors: Behaviors) -> Iterable[Output]:
        """Ask about what the map leaves open, while the robot goes on."""
        if belief.instruction_id != self._running:
            return
        searching_s = (belief.stamp_ns - self._heard_ns) / 1e9
        scene = messages.scene_of(belief, behaviors)
        meaning = self._dialogue.look(belief.instruction_id, scene, searching_s)
        if meaning is not None:
            yield self._tell(meaning, belief.stamp_ns)

    def _tell(self, meaning: Meaning, stamp_ns: int) -> Output:
        if meaning.understanding.understood and not meaning.revises:
            if self._meaning is None or self._meaning.instruction_id != meaning.instruction_id:
                self._heard_ns = stamp_ns
            self._meaning = meaning
        implied = self._model.behaviors(meaning.understanding)
        message = messages.annotations_message(meaning, implied, self._dialogue.said, stamp_ns)
        return topics.ANNOTATIONS.of(message)
