"""Algorithm 1 of the paper: the distribution over maps, as a Rao-Blackwellised particle filter.

Particles differ in how they divide places in regions, and in what language makes them differ in:
which things the utterance means, and where those lie that nobody saw yet. What the sensors decide
alone, trajectory and seen objects, is one Gaussian shared by all of them. That is exact: a
hypothesised leaf sends no information back, and an edge between regions is no metric constraint.
"""

from dataclasses import replace

import numpy as np

from robots.spec import CameraSpec
from robots.symbols import SymbolSpace
from schemas.arrays import Floats
from schemas.faults import FaultLog
from schemas.geometry import Pose2
from schemas.perception import Detections, Inspection, SceneObservation
from schemas.sensing import LaserScan
from services.mapping import visibility
from services.mapping.allocation import at_first, propagate
from services.mapping.annotations import Reading
from services.mapping.backbone import Backbone
from services.mapping.cases import Case, cases_of, drawn, judged
from services.mapping.even import EvenPoints
from services.mapping.grid import Grid
from services.mapping.heed import asked_for, sought_in
from services.mapping.insides import Insides
from services.mapping.object_map import ObjectMap
from services.mapping.odometer import OdometryNoise
from services.mapping.particles import Particles, empty_particles
from services.mapping.places import Places
from services.mapping.scan_memory import points_of
from services.mapping.sensing import Picture, read_picture
from services.mapping.target import Evidence


class SemanticFilter:
    """The belief over semantic graphs S = {G, X, L} (Eq. semantic-map-distribution).

    Args:
        symbols: what the robot's language ranges over.
        camera: how far it is trusted.
        count: number of particles.
        rng: the only source of randomness.
        grid: empty, around the origin.
    """

    def __init__(
        self,
        symbols: SymbolSpace,
        camera: CameraSpec,
        count: int,
        rng: np.random.Generator,
        grid: Grid | None = None,
    ) -> None:
        origin = Pose2(0.0, 0.0, 0.0)
        self.classes = symbols.object_classes + symbols.locations
        self.faults = FaultLog("mapping")
        self.backbone = Backbone(origin, origin, np.zeros((0, 3)))
        containers = tuple(self.classes.index(name) for name in symbols.containers)
        self.objects = ObjectMap(len(self.classes), containers)
        self.insides = Insides(len(self.classes))
        self.grid = grid or Grid((0.0, 0.0))
        # Regions would say nothing to a robot whose language has no places: it keeps none.
        self.places = Places(symbols) if symbols.locations else None
        self.topologies = at_first
        self.viewer = origin
        self.readings: tuple[Reading, ...] = ()
        self.particles: Particles = empty_particles(count)
        self._log_target: Floats = np.zeros(count)
        self._camera = camera
        self._count = count
        self._stale = False
        self._points = EvenPoints(rng)
        self._rng = rng
        self._allocate(origin)

    def observe(self, detections: Detections) -> None:
        """One step of Algorithm 1 with what a picture shows, and with what it does not show."""
        picture = self._propagate(detections)
        seen, appeared = self.objects.associate(picture)
        self._update(picture, seen, appeared, detections.odom_from_base)
        vanished = self._look(detections, picture)
        impossible = self._weigh()
        self._resample(redraw=appeared or vanished or impossible)

    def observe_closely(self, detections: Detections) -> None:
        """The same with what another camera shows, which says nothing of where nothing is."""
        picture = self._propagate(detections)
        seen, appeared = self.objects.associate(picture)
        self._update(picture, seen, appeared, detections.odom_from_base)
        impossible = self._weigh()
        self._resample(redraw=appeared or impossible)

    def inspect(self, inspection: Inspection) -> None:
        """One step of Algorithm 1 with what a look into a thing shows, and does not show."""
        if inspection.label not in self.classes:
            return
        point = self.backbone.locate(inspection.odom_from_base).apply(inspection.center_base)
        number = self.objects.nearest(self.classes.index(inspection.label), point)
        if number is None:
            return
        missing = [name for name in inspection.sought if name not in inspection.found]
        known = [self.classes.index(name) for name in missing if name in self.classes]
        self.insides.look(number, inspection.seen, np.array(known, np.int32))
        self._weigh()
        self._resample(redraw=True)

    def glance(self, scene: SceneObservation) -> None:
        """One step of Algorithm 1 with what a picture says about kinds of places."""
        if self.places is None:
            return
        if self.places.see(scene, self.backbone.locate(scene.odom_from_base)):
            self._extend(scene.odom_from_base)
        appeared = self.places.survey(self.grid) if self.places.outdated else False
        impossible = self._weigh()
        self._resample(redraw=appeared or impossible)

    def hear(self, readings: tuple[Reading, ...], odom_from_base: Pose2) -> None:
        """Take an utterance as evidence: every particle samples what it means, and where it is."""
        if not asked_for(readings) <= asked_for(self.readings):
            self.grid.ask_anew()
        self.readings = readings
        self.viewer = self.backbone.locate(odom_from_base)
        self._points = EvenPoints(self._rng)
        self._resample(redraw=True)

    def recall(self, readings: tuple[Reading, ...]) -> None:
        """Take back the readings of an utterance whose hypotheses were restored."""
        self.readings = readings
        fits = [
            self._target_of(replace(self.particles, reading=np.full(self._count, number, np.int32)))
            for number in range(len(readings))
        ]
        # Readings are not published: each particle gets the one that explains it best.
        best = np.argmax(np.array(fits), axis=0).astype(np.int32)
        self.particles = replace(self.particles, reading=best)
        self._log_target = self._target_of(self.particles)

    def move(self, odom_from_base: Pose2, noise: OdometryNoise) -> None:
        """Follow dead reckoning."""
        self.backbone.move(odom_from_base, noise)
        if self.backbone.due(odom_from_base):
            self._extend(odom_from_base)

    def resume(self, backbone: Backbone, particles: Particles, odom_from_base: Pose2) -> None:
        """Go on with what an earlier life of the process left."""
        self.backbone, self.particles = backbone, particles
        self._allocate(odom_from_base)

    def jump(self, before: Pose2, after: Pose2) -> None:
        """Dead reckoning broke off at `before` and began again at `after`."""
        if self.places is not None:
            self.places.forget_scan()
        self._settle(self.backbone.jump(before, after), after)

    def scan(self, scan: LaserScan) -> None:
        """Enter a scan into the grid."""
        self.grid.insert(scan, self.backbone.locate(scan.odom_from_base))
        self.backbone.scan(points_of(scan), scan.odom_from_base)
        if self.places is not None:
            self.places.scan(scan)

    @property
    def evidence(self) -> Evidence:
        """What all hypotheses are judged by, without the regions of their topologies."""
        return Evidence(
            classes=self.classes,
            objects=self.objects.columns,
            grid=self.grid,
            viewer=self.viewer,
            readings=self.readings,
            locations=len(self.places.locations) if self.places else 0,
            layout=self.places.layout if self.places else None,
            insides=self.insides,
        )

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
        self._settle(self.backbone.extend(odom_from_base), odom_from_base)

    def _settle(self, solved: bool, odom_from_base: Pose2) -> None:
        """Take over what the pose graph says now."""
        if not solved:
            self.faults.note("refused by the solver", self.backbone.refusal)
            return
        self.objects.moved(self.backbone.objects)
        self._stale = True
        self._allocate(odom_from_base)

    def _allocate(self, odom_from_base: Pose2) -> None:
        """Step 1 of Algorithm 1: sample regions, their edges, and what merges."""
        if self.places is None:
            return
        poses = self.backbone.trajectory
        for count in range(len(self.places.atlas) + 1, len(poses) + 1):
            variance = self.backbone.uncertainty.position_variance
            self.places.extend(poses[:count], variance, odom_from_base, self.grid)
            if count == 1:
                continue  # Where the robot starts is one region in all hypotheses.
            # Each particle decides for itself, and of all of them the right share does.
            uniforms = (self._rng.permutation(self._count) + self._rng.random()) / self._count
            self.topologies, owner = propagate(
                self.topologies, self.particles.topology, uniforms, self.places.atlas
            )
            self.particles = replace(self.particles, topology=owner)
        self.places.survey(self.grid)

    def _look(self, detections: Detections, picture: Picture) -> bool:
        """Negative evidence, for places and for known things; True if one of these is gone."""
        view = visibility.view_of(detections, self._camera)
        sought = sought_in(detections, self.classes)
        if sought[list(asked_for(self.readings))].all():
            here, shown = picture.map_from_base, picture.points_base
            visibility.look(self.grid, view, here, shown, for_all=bool(sought.all()))
        return self.objects.miss(picture, view, sought)

    def _weigh(self) -> bool:
        """Eq. weight_update_all: weights follow the change of the density they sample.

        True if no hypothesis is possible any more.
        """
        if not self.readings and self.places is None:
            return False
        self.particles, now = judged(self.particles, self._cases())
        with np.errstate(invalid="ignore"):  # What was impossible may stay so.
            change = self.particles.log_weight + now - self._log_target
        self.particles = self.particles.weighted(change)
        self._log_target = now
        if np.isfinite(change).any():
            return False
        self.faults.note("no hypothesis fits", "all weights vanished: all are drawn anew")
        return True

    def _resample(self, redraw: bool) -> None:
        """Draw anew when the set of things changed or hypotheses are depleted.

        They are renewed at every pose node too: weights alone cannot move one.
        """
        depleted = self.particles.effective < self._count / 2
        if not (redraw or depleted or self._stale):
            return
        self._stale = False
        if self.readings:
            cases = self._cases()
            self._take(drawn(cases, self._count, self.topologies, self._points, self._rng))
        elif depleted:
            self._take(self.particles)

    def _take(self, pool: Particles) -> None:
        chosen = pool.resampled(self._count, self._points.start)
        self.topologies, owner = self.topologies.living(chosen.topology)
        self.particles = replace(chosen, topology=owner)
        self._log_target = self._target_of(self.particles)

    def _target_of(self, particles: Particles) -> Floats:
        """Log density (P,) of what the particles sample, given their topologies' priors."""
        return judged(particles, self._cases())[1]

    def _cases(self) -> list[Case]:
        return cases_of(self.topologies, self.places, self.evidence)
