"""What several utterances say together: p(alpha_t | all that was said) from each of them alone.

An utterance that names a thing speaks, very likely, of the thing that earlier ones named with the
same word. So "go to the hydrant" after "there is a hydrant behind the building" is a hydrant
behind the building with `SAME_THING`, and any hydrant otherwise; both readings go to the map.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from services.grounding.questions import place
from services.grounding.symbols import ROBOT, UNKNOWN
from services.grounding.understanding import Annotation, Intent, Understanding

SAME_THING = 0.9
"""Probability that two utterances with the same word mean the same thing."""
CERTAIN_ENOUGH = 0.35
"""A relation below this probability is not remembered."""
MAX_ALTERNATIVES = 3
MAX_CHAINED = 5
"""Things whose own places are looked up, one after the other."""

Relation = tuple[str, str, str]
"""(relation, figure class, landmark class)."""


@dataclass(frozen=True)
class Fact:
    """One relation that was said to hold."""

    relation: Relation
    probability: float
    source: str
    """Id of the utterance."""
    definite: bool
    """True for "the hydrant is ...": about the thing already spoken of, and it adds to the rest.

    False where a thing is introduced, which then may be another one.
    """

    @property
    def figure(self) -> str:
        """Class of the thing that is placed."""
        return self.relation[1]


@dataclass(frozen=True)
class _World:
    """What one reading says, with what the other utterances add to it."""

    probability: float
    objects: frozenset[str]
    relations: tuple[Relation, ...]

    def places(self, name: str) -> bool:
        return any(figure == name for _, figure, _ in self.relations)

    def told(self, share: float, facts: Iterable[Fact]) -> "_World":
        added = [fact.relation for fact in facts if fact.relation not in self.relations]
        named = {name for _, figure, landmark in added for name in (figure, landmark)}
        objects = self.objects | (named - {ROBOT})
        return _World(self.probability * share, objects, (*self.relations, *added))


def facts_of(understanding: Understanding, source: str, definite: bool) -> tuple[Fact, ...]:
    """The relations that an utterance very probably states."""
    masses: dict[Relation, float] = {}
    for one in understanding.annotations:
        for relation in one.relations:
            masses[relation] = masses.get(relation, 0.0) + one.probability
    kept = {relation: min(mass, 1.0) for relation, mass in masses.items() if mass >= CERTAIN_ENOUGH}
    return tuple(Fact(relation, mass, source, definite) for relation, mass in kept.items())


def joint(understanding: Understanding, facts: Sequence[Fact]) -> tuple[Understanding, str]:
    """An understanding together with facts from other utterances.

    Returns:
        The understanding, whose masses still sum to one, and the id of the utterance that says
        where the goal is, "" where the text itself does.
    """
    annotations = _merged(world for one in understanding.annotations for world in _told(one, facts))
    split = [pair for one in understanding.intents for pair in _placed(one, facts)]
    split.sort(key=lambda pair: -pair[0].probability)
    intents = tuple(intent for intent, _ in split)
    viewpoint = split[0][1] if split else ""
    return replace(understanding, annotations=annotations, intents=intents), viewpoint


def _told(annotation: Annotation, facts: Sequence[Fact]) -> list[_World]:
    objects = frozenset(annotation.objects)
    worlds = [_World(annotation.probability, objects, annotation.relations)]
    queue, chained = sorted(objects), 0
    while queue and chained < MAX_CHAINED:
        name, chained = queue.pop(0), chained + 1
        known = {known for world in worlds for known in world.objects}
        worlds = [told for world in worlds for told in _tell(world, name, facts)]
        queue += sorted({n for world in worlds for n in world.objects} - known)
    return worlds


def _tell(world: _World, name: str, facts: Sequence[Fact]) -> list[_World]:
    """The world as it is, and with what others say about one of its things."""
    alternatives = _alternatives(name, world.places(name), facts)
    news = [told for told in alternatives if any(f.relation not in world.relations for f in told)]
    if not news:
        return [world]
    share = SAME_THING * min(fact.probability for told in news for fact in told)
    worlds = [world.told(share / len(news), told) for told in news]
    return [*worlds, replace(world, probability=world.probability * (1.0 - share))]


def _alternatives(name: str, placed: bool, facts: Sequence[Fact]) -> list[tuple[Fact, ...]]:
    """Sets of facts about a thing that may hold together, the newest first."""
    about = {fact.relation: fact for fact in facts if fact.figure == name}
    newest = list(about.values())[::-1]
    added = tuple(fact for fact in newest if fact.definite)
    introduced = [] if placed else [f for f in newest if not f.definite][:MAX_ALTERNATIVES]
    return [(*added, one) for one in introduced] or ([added] if added else [])


def _placed(intent: Intent, facts: Sequence[Fact]) -> list[tuple[Intent, str]]:
    """A reading as it is, and at the places where others say its object is; with the sources."""
    if place(intent) or intent.object in (ROBOT, UNKNOWN) or intent.comparative:
        return [(intent, "")]
    told = [facts[0] for facts in _alternatives(intent.object, False, facts)]
    if not told:
        return [(intent, "")]
    share = SAME_THING * min(fact.probability for fact in told)
    found = [(_at(intent, fact, share / len(told)), fact.source) for fact in told]
    return [*found, (replace(intent, probability=intent.probability * (1.0 - share)), "")]


def _at(intent: Intent, fact: Fact, share: float) -> Intent:
    relation, _, landmark = fact.relation
    probability = intent.probability * share
    return replace(intent, probability=probability, relation=relation, landmark=landmark)


def _merged(worlds: Iterable[_World]) -> tuple[Annotation, ...]:
    """Annotations, best first, with what is equal summed up."""
    masses: dict[tuple[tuple[str, ...], tuple[Relation, ...]], float] = {}
    for world in worlds:
        key = (tuple(sorted(world.objects)), tuple(sorted(world.relations)))
        masses[key] = masses.get(key, 0.0) + world.probability
    ranked = sorted(masses.items(), key=lambda item: (-item[1], item[0]))
    return tuple(Annotation(probability, *key) for key, probability in ranked)
