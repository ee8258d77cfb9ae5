"""A reading of one or several written words."""

from dataclasses import dataclass

KNOWN_LOG_PROBABILITY = -4.0
FOREIGN_LOG_PROBABILITY = -5.0
"""An English word of which the robot has no sense."""
MISSPELT_LOG_PROBABILITY = -8.0
UNKNOWN_LOG_PROBABILITY = -9.0


@dataclass(frozen=True)
class Sense:
    """What a word may denote: one constituent of the robot's symbol space."""

    kind: str
    """One of class (objects and locations), relation, action, mode, degree."""
    name: str


@dataclass(frozen=True)
class Entry:
    """One reading of one or several written words."""

    words: tuple[str, ...]
    tag: str
    senses: tuple[Sense, ...]
    log_probability: float = KNOWN_LOG_PROBABILITY
    known: bool = True
    """False for words that mean nothing to the robot, however ordinary their grammar."""
    lemma: tuple[str, ...] = ()
    """The words before inflection; empty if they are the written ones."""

    @property
    def text(self) -> str:
        """The uninflected words joined as in a tree leaf."""
        return "_".join(self.lemma or self.words)

    @property
    def meanings(self) -> tuple[tuple[str, str], ...]:
        """(kind, name) of every sense."""
        return tuple((sense.kind, sense.name) for sense in self.senses)


def printed(tag: str) -> str:
    """The part of a label that a tree shows."""
    return tag.partition(":")[0]
