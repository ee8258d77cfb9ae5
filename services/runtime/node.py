"""What a node is: a table of handlers. Both executors run the same node objects.

A handler takes one message and returns the messages that follow from it. It never publishes,
sleeps, reads a clock or opens a socket. Time comes from message stamps (a node that must act on
its own handles `topics.TICK`), randomness from the generator it was built with.
"""

import zlib
from typing import Protocol, runtime_checkable

import numpy as np

from schemas.run import RunConfig
from schemas.topics import Handlers


class Node(Protocol):
    """One service.

    `services.runtime.worker.build_node` calls its class with a `RunConfig` and a generator of its
    own.
    """

    def handlers(self) -> Handlers:
        """What the node listens to. Asked once."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """A node that takes up its own last published state after its process died."""

    def resume(self) -> Handlers:
        """Handlers of the node's own state topics, called before any input. Asked once."""
        ...


@runtime_checkable
class Closable(Protocol):
    """A node that holds something to let go of."""

    def close(self) -> None:
        """Called once, after the last handler."""
        ...


def node_generator(run: RunConfig, name: str) -> np.random.Generator:
    """The node's own stream of randomness: one seed a run, independent between nodes."""
    sequence = np.random.SeedSequence(run.seed, spawn_key=(zlib.crc32(name.encode()),))
    return np.random.default_rng(sequence)
