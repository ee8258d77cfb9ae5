"""Grounding as a process: sentences in, annotations out; beliefs in, behaviours out."""

from collections.abc import Iterable

import numpy as np

from schemas import topics
from schemas.belief import MapBelief
from schemas.language import Annotations, Instruction
from schemas.run import RunConfig
from schemas.topics import Handlers, Output
from services.grounding import messages
from services.grounding.model import GroundingModel
from services.grounding.understanding import Understanding


class GroundingNode:
    """Annotation inference once an instruction, behaviour inference in every belief after it."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng  # Inference is exact: nothing is drawn at random.
        self._model = GroundingModel.load(run.robot)
        self._instruction_id = ""
        self._understanding: Understanding | None = None

    def handlers(self) -> Handlers:
        """Instructions, and the beliefs that they are to be carried out in."""
        return {topics.INSTRUCTION: self.on_instruction, topics.BELIEF: self.on_belief}

    def resume(self) -> Handlers:
        """What was understood before; it is not said again."""
        return {topics.ANNOTATIONS: self.on_own_annotations}

    def on_own_annotations(self, said: Annotations) -> Iterable[Output]:
        """Understand the same text again."""
        self._instruction_id = said.instruction_id
        self._understanding = self._model.understand(said.text)
        return ()

    def on_instruction(self, instruction: Instruction) -> Iterable[Output]:
        """Annotation inference: p(alpha_t | utterance), without a map."""
        if instruction.id == self._instruction_id:
            return ()
        self._instruction_id = instruction.id
        self._understanding = self._model.understand(instruction.text)
        implied = self._model.behaviors(self._understanding)
        annotations = messages.annotations_message(instruction, self._understanding, implied)
        return (topics.ANNOTATIONS.of(annotations),)

    def on_belief(self, belief: MapBelief) -> Iterable[Output]:
        """Behaviour inference: p(beta_t | S_t, utterance) in every hypothesis."""
        understanding = self._understanding
        if (
            understanding is None
            or not understanding.intents
            or belief.instruction_id != self._instruction_id
        ):
            return ()
        worlds = messages.hypotheses(belief, self._model.names)
        grounded = self._model.behaviors_in_belief(understanding, [one.world for one in worlds])
        intent = understanding.intents[0]
        return (topics.BEHAVIORS.of(messages.behaviors_message(belief, intent, worlds, grounded)),)
