"""The RobotDriver made of SAPIEN: deterministic, stepped from outside, without a clock.

Import this module after `sim.vulkan.activate()`, because it imports sapien.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import msgspec
import numpy as np
import sapien
from msgspec import Struct
from sapien import physx, render

from robots.driver import Reading
from robots.kinematics import wheel_speeds
from robots.spec import RobotSpec
from schemas.geometry import Pose2
from schemas.motion import BaseCommand
from schemas.sensing import JointState, LaserScan, Odometry, RgbdFrame
from sim.base import WHEELS, BaseBody
from sim.governor import BaseGovernor
from sim.obstacles import add_obstacles
from sim.rendering.camera import Camera
from sim.rendering.stage import Stage
from sim.scenes.model import World
from sim.sensors import measured_depth, scan
from sim.slip import generator, measured_motion, next_slip

TICK_NS = 10_000_000
TICK_S = TICK_NS / 1e9
ODOMETRY_HZ = 20.0
JOINTS_HZ = 10.0


class _State(Struct, frozen=True, kw_only=True):
    """What a checkpoint holds."""

    robot: str
    world: str
    seed: int
    tick: int
    world_from_base: Pose2
    odom_from_base: Pose2
    linear: float
    angular: float
    slip: tuple[float, float]
    wheel_angles: tuple[float, ...]
    stopped: bool


class SapienDriver:
    """One robot in one world. Same world, seed and commands give the same readings, byte for byte.

    Without `camera` no renderer is needed and no `RgbdFrame` comes; physics and all other sensors
    are the same.
    """

    def __init__(self, spec: RobotSpec, world: World, seed: int = 0, camera: bool = True) -> None:
        self._spec = spec
        self._world = world
        self._seed = seed
        self._tick = 0
        self._governor = BaseGovernor(spec.limits)
        self._slip = (0.0, 0.0)
        self._physics = physx.PhysxCpuSystem()
        self._scene = _make_scene(self._physics, camera)
        add_obstacles(self._scene, world)
        self._base = BaseBody(self._scene, spec, world.world_from_start, visible=camera)
        self._world_from_base = world.world_from_start
        self._odom_from_base = Pose2(0.0, 0.0, 0.0)
        self._camera = self._make_camera() if camera else None
        self._due = self._schedule()

    def _make_camera(self) -> Camera:
        stage = Stage(self._scene, self._world.ground, self._world.sun)
        for placed in self._world.objects:
            stage.put(placed)
        spec = self._spec.camera
        return Camera(self._scene, spec.width, spec.height, spec.horizontal_fov)

    def _schedule(self) -> list[tuple[int, Callable[[], Reading]]]:
        """Period in ticks of every sensor, in the order in which they read at one tick."""
        table: list[tuple[float, Callable[[], Reading]]] = [
            (ODOMETRY_HZ, self._odometry),
            (JOINTS_HZ, self._joints),
            (self._spec.laser.rate_hz, self._laser_scan),
        ]
        if self._camera is not None:
            table.append((self._spec.camera.rate_hz, self._rgbd))
        return [(round(1 / rate / TICK_S), read) for rate, read in table]

    @property
    def spec(self) -> RobotSpec:
        """What this robot is."""
        return self._spec

    @property
    def stamp_ns(self) -> int:
        """Simulated time since the world began."""
        return self._tick * TICK_NS

    @property
    def stopped(self) -> bool:
        """Whether the stop is latched."""
        return self._governor.stopped

    @property
    def world_from_base(self) -> Pose2:
        """Ground truth, for `sim.oracle` alone."""
        return self._world_from_base

    def command(self, command: BaseCommand) -> None:
        """Take a velocity; it is obeyed within the limits until it expires."""
        self._governor.take(command, self.stamp_ns)

    def latch_stop(self, stopped: bool) -> None:
        """Stop all motion until released with False."""
        self._governor.latch(stopped)

    def step(self, until_ns: int) -> Iterable[Reading]:
        """Advance by whole ticks of 10 ms while they end by `until_ns`; readings oldest first."""
        readings: list[Reading] = []
        while (self._tick + 1) * TICK_NS <= until_ns:
            self._advance()
            readings += [read() for period, read in self._due if self._tick % period == 0]
        return readings

    def _advance(self) -> None:
        linear, angular = self._governor.advance(self.stamp_ns, TICK_S)
        self._tick += 1
        self._slip = next_slip(self._slip, generator(self._seed, "slip", self._tick), TICK_S)
        left, right = wheel_speeds(self._spec.base, linear, angular)
        wheels = np.array([left, right, left, right])
        self._base.drive(linear * (1 + self._slip[0]), angular * (1 + self._slip[1]), wheels)
        self._scene.step()
        before, self._world_from_base = self._world_from_base, self._base.world_from_base
        motion = before.inverse() @ self._world_from_base
        rng = generator(self._seed, "odometry", self._tick)
        self._odom_from_base @= measured_motion(motion, self._spec.odometry, rng)

    def _odometry(self) -> Odometry:
        noise = self._spec.odometry
        return Odometry(
            stamp_ns=self.stamp_ns,
            odom_from_base=self._odom_from_base,
            linear=self._governor.linear,
            angular=self._governor.angular,
            variance_per_metre=noise.variance_per_metre,
            variance_per_radian=noise.variance_per_radian,
        )

    def _joints(self) -> JointState:
        left, right = wheel_speeds(self._spec.base, self._governor.linear, self._governor.angular)
        return JointState(
            stamp_ns=self.stamp_ns,
            names=tuple(f"{name}_wheel" for name in WHEELS),
            positions=self._base.wheel_angles,
            velocities=np.array([left, right, left, right]),
        )

    def _laser_scan(self) -> LaserScan:
        spec = self._spec.laser
        rng = generator(self._seed, "laser", self._tick)
        return LaserScan(
            stamp_ns=self.stamp_ns,
            angle_min=-math.pi,
            angle_increment=2 * math.pi / spec.beams,
            range_max=spec.range_max,
            ranges=scan(self._physics, spec, self._world_from_base, rng),
            base_from_laser=spec.base_from_laser,
            odom_from_base=self._odom_from_base,
        )

    def _rgbd(self) -> RgbdFrame:
        assert self._camera is not None
        spec = self._spec.camera
        world_from_camera = self._world_from_base.lifted() @ spec.base_from_camera
        picture = self._camera.picture(world_from_camera, self._world.seed)
        rng = generator(self._seed, "camera", self._tick)
        return RgbdFrame(
            stamp_ns=self.stamp_ns,
            color=picture.color,
            depth_mm=measured_depth(picture.depth, spec.range_max, rng),
            intrinsics=self._camera.intrinsics,
            base_from_camera=spec.base_from_camera,
            odom_from_base=self._odom_from_base,
        )

    def checkpoint(self) -> bytes:
        """Everything but the command in force, which must not outlive its sender."""
        state = _State(
            robot=self._spec.name,
            world=self._world.name,
            seed=self._seed,
            tick=self._tick,
            world_from_base=self._world_from_base,
            odom_from_base=self._odom_from_base,
            linear=self._governor.linear,
            angular=self._governor.angular,
            slip=self._slip,
            wheel_angles=tuple(self._base.wheel_angles.tolist()),
            stopped=self.stopped,
        )
        return msgspec.msgpack.encode(state)

    def restore(self, state: bytes) -> None:
        """Go on from a checkpoint; the base slows down from its speed at that time.

        Raises:
            ValueError: the bytes are no checkpoint, or one of another robot, world or seed.
        """
        try:
            saved = msgspec.msgpack.decode(state, type=_State)
        except msgspec.DecodeError as error:
            raise ValueError(f"not a checkpoint of the simulated robot: {error}") from error
        expected = (self._spec.name, self._world.name, self._seed)
        given = (saved.robot, saved.world, saved.seed)
        if given != expected:
            raise ValueError(f"a checkpoint of robot, world, seed {given}; this is {expected}")
        self._tick, self._slip = saved.tick, saved.slip
        self._base.place(saved.world_from_base, np.array(saved.wheel_angles))
        self._world_from_base, self._odom_from_base = saved.world_from_base, saved.odom_from_base
        self._governor.latch(saved.stopped)
        self._governor.resume_at(saved.linear, saved.angular)

    def close(self) -> None:
        """Let go of the scene."""
        self._camera = None
        self._due = []
        self._scene.clear()


def _make_scene(physics: physx.PhysxCpuSystem, renders: bool) -> sapien.Scene:
    """A scene at 100 Hz. A render system exists only if wanted: it needs a Vulkan device."""
    systems: list[sapien.System] = [physics]
    if renders:
        systems.append(render.RenderSystem())
    scene = sapien.Scene(systems)
    scene.set_timestep(TICK_S)
    return scene
