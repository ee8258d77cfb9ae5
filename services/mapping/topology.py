"""The topology G: how a hypothesis divides the pose nodes into regions, and what it connects.

A topology is a value. Particles whose histories agree share one, and everything computed from it;
what is asked of a particle never depends on how many share.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Ints

Edge = tuple[int, int]
"""Names of two regions, the smaller one first."""
Partition = tuple[tuple[int, ...], ...]
"""Pose nodes of each region."""


@dataclass(frozen=True)
class Region:
    """A spatially coherent set of pose nodes."""

    nodes: tuple[int, ...]
    """Ascending."""
    kept_whole: float = 0.0
    """Largest likelihood with which dividing it was declined so far."""
    kept_apart: float = 0.0
    """And merging it with another. A decision is not drawn again while nothing speaks louder for
    it; repeated draws would divide, and merge, everything in the end."""

    @property
    def name(self) -> int:
        """Its oldest node: topologies that agree on how a region begins agree on its name."""
        return self.nodes[0]


@dataclass(frozen=True)
class Topology:
    """One division of the places."""

    regions: tuple[Region, ...]
    """By name."""
    edges: frozenset[Edge]
    """Pairs of regions that one can go between."""

    @property
    def partition(self) -> Partition:
        """All that decides what the regions look like."""
        return tuple(region.nodes for region in self.regions)

    def region_of(self, node: int) -> Region:
        """The region that a pose node lies in."""
        return next(region for region in self.regions if node in region.nodes)

    def connects(self, one: Region, other: Region) -> bool:
        """Whether there is an edge between two regions."""
        return _edge(one.name, other.name) in self.edges

    def with_node(self, node: int, region: Region) -> "Topology":
        """A new pose node in a known region."""
        grown = replace(region, nodes=(*region.nodes, node))
        return replace(self, regions=self._without((region,), grown))

    def remembering(self, region: Region, now: Region) -> "Topology":
        """With what was declined about a region."""
        return replace(self, regions=self._without((region,), now))

    def divided(self, region: Region, part: Iterable[int], likelihood: float) -> "Topology":
        """Two regions in place of one, connected: the robot went from one to the other."""
        inside, apart = set(part), 1 - likelihood
        one = Region(tuple(n for n in region.nodes if n in inside), kept_apart=apart)
        other = Region(tuple(n for n in region.nodes if n not in inside), kept_apart=apart)
        divided = Topology(self._without((region,), one, other), self.edges)
        return divided.connected(one, other)

    def merged(self, one: Region, other: Region, kept_whole: float) -> "Topology":
        """One region in place of two, with the edges of both."""
        union = Region(tuple(sorted((*one.nodes, *other.nodes))), kept_whole)
        names = {one.name: union.name, other.name: union.name}
        moved = {_edge(names.get(a, a), names.get(b, b)) for a, b in self.edges}
        edges = frozenset((a, b) for a, b in moved if a != b)
        return Topology(self._without((one, other), union), edges)

    def connected(self, one: Region, other: Region) -> "Topology":
        """With an edge between two regions."""
        return replace(self, edges=self.edges | {_edge(one.name, other.name)})

    def _without(self, gone: tuple[Region, ...], *new: Region) -> tuple[Region, ...]:
        kept = [region for region in self.regions if region not in gone]
        return tuple(sorted([*kept, *new], key=lambda region: region.name))


def assignment(partition: Partition, count: int) -> Ints:
    """Index (count,) of the region of each pose node; -1 for nodes in none of them."""
    owner = np.full(count, -1, np.int32)
    for index, nodes in enumerate(partition):
        owner[list(nodes)] = index
    return owner


def _edge(a: int, b: int) -> Edge:
    return (min(a, b), max(a, b))


beginning = Topology(regions=(Region((0,)),), edges=frozenset())
"""Where the robot starts is one region."""
