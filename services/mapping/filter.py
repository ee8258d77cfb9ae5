"""Algorithm 1 of the paper: the distribution over maps, as a Rao-Blackwellised particle filter.

Particles differ in what language makes them differ in: which things the utterance means, and where
those lie that nobody saw yet. What the sensors decide alone, trajectory and seen objects, is one
Gaussian shared by all of them. That is exact: a hypothesised leaf sends no information back.
"""

from dataclasses import replace

import numpy as np

from robots.spec import CameraSpec
from schemas.arrays import Floats
from schemas.geometry import Pose2
from schemas.perception import Detections
from schemas.sensing import LaserScan
from services.mapping import visibility
from services.mapping.annotations import Reading
from services.mapping.backbone import Backbone
from services.mapping.faults import FaultLog
from services.mapping.grid import Grid
from services.mapping.object_map import ObjectMap
from services.mapping.odometer import OdometryNoise
from services.mapping.particles import Particles, empty_particles, joined
from services.mapping.proposal import fresh_particles
from services.mapping.sensing import Picture, read_picture
from services.mapping.target import Evidence, log_target, placed


class SemanticFilter:
    """The belief over semantic graphs S = {G, X, L} (Eq. semantic-map-distribution).

    Args:
        classes: vocabulary of object classes.
        camera: how far it is trusted.
        count: number of particles.
        rng: the only source of randomness.
    """

    def __init__(
        self, classes: tuple[str, ...], camera: CameraSpec, count: int, rng: np.random.Generator
    ) -> None:
        origin = Pose2(0.0, 0.0, 0.0)
        self.classes = classes
        self.faults = FaultLog("mapping")
        self.backbone = Backbone(origin, origin, np.zeros((0, 3)))
        self.objects = ObjectMap(len(classes))
        self.grid = Grid((0.0, 0.0))
        self.viewer = origin
        self.readings: tuple[Reading, ...] = ()
        self.particles: Particles = empty_particles(count)
        self._log_target: Floats = np.zeros(count)
        self._camera = camera
        self._count = count
        self._stale = False
        self._rng = rng

    def observe(self, detections: Detections) -> None:
        """One step of Algorithm 1 with what a picture shows, and with what it does not show."""
        picture = self._propagate(detections)
        seen, appeared = self.objects.associate(picture)
        self._update(picture, seen, appeared, detections.odom_from_base)
        vanished = self._look(detections, picture)
        impossible = self._weigh()
        self._resample(redraw=appeared or vanished or impossible)

    def hear(self, readings: tuple[Reading, ...], odom_from_base: Pose2) -> None:
        """Take an utterance as evidence: every particle samples what it means, and where it is."""
        self.readings = readings
        self.viewer = self.backbone.locate(odom_from_base)
        self._resample(redraw=True)

    def recall(self, readings: tuple[Reading, ...]) -> None:
        """Take back the readings of an utterance whose hypotheses were restored."""
        self.readings = readings
        self.particles = _with_readings(self.particles, self.evidence)
        self._log_target = log_target(self.particles, self.evidence)

    def move(self, odom_from_base: Pose2, noise: OdometryNoise) -> None:
        """Follow dead reckoning."""
        self.backbone.move(odom_from_base, noise)
        if self.backbone.due(odom_from_base):
            self._extend(odom_from_base)

    def jump(self, before: Pose2, after: Pose2) -> None:
        """Dead reckoning broke off at `before` and began again at `after`."""
        self._settle(self.backbone.jump(before, after))

    def scan(self, scan: LaserScan) -> None:
        """Enter a scan into the grid."""
        self.grid.insert(scan, self.backbone.locate(scan.odom_from_base))

    @property
    def evidence(self) -> Evidence:
        """What all hypotheses are judged by."""
        return Evidence(self.classes, self.objects.columns, self.grid, self.viewer, self.readings)

    def _propagate(self, detections: Detections) -> Picture:
        """The picture at the pose that dead reckoning predicts."""
        map_from_base = self.backbone.locate(detections.odom_from_base)
        around = self.backbone.uncertainty
        picture = read_picture(detections, self.classes, map_from_base, around)
        for flaw in picture.flaws:
            self.faults.note("unusable detection", flaw)
        return picture

    def _update(
        self,
        picture: Picture,
        seen: list[tuple[int, int]],
        appeared: bool,
        odom_from_base: Pose2,
    ) -> None:
        """New edges of the pose graph; a pose node every metre or when an object appeared."""
        for number, detection in seen:
            self.backbone.sight(
                number,
                picture.points_base[detection],
                picture.covariances_base[detection],
                odom_from_base,
            )
        if appeared or self.backbone.due(odom_from_base):
            self._extend(odom_from_base)

    def _extend(self, odom_from_base: Pose2) -> None:
        self._settle(self.backbone.extend(odom_from_base))

    def _settle(self, solved: bool) -> None:
        """Take over what the pose graph says now."""
        if not solved:
            self.faults.note("refused by the solver", self.backbone.refusal)
            return
        self.objects.moved(self.backbone.objects)
        self._stale = True

    def _look(self, detections: Detections, picture: Picture) -> bool:
        """Negative evidence, for places and for known things; True if one of these is gone."""
        view = visibility.view_of(detections, self._camera)
        visibility.look(self.grid, view, picture.map_from_base, picture.points_base)
        return self.objects.miss(picture, view)

    def _weigh(self) -> bool:
        """Eq. weight_update_all: weights follow the change of the density they sample.

        True if no hypothesis is possible any more.
        """
        if not self.readings:
            return False
        self.particles = placed(self.particles, self.objects.columns)
        now = log_target(self.particles, self.evidence)
        with np.errstate(invalid="ignore"):  # What was impossible may stay so.
            change = self.particles.log_weight + now - self._log_target
        self.particles = self.particles.weighted(change)
        self._log_target = now
        if np.isfinite(change).any():
            return False
        self.faults.note("no hypothesis fits", "all weights vanished: all are drawn anew")
        return True

    def _resample(self, redraw: bool) -> None:
        """Draw anew when the set of things changed; mix in new hypotheses when depleted.

        Hypotheses are renewed at every pose node too: weights alone cannot move one.
        """
        depleted = self.particles.effective < self._count / 2
        if not self.readings or not (redraw or depleted or self._stale):
            return
        self._stale = False
        pool = fresh_particles(self._count, self.evidence, self._rng)
        if not redraw:
            # Both are samples of one posterior; half and half lets hypotheses that were looked
            # at and found empty move to where nobody looked.
            both = joined([self.particles, pool])
            pool = both.weighted(both.log_weight)
        self.particles = pool.resampled(self._count, self._rng)
        self._log_target = log_target(self.particles, self.evidence)


def _with_readings(particles: Particles, evidence: Evidence) -> Particles:
    """Give each particle the reading that explains it best; readings are not published."""
    fits = [
        log_target(replace(particles, reading=np.full(len(particles), number, np.int32)), evidence)
        for number in range(len(evidence.readings))
    ]
    return replace(particles, reading=np.argmax(np.array(fits), axis=0).astype(np.int32))
