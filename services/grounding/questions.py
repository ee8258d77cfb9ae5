"""The questions that can be asked, what each is worth, and readings in words.

Of all questions the one with the greatest expected drop of entropy, less the cost of asking, is
put (Tellex et al. 2013; Hemachandra et al. 2014): a yes or a no is cheaper to give than a choice.
"""

import difflib
import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from services.grounding.lexicon import Lexicon, constituents
from services.grounding.symbols import ROBOT, UNKNOWN
from services.grounding.understanding import Intent, Understanding

MAX_OPTIONS = 4
"""More than a person wants to read."""
YES_NO = ("yes", "no")

_ANSWER_COST = 0.3
_YES_NO_COST = 0.1
"""What it costs a person to answer [nats]."""
_SHARPNESS = 10.0
"""How fast the probability of a meaning grows with the likeness of the words."""
_ALIKE = 0.65
"""Likeness of words that are as probable to mean the same as not."""
_NONE_OF_THEM = 0.5
"""Weight of all meanings that nobody thought of."""
_NEVER_MEANT = (UNKNOWN, ROBOT, "generic")
"""Names that stand for no particular thing."""
_VERBS = {"navigate": "go to", "pick": "pick up", "retrieve": "retrieve"}
_RELATION_WORDS = {
    "back": "behind",
    "front": "in front of",
    "left": "left of",
    "right": "right of",
    "away": "away from",
}


class Kind(StrEnum):
    """What a question is about."""

    WORD = "word"
    """What an unknown word means; the options are known words."""
    CHOICE = "choice"
    """Which of several readings is meant; the options are whole instructions."""
    REFERENT = "referent"
    """Which of several seen things is meant; the options are whole instructions."""
    PLACE = "place"
    """Where something is that was not found."""
    REPEAT = "repeat"
    """Nothing was understood; any answer is a new instruction."""


@dataclass(frozen=True)
class Question:
    """One short question."""

    kind: Kind
    text: str
    subject: str = ""
    """The unknown word, or the class that is looked for."""
    meanings: tuple[str, ...] = ()
    """What can be answered, likeliest first; a single one is asked with yes or no."""
    chances: tuple[float, ...] = ()
    """Probability of each of `meanings`; the rest is something else."""
    nodes: tuple[int, ...] = ()
    """Seen thing that each of `meanings` names, if they name things."""

    @property
    def options(self) -> tuple[str, ...]:
        """Short answers to choose from; empty for an open question."""
        return YES_NO if len(self.meanings) == 1 else self.meanings

    @property
    def gain(self) -> float:
        """Expected drop of entropy less the cost of asking [nats]."""
        rest = max(0.0, 1.0 - sum(self.chances))
        cost = _YES_NO_COST if len(self.meanings) == 1 else _ANSWER_COST
        return entropy((*self.chances, rest)) - cost


def entropy(probabilities: Iterable[float]) -> float:
    """Shannon entropy [nats]."""
    return -sum(p * math.log(p) for p in probabilities if p > 0.0)


def best_question(candidates: Iterable[Question], asked: Collection[str]) -> Question | None:
    """The question that is worth most, among those that were not asked and are worth anything."""
    fresh = [one for one in candidates if one.text not in asked and one.gain > 0.0]
    return max(fresh, key=lambda one: one.gain, default=None)


def word_questions(
    understanding: Understanding, lexicon: Lexicon, refused: Mapping[str, Collection[str]]
) -> list[Question]:
    """What each unknown word may mean: the likeliest meaning, and the likeliest few.

    Args:
        understanding: of the text.
        lexicon: known words.
        refused: meanings of each word that the person has said no to.
    """
    found: list[Question] = []
    for word in understanding.unknown_words:
        is_verb = f"(VB {word})" in understanding.parse
        chances = _meanings(word, is_verb, lexicon, refused.get(word, ()))
        ranked = sorted(chances.items(), key=lambda item: -item[1])[:MAX_OPTIONS]
        if ranked:
            found += [_word_question(word, ranked[:1]), _word_question(word, ranked)]
    return found


def _word_question(word: str, ranked: list[tuple[str, float]]) -> Question:
    named = either(tuple(with_article(meaning) for meaning, _ in ranked))
    text = f'By "{word}" do you mean {named}?'
    meanings, chances = zip(*ranked, strict=True)
    return Question(Kind.WORD, text, word, meanings, chances)


def _meanings(
    word: str, is_verb: bool, lexicon: Lexicon, refused: Collection[str]
) -> dict[str, float]:
    """Probability of each known meaning of a word, by how alike their words are."""
    kind = "action" if is_verb else "class"
    names = [n for n in constituents(lexicon.symbols)[kind] if n not in _NEVER_MEANT]
    said = {name: _VERBS.get(name, name) for name in names}
    likeness = {said[name]: _likeness(word, kind, name, lexicon) for name in names}
    weights = {
        meaning: math.exp(_SHARPNESS * (like - _ALIKE)) for meaning, like in likeness.items()
    }
    open_ones = {meaning: weight for meaning, weight in weights.items() if meaning not in refused}
    total = sum(open_ones.values()) + _NONE_OF_THEM
    return {meaning: weight / total for meaning, weight in open_ones.items()}


def _likeness(word: str, kind: str, name: str, lexicon: Lexicon) -> float:
    """Of a word to the likest word for a symbol, in [0, 1]."""
    entries = (e for e in lexicon.content_words() if (kind, name) in e.meanings)
    known = {" ".join(entry.words) for entry in entries} | {name}
    return max(difflib.SequenceMatcher(None, word, other).ratio() for other in known)


def choice_question(intents: tuple[Intent, ...]) -> Question:
    """Which of several readings is meant."""
    kept = intents[:MAX_OPTIONS]
    meanings = tuple(sentence(intent) for intent in kept)
    chances = tuple(intent.probability for intent in kept)
    return Question(Kind.CHOICE, f"Do you mean {either(meanings)}?", "", meanings, chances)


def place_question(name: str) -> Question:
    """Where a thing is that was not found, and of which nobody said where."""
    return Question(Kind.PLACE, f"Where is the {name}?", name)


def referent_question(
    intent: Intent, phrases: tuple[str, ...], chances: tuple[float, ...], nodes: tuple[int, ...]
) -> Question:
    """Which of several seen things is meant, or whether the only one is.

    Args:
        intent: what is to be done with it.
        phrases: "the hydrant near the cone", one for each.
        chances: probability of each.
        nodes: id of each.
    """
    bare = sentence(replace(intent, relation=UNKNOWN, landmark=UNKNOWN))
    verb = bare.partition(" the ")[0]
    kept = phrases[:MAX_OPTIONS]
    return Question(
        Kind.REFERENT,
        f"Do you mean {either(kept)}?",
        intent.object,
        tuple(f"{verb} {phrase}" for phrase in kept),
        chances[:MAX_OPTIONS],
        nodes[:MAX_OPTIONS],
    )


def sentence(intent: Intent) -> str:
    """A reading as a person would say it, in words that are understood again."""
    verb = _VERBS.get(intent.action, intent.action)
    if intent.object == ROBOT:
        return f"go {place(intent)}"
    mode = "" if intent.mode == UNKNOWN else intent.mode
    words = (verb, "the", intent.object, place(intent), mode)
    return " ".join(word for word in words if word)


def place(intent: Intent) -> str:
    """Where a reading says that its object is, "" if it does not."""
    if UNKNOWN in (intent.relation, intent.landmark):
        return ""
    word = _RELATION_WORDS.get(intent.relation, intent.relation)
    landmark = "you" if intent.landmark == ROBOT else f"the {intent.landmark}"
    return f"{'nearest to' if intent.comparative else word} {landmark}"


def with_article(meaning: str) -> str:
    """A noun as it is asked for, or a verb in quotation marks."""
    if meaning in _VERBS.values():
        return f'"{meaning}"'
    return f"{'an' if meaning[0] in 'aeiou' else 'a'} {meaning}"


def either(items: tuple[str, ...]) -> str:
    """A list with "or" before the last item."""
    *first, last = items
    return f"{', '.join(first)} or {last}" if first else last
