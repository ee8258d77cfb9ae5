"""What the sensors know about the pose nodes as places; all particles judge by the same."""

import numpy as np

from schemas.arrays import Floats
from services.mapping import semantics
from services.mapping.floor import Floor
from services.mapping.looks import Looks, fused_by_stand
from services.mapping.outlines import Outline, overlaps
from services.mapping.segmentation import Cut, bisect, normalised_cut
from services.mapping.topology import Partition, Region, Topology, assignment

_same_stand = 0.95
"""Looks from closer together are alike [m]."""
_sees = 0.3
"""Overlap of scans from which a node is near another one, and not behind its wall."""
_cuts_kept = 512
recent = 5
"""Pose nodes between which a doorway may lie: some stand in it."""


class Atlas:
    """Pose nodes with their scans and looks.

    Args:
        types: number T of types of places.
    """

    def __init__(self, types: int) -> None:
        self.looks = Looks(types)
        self.poses: Floats = np.zeros((0, 3))
        """(N, 3) x, y, yaw, map frame."""
        self.variances: Floats = np.zeros(0)
        """(N,) of the positions [m^2]."""
        self.stands: list[int] = []
        """Of each node the first one that stood about here."""
        self.overlap: Floats = np.zeros((0, 0))
        """(N, N) similarity of scans; 0 where there is none."""
        self.behind_door: frozenset[int] = frozenset()
        """Recent nodes from which a narrow place leads to the last one."""
        self._outlines: list[Outline | None] = []
        self._cuts: dict[tuple[int, ...], Cut] = {}

    def __len__(self) -> int:
        return len(self.stands)

    def extend(self, poses: Floats, variance: float, outline: Outline | None) -> None:
        """Add the last of the pose nodes (N + 1, 3); the others may have moved."""
        self.poses = poses
        self.variances = np.append(self.variances, variance)
        node = len(poses) - 1
        self.stands.append(self._stand_at(node))
        grown = np.zeros((node + 1, node + 1))
        grown[:-1, :-1] = self.overlap
        if outline is not None:
            grown[node, :node] = grown[:node, node] = self._overlaps(outline)
            grown[node, node] = 1.0
        self.overlap = grown
        self._outlines.append(outline)

    def enter_by(self, floor: Floor) -> None:
        """Look at the ground between the last node and those just before it."""
        points = self.poses[-recent:, :2]
        ends = np.tile(points[-1], (len(points) - 1, 1))
        closed = np.flatnonzero(~floor.open_between(points[:-1], ends))
        self.behind_door = frozenset((closed + len(self) - len(points)).tolist())

    def nearest(self, node: int, topology: Topology) -> Region:
        """The region of the nearest earlier node that is not behind a wall."""
        gaps = np.hypot(*(self.poses[:node, :2] - self.poses[node, :2]).T)
        hidden = (self.overlap[node, :node] < _sees) & (np.arange(node) != node - 1)
        return topology.region_of(int(np.argmin(np.where(hidden, np.inf, gaps))))

    def cut(self, nodes: tuple[int, ...]) -> tuple[tuple[int, ...], float] | None:
        """The best part of a region to divide off, and the likelihood of dividing it."""
        scanned = self._scanned(nodes)
        if len(scanned) < 2:
            return None
        if nodes not in self._cuts:
            if len(self._cuts) >= _cuts_kept:
                self._cuts.clear()
            self._cuts[nodes] = bisect(self.overlap[np.ix_(scanned, scanned)])
        cut = self._cuts[nodes]
        # Nodes without a scan stay with the older part.
        older = cut.first[0]
        return tuple(np.array(scanned)[cut.first != older].tolist()), cut.probability

    def separation(self, one: Region, other: Region) -> float:
        """Normalised cut between two regions; 0 where nothing is known to connect them."""
        a, b = self._scanned(one.nodes), self._scanned(other.nodes)
        if not a or not b:
            return 0.0
        both = a + b
        return normalised_cut(self.overlap[np.ix_(both, both)], np.arange(len(both)) < len(a))

    def mutual_sight(self, one: Region, other: Region) -> float:
        """How much of the nodes' sight the best nodes of the other region share, on average."""
        between = self.overlap[np.ix_(one.nodes, other.nodes)]
        return float(min(between.max(axis=1).mean(), between.max(axis=0).mean()))

    def type_beliefs(self, partition: Partition) -> tuple[Floats, Floats]:
        """Log distributions (R, T) over the types of regions, and log evidence (R,)."""
        looks = self.looks.columns
        means, region = fused_by_stand(looks, assignment(partition, len(self))[looks.place])
        messages = semantics.appearance_message(means)
        return semantics.type_belief(messages, region, len(partition))

    def central(self, region: Region) -> int:
        """The node nearest to the middle of a region."""
        points = self.poses[list(region.nodes), :2]
        gaps = np.hypot(*(points - points.mean(axis=0)).T)
        return region.nodes[int(np.argmin(gaps))]

    def _stand_at(self, node: int) -> int:
        stands = np.unique(np.array(self.stands, np.int32))
        gaps = np.hypot(*(self.poses[stands, :2] - self.poses[node, :2]).T)
        known = len(stands) > 0 and gaps.min() < _same_stand
        return int(stands[np.argmin(gaps)]) if known else node

    def _scanned(self, nodes: tuple[int, ...]) -> list[int]:
        return [node for node in nodes if self._outlines[node] is not None]

    def _overlaps(self, outline: Outline) -> Floats:
        rows = [(row, one) for row, one in enumerate(self._outlines) if one is not None]
        similarity = np.zeros(len(self._outlines))
        if rows:
            indices = [row for row, _ in rows]
            others = [one for _, one in rows]
            poses = self.poses[indices]
            similarity[indices] = overlaps(outline, self.poses[-1], others, poses)
        return similarity
