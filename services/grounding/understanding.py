"""What a sentence was understood to mean, before any map."""

from collections.abc import Mapping
from dataclasses import dataclass

from services.grounding.features import SymbolSet
from services.grounding.symbols import ROBOT, UNKNOWN, Symbol, SymbolTable

_LEAST_SPECIFIC = (UNKNOWN, "near", "away")


@dataclass(frozen=True)
class Annotation:
    """One reading as a statement about the world (paper, Eq. annotation-symbol-space)."""

    probability: float
    objects: tuple[str, ...]
    """Classes and locations that must exist, sorted; never the robot or an unknown class."""
    relations: tuple[tuple[str, str, str], ...]
    """(relation, figure class, landmark class), sorted; the landmark may be the robot."""


@dataclass(frozen=True)
class Intent:
    """One reading as something to do, in classes: a behaviour before any map."""

    probability: float
    action: str
    object: str
    """Class to go to; "robot" for "go behind the car": a place for the robot itself."""
    mode: str
    relation: str
    """Of the object to the landmark; "unknown" if there is none."""
    landmark: str
    """Class; "unknown" if there is none."""
    comparative: bool
    """True for "nearest": no other object of the class stands closer to the landmark."""


@dataclass(frozen=True)
class Understanding:
    """Distribution over readings of one text (paper, sec:nlu)."""

    text: str
    understood: bool
    """False if nothing certain enough can be done or noted down."""
    parse: str
    """Best tree in brackets, "" for a text without words."""
    parse_probability: float
    partial: bool
    """True if the tree only collects fragments."""
    annotations: tuple[Annotation, ...]
    """Best first; their probabilities and `other_mass` sum to one."""
    intents: tuple[Intent, ...]
    """Best first; with `statement_mass` and `other_mass` they sum to one.

    Of a sequence, what is to be done first.
    """
    steps: tuple[Intent, ...]
    """What is to be done one after the other; the first is the best intent, most have no other."""
    correction: bool
    """Whether the text takes back an earlier one: "no, the one behind the tree"."""
    statement_mass: float
    """Probability that nothing is to be done."""
    other_mass: float
    """Probability of the readings that the K-best search left out."""
    unknown_words: tuple[str, ...]
    suggestions: dict[str, tuple[str, ...]]
    """Nearest known words of each unknown word, if any are near."""
    possible: tuple[str, ...]
    """What can be said to this robot, one line a kind."""
    question: str | None
    """What to ask the person, None if nothing."""


AnnotationKey = tuple[tuple[str, ...], tuple[tuple[str, str, str], ...]]
IntentKey = tuple[str, str, str, str, str, bool]


def annotations_of(
    readings: Mapping[SymbolSet, float], table: SymbolTable
) -> tuple[Annotation, ...]:
    """Sums the probability of readings that say the same about the world."""
    masses: dict[AnnotationKey, float] = {}
    for symbols, probability in readings.items():
        key = _annotation([table.symbols[at] for at in symbols])
        masses[key] = masses.get(key, 0.0) + probability
    ranked = sorted(masses.items(), key=lambda item: (-item[1], item[0]))
    return tuple(Annotation(probability, *key) for key, probability in ranked)


def intents_of(
    readings: Mapping[SymbolSet, float], table: SymbolTable
) -> tuple[tuple[Intent, ...], float]:
    """Sums the probability of readings that ask for the same; also the mass that asks nothing."""
    masses: dict[IntentKey | None, float] = {None: 0.0}
    for symbols, probability in readings.items():
        key = _intent(sorted(symbols), table)
        masses[key] = masses.get(key, 0.0) + probability
    nothing = masses.pop(None)
    ranked = sorted(((key, p) for key, p in masses.items() if key), key=lambda kp: (-kp[1], kp[0]))
    return tuple(Intent(probability, *key) for key, probability in ranked), nothing


def _annotation(symbols: list[Symbol]) -> AnnotationKey:
    named = {symbol.head for symbol in symbols if symbol.kind == "class"}
    named.update(name for symbol in symbols for name in symbol.arguments)
    facts = (s for s in symbols if s.kind == "fact" and UNKNOWN not in (s.head, *s.arguments))
    relations = sorted((s.head, s.arguments[0], s.arguments[1]) for s in facts)
    return tuple(sorted(named - {ROBOT, UNKNOWN})), tuple(relations)


def _intent(symbols: list[int], table: SymbolTable) -> IntentKey | None:
    found = [table.symbols[at] for at in symbols]
    actions = [symbol for symbol in found if symbol.kind == "action"]
    if not actions:
        return None
    # A known action of a known object beats a spurious second one.
    action = max(actions, key=lambda s: (s.head != UNKNOWN, s.arguments[0] not in (UNKNOWN, ROBOT)))
    comparative = any(symbol.kind == "degree" for symbol in found)
    places = _places(found, action.arguments[0])
    relation, landmark = _chosen(places, comparative)
    mode = next((symbol.head for symbol in found if symbol.kind == "mode"), UNKNOWN)
    return (action.head, action.arguments[0], mode, relation, landmark, comparative)


def _places(symbols: list[Symbol], goal: str) -> list[tuple[str, str]]:
    """(relation, landmark) pairs that say where the goal is."""
    facts = [s for s in symbols if s.kind == "fact" and s.arguments[0] == goal]
    regions = [s for s in symbols if s.kind == "region" and goal == ROBOT]
    return [(s.head, s.arguments[-1]) for s in facts + regions if s.head != UNKNOWN]


def _chosen(places: list[tuple[str, str]], comparative: bool) -> tuple[str, str]:
    """The relation that narrows the goal most: a superlative needs near, otherwise a direction."""
    if comparative:
        places = [place for place in places if place[0] == "near"] or places
    specific = [place for place in places if place[0] not in _LEAST_SPECIFIC]
    return next(iter(specific or places), (UNKNOWN, UNKNOWN))
