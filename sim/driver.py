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

from robots.arm_kinematics import forward, pose
from robots.driver import Reading
from robots.kinematics import wheel_speeds
from robots.spec import RobotSpec
from schemas.errors import UserError
from schemas.geometry import Pose2, Pose3
from schemas.motion import ArmCommand, BaseCommand, GripperCommand
from schemas.sensing import JointState, LaserScan, Odometry, RgbdFrame, WristFrame
from sim.arm_mover import ArmMover
from sim.assets.library import SMALL, bounds
from sim.base import WHEELS, BaseBody
from sim.governor import BaseGovernor
from sim.loose import LooseThings
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
ARM_JOINTS_HZ = 20.0
_in_hand = 0.15
"""From the point between the fingers to the middle of what they hold, at most [m]."""


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
    arm_positions: tuple[float, ...] = ()
    opening: float = 0.0
    """That the gripper was to have [m]."""
    things: dict[str, Pose3] = {}
    """Poses in the world of what is loose."""


class SapienDriver:
    """One robot in one world. Same world, seed and commands give the same readings, byte for byte.

    Without `camera` no renderer is needed and no `RgbdFrame` comes; physics and all other sensors
    are the same.
    """

    def __init__(self, spec: RobotSpec, world: World, seed: int = 0, camera: bool = True) -> None:
        self._spec = spec
        self._world = world
        self._looks = {placed.id: (placed.label, placed.look) for placed in world.objects}
        self._seed = seed
        self._tick = 0
        self._governor = BaseGovernor(spec.limits)
        self._slip = (0.0, 0.0)
        self._physics = physx.PhysxCpuSystem()
        self._scene = _make_scene(self._physics, camera)
        # Without an arm nobody moves small things: they are obstacles like all others.
        self._loose = LooseThings(self._scene, world, visible=camera) if spec.arm else None
        add_obstacles(self._scene, world, loose=SMALL if spec.arm else ())
        self._base = BaseBody(self._scene, spec, world.world_from_start, visible=camera)
        self._arm = ArmMover(self._base.arm, spec.arm) if self._base.arm and spec.arm else None
        self._world_from_base = world.world_from_start
        self._odom_from_base = Pose2(0.0, 0.0, 0.0)
        self._camera = self._make_camera() if camera else None
        self._wrist = self._make_wrist() if camera and spec.arm else None
        self._due = self._schedule()

    def _make_camera(self) -> Camera:
        stage = Stage(self._scene, self._world.ground, self._world.sun)
        for placed in self._world.objects:
            if self._loose is None or placed.label not in SMALL:
                stage.put(placed)
        spec = self._spec.camera
        return Camera(self._scene, spec.width, spec.height, spec.horizontal_fov)

    def _make_wrist(self) -> Camera:
        assert self._spec.arm is not None
        wrist = self._spec.arm.camera
        return Camera(self._scene, wrist.width, wrist.height, wrist.horizontal_fov)

    def _schedule(self) -> list[tuple[int, Callable[[], Reading]]]:
        """Period in ticks of every sensor, in the order in which they read at one tick."""
        table: list[tuple[float, Callable[[], Reading]]] = [
            (ODOMETRY_HZ, self._odometry),
            (ARM_JOINTS_HZ if self._arm else JOINTS_HZ, self._joints),
            (self._spec.laser.rate_hz, self._laser_scan),
        ]
        if self._camera is not None:
            table.append((self._spec.camera.rate_hz, self._rgbd))
        if self._wrist is not None and self._spec.arm is not None:
            table.append((self._spec.arm.camera.rate_hz, self._wrist_rgbd))
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

    @property
    def arm_joints(self) -> np.ndarray:
        """Angles of the arm's joints (6,) as they truly are, for evaluation [rad]."""
        return self._moved_arm().body.positions[:6]

    def in_gripper(self) -> tuple[str, ...]:
        """Ids of the things that are truly between the fingers, for evaluation."""
        if self._arm is None or self._loose is None or self._spec.arm is None:
            return ()
        arm = self._spec.arm
        hand = arm.base_from_foot @ pose(forward(arm, self.arm_joints)) @ arm.flange_from_tool
        tool = np.array((self._world_from_base.lifted() @ hand).position)
        middles = {
            name: at.apply(np.mean(bounds(*self._looks[name]), axis=0))
            for name, at in self._loose.poses.items()
        }
        return tuple(
            name for name, at in middles.items() if float(np.linalg.norm(at - tool)) < _in_hand
        )

    def command(self, command: BaseCommand) -> None:
        """Take a velocity; it is obeyed within the limits until it expires."""
        self._governor.take(command, self.stamp_ns)

    def command_arm(self, command: ArmCommand) -> None:
        """Begin a motion of the arm within its limits, or go on with it until it expires."""
        self._moved_arm().governor.take(command, self.stamp_ns)

    def command_gripper(self, command: GripperCommand) -> None:
        """Open or close the gripper."""
        self._moved_arm().gripper.take(command)

    def _moved_arm(self) -> ArmMover:
        if self._arm is None:
            raise UserError(f"robot {self._spec.name!r} has no arm to command")
        return self._arm

    def jam_joint(self, name: str) -> None:
        """For tests: a joint of the arm does not move any more."""
        self._moved_arm().body.jam(name)

    @property
    def loose(self) -> LooseThings | None:
        """What can be picked up, for `sim.oracle` and tests alone."""
        return self._loose

    @property
    def scene(self) -> sapien.Scene:
        """For evaluation: contacts, and pictures from outside."""
        return self._scene

    def latch_stop(self, stopped: bool) -> None:
        """Stop all motion until released with False."""
        self._governor.latch(stopped)
        if self._arm:
            self._arm.latch(stopped)

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
        if self._arm:
            self._arm.advance(self.stamp_ns, TICK_S)
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
        arm = self._base.arm
        none = np.zeros(0)
        return JointState(
            stamp_ns=self.stamp_ns,
            names=(*(f"{name}_wheel" for name in WHEELS), *(arm.names if arm else ())),
            positions=np.r_[self._base.wheel_angles, arm.positions if arm else none],
            velocities=np.r_[left, right, left, right, arm.velocities if arm else none],
        )

    def _laser_scan(self) -> LaserScan:
        spec = self._spec.laser
        rng = generator(self._seed, "laser", self._tick)
        return LaserScan(
            stamp_ns=self.stamp_ns,
            angle_min=-math.pi,
            angle_increment=2 * math.pi / spec.beams,
            range_max=spec.range_max,
            ranges=scan(self._physics, spec, self._spec.base, self._world_from_base, rng),
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

    def _wrist_rgbd(self) -> WristFrame:
        assert self._wrist is not None
        arm, body = self._spec.arm, self._base.arm
        assert arm is not None
        assert body is not None
        foot_from_flange = pose(forward(arm, body.positions[:6]))
        base_from_camera = arm.base_from_foot @ foot_from_flange @ arm.camera.flange_from_camera
        picture = self._wrist.picture(
            self._world_from_base.lifted() @ base_from_camera, self._world.seed
        )
        rng = generator(self._seed, "wrist", self._tick)
        return WristFrame(
            stamp_ns=self.stamp_ns,
            color=picture.color,
            depth_mm=measured_depth(picture.depth, arm.camera.range_max, rng),
            intrinsics=self._wrist.intrinsics,
            base_from_camera=base_from_camera,
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
            arm_positions=tuple(self._base.arm.positions.tolist()) if self._base.arm else (),
            opening=self._arm.gripper.opening if self._arm else 0.0,
            things=self._loose.poses if self._loose else {},
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
        if self._arm and self._loose:
            self._arm.place(np.array(saved.arm_positions), saved.opening)
            self._loose.place(saved.things)
        self.latch_stop(saved.stopped)
        self._governor.resume_at(saved.linear, saved.angular)

    def close(self) -> None:
        """Let go of the scene."""
        self._camera = self._wrist = None
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
