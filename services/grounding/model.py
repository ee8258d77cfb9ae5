"""The grounding model of one robot: text to understanding, understanding to behaviours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.symbols import get_symbols
from services.grounding import behavior, doubt
from services.grounding.behavior import NONE, PAIR_FEATURES, Objects
from services.grounding.dcg import CorrespondenceGraph, Weights
from services.grounding.features import SymbolSet
from services.grounding.grammar import Grammar
from services.grounding.lexicon import Lexicon
from services.grounding.parser import Parse, parse
from services.grounding.symbols import SymbolTable
from services.grounding.text import MAX_WORDS, tokenize
from services.grounding.understanding import (
    Intent,
    Understanding,
    annotations_of,
    intents_of,
)
from services.grounding.weights import load_weights, weights_path
from services.grounding.world import WorldObjects, implied_world

NEGLIGIBLE_PARSE = 0.005
"""Trees below this posterior are not grounded; their mass is reported as lost."""
NEGLIGIBLE_INTENT = 0.01
"""Intents below this probability are not looked for in maps; their mass is reported as lost."""


@dataclass(frozen=True)
class Behavior:
    """One thing to do with particular objects of one map hypothesis (Γ^{A_O})."""

    probability: float
    action: str
    object: str
    """Class of the object, "robot" where the robot itself is to be placed."""
    object_index: int
    """Row in the hypothesis, `NONE` (-1) for the robot itself."""
    mode: str
    relation: str
    landmark: str
    """Class of the landmark, "unknown" if there is none."""
    landmark_index: int
    """Row in the hypothesis, `NONE` (-1) for no landmark, the robot, or one the map lacks."""
    comparative: bool


@dataclass(frozen=True)
class BehaviorDistribution:
    """p(β | S, Λ) in one map hypothesis; all masses sum to one (paper, Eq. basic-1)."""

    behaviors: tuple[Behavior, ...]
    """Best first."""
    nothing_fits: float
    """Probability that what is meant is not in this map: the reason to explore."""
    statement_mass: float
    """Probability that nothing is to be done."""
    other_mass: float
    """Probability of readings that the search left out."""


class GroundingModel:
    """Parser, correspondence graph and pair model of one robot."""

    def __init__(
        self, lexicon: Lexicon, weights: Weights, pair_weights: NDArray[np.float64]
    ) -> None:
        self.table = SymbolTable(lexicon.symbols)
        self.lexicon = lexicon
        self.grammar = Grammar.load()
        self.pair_weights = pair_weights
        """Weight of each of `PAIR_FEATURES`."""
        self._graph = CorrespondenceGraph(self.table, lexicon, weights)
        self._possible = doubt.possible(lexicon)

    @classmethod
    def load(cls, robot: str) -> "GroundingModel":
        """Reads the robot's trained weights.

        Raises:
            UnknownLanguageError: no robot of that name has words.
            GroundingError: the robot has no weights, or the weights are of another version.
        """
        symbols = get_symbols(robot)
        lexicon = Lexicon.load(symbols)
        path = weights_path(robot)
        weights, extra = load_weights(path, SymbolTable(symbols))
        pair_weights = np.array([extra["pairs"].get(name, 0.0) for name in PAIR_FEATURES])
        return cls(lexicon, weights, pair_weights)

    @property
    def names(self) -> tuple[str, ...]:
        """Object classes followed by locations: what `WorldObjects.classes` refers to."""
        return self.table.names["class"]

    def understand(self, text: str) -> Understanding:
        """Annotation inference: what the text says about the world and asks for, without a map.

        Any text gives an answer. Equal texts give equal answers.
        """
        tokens = self.lexicon.strip_fillers(tokenize(text))
        if not tokens or len(tokens) > MAX_WORDS:
            return self._refused(text, len(tokens))
        parses = parse(tokens, self.lexicon, self.grammar)
        return self._understanding(text, parses, self._readings(parses))

    def readings(self, text: str) -> dict[SymbolSet, float]:
        """p(symbols of the whole sentence | text), less the mass of sets left out."""
        tokens = self.lexicon.strip_fillers(tokenize(text))[:MAX_WORDS]
        return self._readings(parse(tokens, self.lexicon, self.grammar))

    def _readings(self, parses: Sequence[Parse]) -> dict[SymbolSet, float]:
        self._graph.forget()
        readings: dict[SymbolSet, float] = {}
        for one in parses:
            if one.probability < NEGLIGIBLE_PARSE:
                continue
            for symbols, probability in self._graph.infer(one.tree).items():
                mass = one.probability * probability
                readings[symbols] = readings.get(symbols, 0.0) + mass
        return readings

    def _understanding(
        self, text: str, parses: Sequence[Parse], readings: dict[SymbolSet, float]
    ) -> Understanding:
        best = parses[0]
        annotations = annotations_of(readings, self.table)
        intents, statement_mass = intents_of(readings, self.table)
        words = doubt.unknown_words(best.tree, self.lexicon)
        near = doubt.suggestions(words, self.lexicon)
        understood = doubt.is_understood(annotations, intents, statement_mass, best.partial, words)
        return Understanding(
            text=text,
            understood=understood,
            parse=best.tree.bracket(),
            parse_probability=best.probability,
            partial=best.partial,
            annotations=annotations,
            intents=intents,
            statement_mass=statement_mass,
            other_mass=max(0.0, 1.0 - sum(readings.values())),
            unknown_words=words,
            suggestions=near,
            possible=self._possible,
            question=doubt.question(understood, words, near, intents),
        )

    def _refused(self, text: str, words: int) -> Understanding:
        """The answer to a text that cannot be parsed: no words at all, or far too many."""
        wanted = f"at most {MAX_WORDS} words (these are {words})"
        question = f"Please say it in {wanted}." if words else "What shall I do, and where?"
        return Understanding(
            text=text,
            understood=False,
            parse="",
            parse_probability=0.0,
            partial=True,
            annotations=(),
            intents=(),
            statement_mass=0.0,
            other_mass=1.0,
            unknown_words=(),
            suggestions={},
            possible=self._possible,
            question=question,
        )

    def behaviors(
        self, understanding: Understanding, world: WorldObjects | None = None
    ) -> BehaviorDistribution:
        """Behaviour inference in one map hypothesis.

        Args:
            understanding: of the instruction.
            world: the hypothesis; without it, the map that the best annotation implies.
        """
        if world is None and not understanding.annotations:
            return _lost(understanding, understanding.other_mass)
        if world is None:
            world = implied_world(understanding.annotations[0], self.names)
        return self.behaviors_in_belief(understanding, (world,))[0]

    def behaviors_in_belief(
        self, understanding: Understanding, worlds: Sequence[WorldObjects]
    ) -> tuple[BehaviorDistribution, ...]:
        """Behaviour inference in all hypotheses of a belief at once, in their order.

        No hypothesis's answer depends on the others.
        """
        if not worlds:
            return ()
        objects = Objects.join(worlds)
        kept = [i for i in understanding.intents if i.probability >= NEGLIGIBLE_INTENT]
        if not understanding.understood or _is_statement(understanding):
            kept = []
        found: list[list[Behavior]] = [[] for _ in worlds]
        nothing = np.zeros(len(worlds))
        for intent in kept:
            nothing += self._ground(intent, objects, found)
        lost = 1.0 - understanding.statement_mass - sum(intent.probability for intent in kept)
        return tuple(
            BehaviorDistribution(
                tuple(sorted(behaviors, key=lambda one: -one.probability)),
                float(mass),
                understanding.statement_mass,
                max(0.0, lost),
            )
            for behaviors, mass in zip(found, nothing, strict=True)
        )

    def _ground(
        self, intent: Intent, objects: Objects, found: list[list[Behavior]]
    ) -> NDArray[np.float64]:
        """Adds the behaviours of one intent to `found`; returns its "none" mass by hypothesis."""
        pairs = behavior.candidates(intent, objects, self.names)
        logits = behavior.features(intent, pairs, objects) @ self.pair_weights
        logits += behavior.prior(intent, pairs, len(found))
        probabilities, none = behavior.pair_probabilities(logits, pairs.world, len(found))
        columns = (
            pairs.world.tolist(),
            _local(pairs.figure, pairs.world, objects),
            _local(pairs.landmark, pairs.world, objects),
            (intent.probability * probabilities).tolist(),
        )
        for world, figure, landmark, probability in zip(*columns, strict=True):
            found[world].append(_behavior(intent, figure, landmark, probability))
        return intent.probability * none


def _is_statement(understanding: Understanding) -> bool:
    intents = understanding.intents
    return not intents or intents[0].probability < understanding.statement_mass


def _local(rows: NDArray[np.int64], world: NDArray[np.int64], objects: Objects) -> list[int]:
    """Rows of the joined columns as rows of their own hypothesis."""
    return np.where(rows == NONE, NONE, rows - objects.starts[world]).tolist()


def _behavior(intent: Intent, figure: int, landmark: int, probability: float) -> Behavior:
    return Behavior(
        probability=probability,
        action=intent.action,
        object=intent.object,
        object_index=figure,
        mode=intent.mode,
        relation=intent.relation,
        landmark=intent.landmark,
        landmark_index=landmark,
        comparative=intent.comparative,
    )


def _lost(understanding: Understanding, mass: float) -> BehaviorDistribution:
    return BehaviorDistribution((), 0.0, understanding.statement_mass, mass)
