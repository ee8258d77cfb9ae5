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

import numpy as np
from numpy.typing import NDArray

from services.grounding.lexicon import Lexicon
from services.grounding.symbols import KINDS, ROBOT, SymbolTable
from services.grounding.tree import Phrase

SymbolSet = frozenset[int]
Pair = tuple[int, int]

MATCHES = (
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
    "mode.child",
    "mode.own",
    "degree.child",
    "degree.own",
)
_MATCH_INDEX = {name: at for at, name in enumerate(MATCHES)}


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
    for word in phrase.words:
        for sense in lexicon.senses(word.tag, word.text) or ():
            by_kind[sense.kind].add(table.names[sense.kind].index(sense.name))
    return found


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


def matches(
    table: SymbolTable, own: Evidence, child: Evidence
) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Yields (match feature, indices of all symbols that have it)."""
    for name, at in (
        *_simple_matches(table, own, child),
        *_region_matches(table, own, child),
        *_fact_matches(table, own, child),
        *_action_matches(table, own, child),
    ):
        yield _MATCH_INDEX[name], at


_Hit = tuple[str, NDArray[np.int64]]


def _simple_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[_Hit]:
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


def _region_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[_Hit]:
    block = table.blocks["region"]
    yield from _at("region.same", block, child.regions)
    if own.relations:
        yield "region.relation_own", block[sorted(own.relations)].ravel()
    if child.relations:
        yield "region.relation_child", block[sorted(child.relations)].ravel()
    if child.classes:
        yield "region.landmark_child", block[:, sorted(child.classes)].ravel()
        landmarks, suffix = child.classes, "child"
    else:
        landmarks, suffix = _robot(table), "robot"
    yield from _at(f"region.own_of_{suffix}", block, product(own.relations, landmarks))
    yield from _at(f"region.child_of_{suffix}", block, product(child.relations, landmarks))


def _fact_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[_Hit]:
    block = table.blocks["fact"]
    figures = sorted(own.classes | child.classes)
    if child.facts:
        yield "fact.same", block.ravel()[sorted(child.facts)]
    if figures:
        yield "fact.figure", block[:, figures].ravel()
    # "the closest hydrant to the cone": relation and figure are the phrase's own words.
    spoken = product(own.relations, own.classes, child.classes)
    yield from _at("fact.own_relation_to_child", block, spoken)
    if child.regions:
        relations, landmarks = (list(side) for side in zip(*sorted(child.regions), strict=True))
        yield "fact.region", block[relations, :, landmarks].ravel()
        if figures:
            inside = [block[s, f, e] for (s, e) in child.regions for f in figures]
            yield "fact.figure_in_region", np.array(inside, dtype=np.int64)


def _action_matches(table: SymbolTable, own: Evidence, child: Evidence) -> Iterator[_Hit]:
    block = table.blocks["action"]
    yield from _at("action.same", block, child.actions)
    if own.verbs:
        yield "action.own", block[sorted(own.verbs)].ravel()
    if child.classes:
        yield "action.object_child", block[:, sorted(child.classes)].ravel()
        yield from _at("action.own_on_child", block, product(own.verbs, child.classes))
    else:
        yield from _at("action.own_on_robot", block, product(own.verbs, _robot(table)))


def _at(
    name: str, block: NDArray[np.int64], positions: Iterable[tuple[int, ...]]
) -> Iterator[_Hit]:
    """Yields the feature with the symbols at the given positions of a block, if there are any."""
    found = [block[position] for position in positions]
    if found:
        yield name, np.array(found, dtype=np.int64)


def _robot(table: SymbolTable) -> set[int]:
    classes = table.names["class"]
    return {classes.index(ROBOT)} if ROBOT in classes else set()
