"""Binary features of one factor: phrase x symbol, and phrase x (symbol against child symbols).

The logit of "symbol γ is true at phrase λ given the child symbols Γ" is

    sum over l in language(λ, Γ) of  [ sum over a in attributes(γ) of W[l, a]
                                     + sum over m in matches(γ, λ, Γ) of V[l, m] ]

Training and inference call the same functions, so that their features cannot differ.  There are no
features of class pairs: composition must come from the matches, which is what makes relations
between classes that never stood together in the corpus work.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from services.grounding.lexicon import Lexicon
from services.grounding.symbols import KINDS, ROBOT, UNKNOWN, SymbolTable
from services.grounding.tree import Phrase

SymbolSet = frozenset[int]
Pair = tuple[int, int]

MATCHES = (
    "carried",
    "class.child",
    "class.own",
    "relation.child",
    "relation.own",
    "region.same",
    "region.relation_own",
    "region.relation_child",
    "region.landmark_child",
    "region.own_of_child",
    "region.child_of_child",
    "region.own_of_robot",
    "region.child_of_robot",
    "fact.same",
    "fact.figure",
    "fact.region",
    "fact.figure_in_region",
    "fact.own_relation_to_child",
    "action.same",
    "action.own",
    "action.object_child",
    "action.own_on_child",
    "action.own_on_robot",
    "action.own_motion",
    "mode.child",
    "mode.own",
    "degree.child",
    "degree.own",
)
KIND_OF_TAG = {"NN": "class", "IN": "relation", "VB": "action"}
"""What words of a part of speech denote."""
MOTION = "navigate"
"""The action that needs a place and no object."""
CARRIED = ("fact", "action", "mode", "degree")
"""Kinds of symbol that a phrase says as well if one below it does, wherever it stands."""


class FactorFeatures(Protocol):
    """What inference and training need to know of one space of symbols."""

    @property
    def match_names(self) -> tuple[str, ...]:
        """Names of the match features."""
        ...

    @property
    def attributes(self) -> tuple[str, ...]:
        """Names of the static attributes; the last one is a pad without weights."""
        ...

    @property
    def attributes_of(self) -> NDArray[np.int64]:
        """Attribute indices of every symbol, its kind first (N, 4)."""
        ...

    def language(self, phrase: Phrase, children: SymbolSet) -> tuple[str, ...]:
        """Names of the language features of a phrase whose children denote `children`."""
        ...

    def matches(self, phrase: Phrase, children: SymbolSet) -> "Iterator[Hit]":
        """Yields (match feature, indices of all symbols that have it)."""
        ...


Hit = tuple[str, NDArray[np.int64]]


@dataclass
class Evidence:
    """What the child phrases (or a phrase's own words) denote, as constituent indices."""

    classes: set[int] = field(default_factory=set[int])
    relations: set[int] = field(default_factory=set[int])
    regions: set[Pair] = field(default_factory=set[Pair])
    facts: set[int] = field(default_factory=set[int])
    """Flat indices into the fact block."""
    actions: set[Pair] = field(default_factory=set[Pair])
    verbs: set[int] = field(default_factory=set[int])
    modes: set[int] = field(default_factory=set[int])
    degrees: set[int] = field(default_factory=set[int])


def of_children(table: SymbolTable, symbols: SymbolSet) -> Evidence:
    """Sorts the symbols that are true at the child phrases by kind."""
    found = Evidence()
    single = {
        "class": found.classes,
        "relation": found.relations,
        "fact": found.facts,
        "mode": found.modes,
        "degree": found.degrees,
    }
    for symbol in symbols:
        kind = KINDS[int(table.kind_of[symbol])]
        block = table.blocks[kind]
        offset = symbol - int(block.flat[0])
        if kind in single:
            single[kind].add(offset)
        else:
            pairs = found.regions if kind == "region" else found.actions
            pairs.add(divmod(offset, block.shape[1]))
    return found


def of_words(table: SymbolTable, lexicon: Lexicon, phrase: Phrase) -> Evidence:
    """Sorts the senses of a phrase's own words by kind."""
    found = Evidence()
    by_kind = {
        "class": found.classes,
        "relation": found.relations,
        "action": found.verbs,
        "mode": found.modes,
        "degree": found.degrees,
    }
    for kind, name in meanings(lexicon, phrase):
        # A pruned table (HDCG) lacks most names.
        if name in table.names[kind]:
            by_kind[kind].add(table.names[kind].index(name))
    return found


def meanings(lexicon: Lexicon, phrase: Phrase) -> list[tuple[str, str]]:
    """(kind, name) of all that a phrase's own words may denote.

    A word that the robot does not know denotes what is unknown, of the kind that its part of
    speech names, unless another word of the phrase names something of that kind.
    """
    found: list[tuple[str, str]] = []
    unknown: list[tuple[str, str]] = []
    for word in phrase.words:
        senses = lexicon.senses(word.tag, word.text)
        found += [(sense.kind, sense.name) for sense in senses or ()]
        if senses is None and word.tag in KIND_OF_TAG:
            unknown.append((KIND_OF_TAG[word.tag], UNKNOWN))
    kinds = {kind for kind, _ in found}
    return [*found, *(one for one in unknown if one[0] not in kinds)]


def language(phrase: Phrase, lexicon: Lexicon, child_kinds: str) -> tuple[str, ...]:
    """Names of the language features of a phrase; `child_kinds` names what its children denote."""
    label = phrase.label
    names = ["bias", label, f"{label}>{len(phrase.phrases)}", f"{label}+{child_kinds}"]
    names += [f"{label}>{'-'.join(child.label for child in phrase.phrases)}"]
    for word in phrase.words:
        senses = lexicon.senses(word.tag, word.text)
        kinds = "unknown" if senses is None else "+".join(sense.kind for sense in senses)
        names += [f"{label}:{word.tag}", f"{label}:{word.tag}:{kinds}"]
        if senses is not None:
            names.append(f"word:{word.text}")
    return tuple(dict.fromkeys(names))


def is_lexical(name: str) -> bool:
    """Whether a language feature is about particular words, and may so name symbols."""
    return name.startswith("word:") or name.endswith(":unknown")


def child_kinds(table: SymbolTable, symbols: SymbolSet) -> str:
    """The kinds of symbol that the children bring, as one word."""
    kinds = sorted({int(table.kind_of[symbol]) for symbol in symbols})
    return "+".join(KINDS[kind] for kind in kinds)


@dataclass(frozen=True)
class SymbolFeatures:
    """The features of the factors over a robot's symbols."""

    table: SymbolTable
    lexicon: Lexicon

    @property
    def match_names(self) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        return MATCHES

    @property
    def attributes(self) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        return self.table.attributes

    @property
    def attributes_of(self) -> NDArray[np.int64]:
        """See `FactorFeatures`."""
        return self.table.attributes_of

    def language(self, phrase: Phrase, children: SymbolSet) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        return language(phrase, self.lexicon, child_kinds(self.table, children))

    def matches(self, phrase: Phrase, children: SymbolSet) -> Iterator[Hit]:
        """See `FactorFeatures`."""
        own = of_words(self.table, self.lexicon, phrase)
        child = of_children(self.table, children)
        carried = [at for at in children if KINDS[self.table.kind_of[at]] in CARRIED]
        if carried:
            yield "carried", np.array(sorted(carried), dtype=np.int64)
        yield from _simple_matches(self.table, own, child)
        yield from _region_matches(self.table, own, child)
        yield from _fact_matches(self.table, own, child)
        yield from _action_matches(self.table, own, child)
        yield from _motion_match(self.table, own, phrase)


def _simple_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[Hit]:
    for kind, of_child, of_own in (
        ("class", child.classes, own.classes),
        ("relation", child.relations, own.relations),
        ("mode", child.modes, own.modes),
        ("degree", child.degrees, own.degrees),
    ):
        if of_child:
            yield f"{kind}.child", table.blocks[kind][sorted(of_child)]
        if of_own:
            yield f"{kind}.own", table.blocks[kind][sorted(of_own)]


def _region_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[Hit]:
    block = table.blocks["region"]
    yield from _at("region.same", block, child.regions)
    if own.relations:
        yield "region.relation_own", block[sorted(own.relations)].ravel()
    if child.relations:
        yield "region.relation_child", block[sorted(child.relations)].ravel()
    landmarks = child.classes or _vaguely_placed(table, child)
    if landmarks:
        yield "region.landmark_child", block[:, sorted(landmarks)].ravel()
        suffix = "child"
    else:
        landmarks, suffix = _robot(table), "robot"
    yield from _at(f"region.own_of_{suffix}", block, product(own.relations, landmarks))
    yield from _at(f"region.child_of_{suffix}", block, product(child.relations, landmarks))


def _vaguely_placed(table: SymbolTable, child: Evidence) -> set[int]:
    """Landmarks whose relation the robot does not know: "from the wall" in "farthest from ..."."""
    relations = table.names["relation"]
    return {landmark for relation, landmark in child.regions if relations[relation] == UNKNOWN}


def _fact_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[Hit]:
    block = table.blocks["fact"]
    figures = sorted(own.classes | child.classes)
    if child.facts:
        yield "fact.same", block.ravel()[sorted(child.facts)]
    if figures:
        # Not of facts that are only carried on: those must not depend on what the phrase is about.
        said = block.ravel()[sorted(child.facts)]
        yield "fact.figure", np.setdiff1d(block[:, figures], said)
    # "the closest hydrant to the cone": relation and figure are the phrase's own words.
    spoken = product(own.relations, own.classes, child.classes)
    yield from _at("fact.own_relation_to_child", block, spoken)
    if child.regions:
        relations, landmarks = (list(side) for side in zip(*sorted(child.regions), strict=True))
        yield "fact.region", block[relations, :, landmarks].ravel()
        if figures:
            inside = [block[s, f, e] for (s, e) in child.regions for f in figures]
            yield "fact.figure_in_region", np.array(inside, dtype=np.int64)


def _action_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[Hit]:
    block = table.blocks["action"]
    yield from _at("action.same", block, child.actions)
    if own.verbs:
        yield "action.own", block[sorted(own.verbs)].ravel()
    if child.classes:
        yield "action.object_child", block[:, sorted(child.classes)].ravel()
        yield from _at("action.own_on_child", block, product(own.verbs, child.classes))
    else:
        yield from _at("action.own_on_robot", block, product(own.verbs, _robot(table)))


def _motion_match(table: SymbolTable, own: Evidence, phrase: Phrase) -> Iterator[Hit]:
    """Going somewhere, where the verb has no object: "get to the box" and not "get the box"."""
    actions = table.names["action"]
    moves = MOTION in actions and actions.index(MOTION) in own.verbs
    if moves and not any(child.label == "NP" for child in phrase.phrases):
        yield "action.own_motion", table.blocks["action"][actions.index(MOTION)]


def _at(name: str, block: NDArray[np.int64], positions: Iterable[tuple[int, ...]]) -> Iterator[Hit]:
    """Yields the feature with the symbols at the given positions of a block, if there are any."""
    found = [block[position] for position in positions]
    if found:
        yield name, np.array(found, dtype=np.int64)


def _robot(table: SymbolTable) -> set[int]:
    classes = table.names["class"]
    return {classes.index(ROBOT)} if ROBOT in classes else set()
