"""Places: regions the robot has been in, and places it only looked into.

Everything here is decided by the sensors and shared by all particles. What differs between them is
a `Topology`; `seen` says what the places look like that it makes of the pose nodes.
"""

from dataclasses import dataclass

import numpy as np

from robots.symbols import SymbolSpace
from schemas.arrays import Floats, Ints
from schemas.geometry import Pose2
from schemas.perception import SceneObservation
from schemas.sensing import LaserScan
from services.mapping import semantics
from services.mapping.atlas import Atlas, recent
from services.mapping.floor import floor_around
from services.mapping.grid import Grid
from services.mapping.layout import Layout, cell_size, layout_of
from services.mapping.looks import LookColumns, Looks, fused_by_stand, log_likelihoods
from services.mapping.objects import ObjectColumns
from services.mapping.outlines import outline_of
from services.mapping.particles import first_glimpse, first_region
from services.mapping.topology import Partition, assignment

_spot_size = 0.5
_here = 0.5
"""Points this near speak of the place where the robot stands [m]."""
_at_node = 0.5
"""A look from farther away belongs to the next pose node [m]."""
_least_step = 0.3
"""Between pose nodes that conflicting looks ask for [m]."""
_deviation = 0.3
"""Of a place's middle, beside that of its nodes [m]."""
_region_existence, _glimpse_existence = 0.98, 0.9
_class_floor = float(np.log(1e-4))


@dataclass(frozen=True)
class Sight:
    """What the visited places look like, divided in one way."""

    regions: ObjectColumns
    """R of them."""
    log_likelihood: float
    """Of all looks at them."""


class Places:
    """Pose nodes, spots and the ground around them.

    Args:
        symbols: what the robot's language ranges over: types of places follow classes of objects.
    """

    def __init__(self, symbols: SymbolSpace) -> None:
        self.locations = symbols.locations
        self.atlas = Atlas(len(symbols.locations))
        self._first_class = len(symbols.object_classes)
        self._spots: dict[tuple[int, int], int] = {}
        self._numbers: list[int] = []
        self._spot_sums: Floats = np.zeros((0, 3))
        self._glimpses = Looks(len(symbols.locations))
        self._pending: list[tuple[Floats, Floats]] = []
        self._scan: LaserScan | None = None
        self._layout: Layout | None = None
        self._changed()

    @property
    def layout(self) -> Layout:
        """As of the last survey."""
        assert self._layout is not None
        return self._layout

    @property
    def spots(self) -> Floats:
        """(M, 2), map frame [m]."""
        return self._spot_sums[:, :2] / self._spot_sums[:, 2:]

    @property
    def outdated(self) -> bool:
        """Whether nodes or spots were added since the last survey."""
        known = (len(self.layout.node_of_spot), self.layout.nodes)
        return known != (len(self._numbers), len(self.atlas))

    def scan(self, scan: LaserScan) -> None:
        """Remember the last scan for the next pose node."""
        self._scan = scan

    def forget_scan(self) -> None:
        """Dead reckoning begins anew: what was scanned cannot be placed any more."""
        self._scan = None

    def see(self, scene: SceneObservation, map_from_base: Pose2) -> bool:
        """Enter what a picture shows; True if it shows another place than the last node's."""
        logs = log_likelihoods(scene, self.locations)
        here = np.hypot(*scene.points_base.T) < _here
        for point, look in zip(
            map_from_base.apply(scene.points_base[~here]), logs[~here], strict=True
        ):
            self._glimpses.add(self._spot(point), self.atlas.stands[-1], look)
        place = np.array([map_from_base.x, map_from_base.y])
        conflicts = [self._look(place, look) for look in logs[here]]
        self._changed()
        return any(conflicts)

    def extend(self, poses: Floats, variance: float, odom_from_base: Pose2, grid: Grid) -> None:
        """Add the last of the pose nodes (N + 1, 3)."""
        outline = outline_of(self._scan, odom_from_base) if self._scan else None
        self.atlas.extend(poses, variance, outline)
        self.atlas.enter_by(floor_around(poses[-recent:, :2], grid))
        for place, log_likelihood in self._pending:
            gaps = np.hypot(*(poses[-2:, :2] - place).T)
            node = len(poses) - len(gaps) + int(np.argmin(gaps))
            self.atlas.looks.add(node, self.atlas.stands[node], log_likelihood)
        self._pending = []
        self._changed()

    def survey(self, grid: Grid) -> bool:
        """Lay out the ground anew; True if other places are seen from afar than before."""
        before = self._layout
        nodes, spots = self.atlas.looks.columns, self._glimpses.columns
        at_nodes = _beliefs(nodes, len(self.atlas))
        agrees = len(self.locations) * _beliefs(spots, len(self.spots)) @ at_nodes.T
        self._layout = layout_of(self.atlas.poses[:, :2], self.spots, agrees, grid)
        self._changed()
        return before is None or not np.array_equal(before.oldest, self._layout.oldest)

    def restore(self, poses: Floats) -> None:
        """Take up pose nodes (N, 3) of an earlier life of the process."""
        self.atlas = Atlas(len(self.locations))
        for count in range(1, len(poses) + 1):
            self.atlas.extend(poses[:count], 0.0, None)

    def restore_look(self, node: int, log_likelihood: Floats) -> None:
        """Take up what was known of the region of a pose node, log distribution (T,)."""
        self.atlas.looks.add(node, self.atlas.stands[node], log_likelihood)

    def restore_glimpse(self, number: int, point: Floats, log_likelihood: Floats) -> None:
        """Take up a place at (2,) that was only looked into, log distribution (T,)."""
        spot = self._spot(point)
        self._numbers[spot] = number
        self._glimpses.add(spot, self.atlas.stands[-1], log_likelihood)

    def seen(self, partition: Partition) -> Sight:
        """Visited places in topologies that divide the pose nodes in one way."""
        if partition not in self._sights:
            log_likelihood = float(self.atlas.type_beliefs(partition)[1].sum())
            self._sights[partition] = Sight(self._regions(partition), log_likelihood)
        return self._sights[partition]

    @property
    def glimpses(self) -> ObjectColumns:
        """Places that the robot only looked into; they are the same in all topologies."""
        if self._glimpsed is None:
            nowhere = np.full(len(self.atlas), -1, np.int32)
            owner = np.concatenate([nowhere, self.layout.group_of_spot])
            names = self._names(self.layout.oldest)
            self._glimpsed = self._columns(owner, names, _glimpse_existence)
        return self._glimpsed

    def _regions(self, partition: Partition) -> ObjectColumns:
        owner = assignment(partition, len(self.atlas))
        link = self.layout.node_of_spot
        spots = np.where(link >= 0, owner[link], -1)
        numbers = np.array([first_region + nodes[0] for nodes in partition], np.int32)
        return self._columns(np.concatenate([owner, spots]), numbers, _region_existence)

    def _changed(self) -> None:
        """Nothing that was worked out before holds any more."""
        self._sights, self._glimpsed = {}, None

    def _columns(self, owner: Ints, numbers: Ints, existence: float) -> ObjectColumns:
        """Places as things.

        Args:
            owner: (N + M,) place of each node and spot, -1 for none of these.
            numbers: (R,) ids.
            existence: of each of them.
        """
        low, high, mean = self._boxes(owner, len(numbers))
        half = 0.5 * (high - low)
        names = semantics.name_message(self._types(owner, len(numbers)))
        class_log = np.full((len(numbers), self._first_class + len(self.locations)), _class_floor)
        class_log[:, self._first_class :] = np.maximum(names, _class_floor)
        variance = _deviation**2 + self.atlas.variances.max(initial=0.0)
        return ObjectColumns(
            number=numbers,
            mean=mean,
            covariance=np.tile(variance * np.eye(2), (len(numbers), 1, 1)),
            radius=half.mean(axis=1),
            half_extent=half,
            class_log=class_log,
            existence=np.full(len(numbers), existence),
        )

    def _types(self, owner: Ints, count: int) -> Floats:
        nodes, spots = self.atlas.looks.columns, self._glimpses.columns
        owners = np.concatenate([owner[nodes.place], owner[len(self.atlas) + spots.place]])
        both = LookColumns(
            place=np.concatenate([nodes.place, spots.place]),
            stand=np.concatenate([nodes.stand, spots.stand]),
            log_likelihood=np.concatenate([nodes.log_likelihood, spots.log_likelihood]),
        )
        means, region = fused_by_stand(both, owners)
        messages = semantics.appearance_message(means)
        return semantics.type_belief(messages, region, count)[0]

    def _boxes(self, owner: Ints, count: int) -> tuple[Floats, Floats, Floats]:
        """Corners and middles, each (R, 2), of all ground and points of each place."""
        points = np.concatenate([self.atlas.poses[:, :2], self.spots, self.layout.centers])
        place = np.concatenate([owner, owner[self.layout.owner]])
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        total = np.zeros((count, 3))
        kept = place >= 0
        np.minimum.at(low, place[kept], points[kept] - cell_size / 2)
        np.maximum.at(high, place[kept], points[kept] + cell_size / 2)
        np.add.at(total, place[kept], np.pad(points[kept], ((0, 0), (0, 1)), constant_values=1.0))
        return low, high, total[:, :2] / total[:, 2:]

    def _names(self, spots: Ints) -> Ints:
        return np.array([first_glimpse + self._numbers[spot] for spot in spots], np.int32)

    def _spot(self, point: Floats) -> int:
        x, y = np.floor(point / _spot_size).astype(int).tolist()
        spot = self._spots.setdefault((x, y), len(self._spots))
        if spot == len(self._numbers):
            self._numbers.append(max(self._numbers, default=-1) + 1)
            self._spot_sums = np.concatenate([self._spot_sums, np.zeros((1, 3))])
        self._spot_sums[spot] += (*point, 1.0)
        return spot

    def _look(self, place: Floats, log_likelihood: Floats) -> bool:
        """Enter a look at where the robot stands; True if the last node looked different."""
        node = len(self.atlas) - 1
        gap = float(np.hypot(*(self.atlas.poses[node, :2] - place)))
        if gap < _at_node and not self._differs(node, gap, log_likelihood):
            self.atlas.looks.add(node, self.atlas.stands[node], log_likelihood)
            return False
        alike = bool(self._pending) and _mode(self._pending[-1][1]) == _mode(log_likelihood)
        self._pending.append((place, log_likelihood))
        # One look may err: two in a row say that the place is another one.
        return alike and self._differs(node, gap, log_likelihood)

    def _differs(self, node: int, gap: float, log_likelihood: Floats) -> bool:
        beliefs, _ = self.atlas.type_beliefs(((node,),))
        return gap > _least_step and _mode(beliefs[0]) != _mode(log_likelihood)


def _mode(log_distribution: Floats) -> int:
    return int(np.argmax(log_distribution))


def _beliefs(looks: LookColumns, count: int) -> Floats:
    """Distributions (count, T) over the type of each place that was looked at."""
    means, place = fused_by_stand(looks, looks.place)
    messages = semantics.appearance_message(means)
    return np.exp(semantics.type_belief(messages, place, count)[0])
