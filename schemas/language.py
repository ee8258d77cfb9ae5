"""What people say, and what it was understood to mean."""

from typing import Annotated

from msgspec import Struct

from schemas.arrays import Floats, Ints, Shape


class Instruction(Struct, frozen=True, kw_only=True):
    """One utterance of a person."""

    stamp_ns: int
    id: str
    """Unique; what later messages refer to."""
    text: str
    source: str
    """Who sent it: "cli", "web:2", ..."""


class Answer(Struct, frozen=True, kw_only=True):
    """What a person answers to the open question of an instruction."""

    stamp_ns: int
    instruction_id: str
    """As in the question's `Annotations`; "" for whichever question is open."""
    text: str
    source: str
    """Who sent it: "cli", "web:2", ..."""


class Utterance(Struct, frozen=True, array_like=True):
    """One thing that was said, with the questions about it that were answered."""

    instruction_id: str
    text: str
    revises: str
    """Id of the instruction that it was said about, "" where it stands on its own."""
    answers: tuple[tuple[str, str], ...]
    """(question, answer), in order."""


class Relation(Struct, frozen=True, array_like=True):
    """A relation between classes, gamma with figure, relation and landmark."""

    relation: str
    figure: str
    landmark: str


class Annotation(Struct, frozen=True, kw_only=True):
    """One reading of an utterance as a statement about the world (Eq. annotation-symbol-space)."""

    probability: float
    objects: tuple[str, ...]
    """Classes that the utterance says exist."""
    relations: tuple[Relation, ...]


class BehaviorSymbol(Struct, frozen=True, kw_only=True):
    """One reading of an utterance as something to do, in classes (no map yet)."""

    probability: float
    action: str
    object: str
    mode: str
    relation: str
    landmark: str
    comparative: bool = False
    """True for "nearest": no other object of the class stands closer to the landmark."""


class Annotations(Struct, frozen=True, kw_only=True):
    """p(alpha_t | utterance), best first, with what the person should know about it."""

    stamp_ns: int
    instruction_id: str
    text: str
    understood: bool
    parse: str
    """Bracketed best tree."""
    parse_probability: float
    annotations: tuple[Annotation, ...]
    """Joint with what other utterances and answers say about the same things."""
    behaviors: tuple[BehaviorSymbol, ...]
    """Behaviours in the map that the best annotations imply."""
    unknown_words: tuple[str, ...]
    question: str | None
    """Open question; where `understood` is False, nothing is done before it is answered."""
    possible: tuple[str, ...]
    """What can be said, shown when `understood` is False."""
    options: tuple[str, ...] = ()
    """Short answers to the question, likeliest first; empty where it is an open one."""
    revision: int = 0
    """Counts up when answers, corrections or extra information change one instruction."""
    revises: str = ""
    """Instruction that this utterance is about; a revision of that one carries its evidence."""
    viewpoint: str = ""
    """Id of the utterance at whose moment the relations hold, "" for this one."""
    not_meant: tuple[int, ...] = ()
    """Ids of seen objects (`MapBelief.node`) that the person said are not the figure."""
    said: tuple[Utterance, ...] = ()
    """The conversation so far, oldest first: what grounding takes up after a restart."""


class Behaviors(Struct, frozen=True, kw_only=True):
    """p(beta_t | S_t, utterance) for every hypothesis of one belief (Eq. basic-1), as columns.

    For each particle the probabilities of its rows and its `nothing_fits` sum to one.
    """

    stamp_ns: int
    """Of the belief they were inferred in."""
    instruction_id: str
    particle: Annotated[Ints, Shape("M")]
    """Row of the belief's particles."""
    node: Annotated[Ints, Shape("M")]
    """Id of the object to go to, as in `MapBelief.node`."""
    landmark: Annotated[Ints, Shape("M")]
    """Id of the landmark, -1 for none."""
    probability: Annotated[Floats, Shape("M")]
    nothing_fits: Annotated[Floats, Shape("P")]
    """Mass, per particle, that no object of the hypothesis is meant: the reason to explore."""
    action: str
    mode: str
    relation: str
    comparative: bool
