"""The proposal over topologies: motion and observation (Eq. proposal2-factored).

A new pose node goes to the nearest region; the region may be bisected; a new region samples edges
to others; regions that turn out to be one place merge. Each of these is a decision of a particle.
Particles with one topology face the same decisions and share all computation; each decides with a
uniform number of its own, whatever it shares.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Floats, Ints
from services.mapping.atlas import Atlas
from services.mapping.region_edges import edge_probability
from services.mapping.segmentation import split_probability
from services.mapping.topology import Partition, Region, Topology, beginning

_sure = 0.5
"""Types of places conflict only if both are likelier than this."""
_without_door = 0.1
"""Share of conflicts to believe in where the robot passed no narrow place: classifiers err."""
_has_mode = 0.3
_one_place = 0.6
"""Least mutual sight of regions that may be one place."""
_observed = 0.5
"""Overlap of scans from which one region is seen from the other."""
_certain = 1e-12


@dataclass(frozen=True)
class Branch:
    """Particles that have made the same decisions."""

    topology: Topology
    rows: Ints
    """(n,) particles."""
    uniforms: Floats
    """(n,) What is left of their randomness, in [0, 1)."""

    def decided(self, probability: float) -> tuple["Branch", "Branch"]:
        """Those who do and those who do not.

        A uniform number below p, divided by p, is uniform again: one number makes all decisions.
        """
        p = min(max(probability, 0.0), 1.0)
        do, u = self.uniforms < p, self.uniforms
        yes, no = max(p, _certain), max(1 - p, _certain)
        return (
            Branch(self.topology, self.rows[do], u[do] / yes),
            Branch(self.topology, self.rows[~do], (u[~do] - p) / no),
        )

    def at(self, topology: Topology) -> "Branch":
        """The same particles with another topology."""
        return replace(self, topology=topology)


@dataclass(frozen=True)
class Topologies:
    """K topologies that particles have."""

    members: tuple[Topology, ...]
    log_prior: Floats
    """(K,) of each by the decisions that led to it, up to a constant. What one was believed to be
    its particles take with them, in equal parts, whatever becomes of them."""

    def partitions(self) -> dict[Partition, Ints]:
        """Topologies by how they divide the pose nodes, which is all that looks depend on."""
        found: dict[Partition, list[int]] = {}
        for index, topology in enumerate(self.members):
            found.setdefault(topology.partition, []).append(index)
        return {partition: np.array(rows, np.int32) for partition, rows in found.items()}

    def living(self, owner: Ints) -> tuple["Topologies", Ints]:
        """Those that particles have, and each particle's (P,) among them."""
        kept, renamed = np.unique(owner, return_inverse=True)
        members = tuple(self.members[index] for index in kept)
        return Topologies(members, self.log_prior[kept]), renamed.astype(np.int32)


def propagate(
    topologies: Topologies, owner: Ints, uniforms: Floats, atlas: Atlas
) -> tuple[Topologies, Ints]:
    """Sample what becomes of each particle's topology with the last pose node.

    Args:
        topologies: before.
        owner: (P,) topology of each particle.
        uniforms: (P,) in [0, 1), of each particle.
        atlas: what the sensors say.
    """
    share = topologies.log_prior - np.log(np.bincount(owner, minlength=len(topologies.members)))
    found: dict[Topology, float] = {}
    branches: list[Branch] = []
    for index, topology in enumerate(topologies.members):
        rows = np.flatnonzero(owner == index).astype(np.int32)
        for branch in allocate(Branch(topology, rows, uniforms[rows]), atlas):
            if len(branch.rows):
                mass = share[index] + np.log(len(branch.rows))
                found[branch.topology] = np.logaddexp(found.get(branch.topology, -np.inf), mass)
                branches.append(branch)
    members, after = list(found), np.zeros_like(owner)
    for branch in branches:
        after[branch.rows] = members.index(branch.topology)
    return Topologies(tuple(members), np.array(list(found.values()))), after


def allocate(branch: Branch, atlas: Atlas) -> list[Branch]:
    """What becomes of a branch with the last pose node of the atlas."""
    node = len(atlas) - 1
    topology = branch.topology.with_node(node, atlas.nearest(node, branch.topology))
    region = topology.region_of(node)
    conflict, calm = branch.at(topology).decided(_conflict(region, node, atlas))
    cut = atlas.cut(region.nodes)
    branches = _divide(conflict, region, (node,), 1.0, atlas)
    if cut is None:
        return branches + _seen_from(calm, node, atlas)
    part, likelihood = cut
    split, whole = calm.decided(_louder(likelihood, region.kept_whole))
    branches += _divide(split, region, part, likelihood, atlas)
    kept = replace(region, kept_whole=max(region.kept_whole, likelihood))
    return branches + _seen_from(whole.at(whole.topology.remembering(region, kept)), node, atlas)


def _conflict(region: Region, node: int, atlas: Atlas) -> float:
    """Probability that a node is another type of place than the rest of its region."""
    rest = tuple(other for other in region.nodes if other != node)
    beliefs, _ = atlas.type_beliefs((rest, (node,)))
    mode, (before, here) = np.argmax(beliefs, axis=1), np.exp(beliefs.max(axis=1)).tolist()
    if mode[0] == mode[1] or min(before, here) < _sure:
        return 0.0
    return before * here * (1.0 if atlas.behind_door & set(rest) else _without_door)


def _divide(
    branch: Branch, region: Region, part: tuple[int, ...], likelihood: float, atlas: Atlas
) -> list[Branch]:
    """Two regions; the one with the new name samples its edges, the other keeps those it had."""
    if not len(branch.rows):
        return []
    topology = branch.topology.divided(region, part, likelihood)
    halves = [topology.region_of(part[0]).name, topology.region_of(_other(region, part)).name]
    branches = _connect(branch.at(topology), max(halves), atlas)
    for name in halves:
        branches = [one for each in branches for one in _merge(each, name, atlas)]
    return branches


def _other(region: Region, part: tuple[int, ...]) -> int:
    return next(node for node in region.nodes if node not in part)


def _connect(branch: Branch, name: int, atlas: Atlas) -> list[Branch]:
    """Sample edges of a new region (Eq. edge_proposal)."""
    new = branch.topology.region_of(name)
    others = [
        r for r in branch.topology.regions if r != new and not branch.topology.connects(r, new)
    ]
    if not others:
        return [branch]
    ends, start = [atlas.central(other) for other in others], atlas.central(new)
    gaps = np.hypot(*(atlas.poses[ends, :2] - atlas.poses[start, :2]).T)
    deviations = np.sqrt(atlas.variances[ends] + atlas.variances[start])
    branches = [branch]
    for other, likelihood in zip(others, edge_probability(gaps, deviations).tolist(), strict=True):
        branches = _each(branches, likelihood, lambda g, other=other: g.connected(new, other))
    return branches


def _seen_from(branch: Branch, node: int, atlas: Atlas) -> list[Branch]:
    """Connect the current region with those that are seen from here, and see what merges."""
    if not len(branch.rows):
        return []
    topology = branch.topology
    own = topology.region_of(node)
    for other in topology.regions:
        if other != own and atlas.overlap[node, list(other.nodes)].max() > _observed:
            topology = topology.connected(own, other)
    return _merge(branch.at(topology), own.name, atlas)


def _merge(branch: Branch, name: int, atlas: Atlas) -> list[Branch]:
    """Merge a region with connected ones of its type that it is not separated from.

    Of the same type alone is not enough: two hallways that touch at a corner stay two, each of
    which sees little of the other. What would not be divided is one.
    """
    branches, done = [branch], list[Branch]()
    own = branch.topology.region_of(name)
    for other in _alike(own, branch.topology, atlas):
        if atlas.mutual_sight(own, other) < _one_place:
            continue
        apart = split_probability(atlas.separation(own, other))
        pending: list[Branch] = []
        for each in branches:
            region = each.topology.region_of(name)
            one, rest = each.decided(_louder(1 - apart, region.kept_apart))
            if len(one.rows):
                done.append(one.at(one.topology.merged(region, other, apart)))
            if len(rest.rows):
                kept = replace(region, kept_apart=max(region.kept_apart, 1 - apart))
                pending.append(rest.at(rest.topology.remembering(region, kept)))
        branches = pending
    return branches + done


def _alike(own: Region, topology: Topology, atlas: Atlas) -> list[Region]:
    """Connected regions whose distribution over types has the same mode."""
    beliefs, _ = atlas.type_beliefs(topology.partition)
    mode, clear = np.argmax(beliefs, axis=1), np.exp(beliefs.max(axis=1)) > _has_mode
    row = topology.regions.index(own)
    return [
        other
        for index, other in enumerate(topology.regions)
        if topology.connects(own, other)
        and clear[index]
        and clear[row]
        and mode[index] == mode[row]
    ]


def _each(
    branches: list[Branch], probability: float, change: Callable[[Topology], Topology]
) -> list[Branch]:
    """Every branch decides about one change."""
    pairs = [branch.decided(probability) for branch in branches]
    changed = [yes.at(change(yes.topology)) for yes, _ in pairs if len(yes.rows)]
    return changed + [no for _, no in pairs if len(no.rows)]


def _louder(likelihood: float, before: float) -> float:
    """Probability of deciding for something now that was not decided for with less likelihood."""
    return max(0.0, (likelihood - before) / max(1 - before, _certain))


at_first = Topologies((beginning,), np.zeros(1))
"""What all particles agree on before the robot moves."""
