"""The robot's body in PhysX: a box on four frictionless balls whose root velocity is imposed.

An arm's links belong to the same articulation.
"""

from __future__ import annotations

import math

import numpy as np
import sapien
from numpy.typing import NDArray
from sapien.wrapper.articulation_builder import LinkBuilder

from robots.spec import RobotSpec
from schemas.geometry import Pose2, wrap_angle
from sim.arm import ArmBody
from sim.arm_looks import foot_meshes
from sim.husky_looks import chassis_meshes, wheel_meshes
from sim.rendering.bodies import render_body

SUPPORT_RADIUS = 0.06
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
DRIVE_DAMPING = 1e3


class BaseBody:
    """An articulation: chassis at the root, wheels as links that turn for looks and encoders."""

    def __init__(self, scene: sapien.Scene, spec: RobotSpec, start: Pose2, visible: bool) -> None:
        self._spec = spec
        self._visible = visible
        builder = scene.create_articulation_builder()
        chassis = builder.create_link_builder()
        chassis.set_name("chassis")
        self._shape_chassis(scene, chassis)
        for name in WHEELS:
            self._shape_wheel(builder.create_link_builder(chassis), name)
        self.arm = ArmBody(builder, chassis, scene, spec.arm) if spec.arm else None
        builder.set_initial_pose(_lifted(start))
        self._articulation = builder.build(fix_root_link=False)
        self._dress()
        joints = self._articulation.active_joints
        names = [joint.name for joint in joints]
        self._wheels = [names.index(f"{name}_wheel") for name in WHEELS]
        self._wheel_joints = [joints[index] for index in self._wheels]
        for joint in self._wheel_joints:
            joint.set_drive_properties(stiffness=0.0, damping=DRIVE_DAMPING)
        if self.arm:
            self.arm.bind(self._articulation, visible)

    def _shape_chassis(self, scene: sapien.Scene, chassis: LinkBuilder) -> None:
        base = self._spec.base
        slippery = scene.create_physical_material(0.0, 0.0, 0.0)
        bottom = base.height / 3
        chassis.add_box_collision(
            sapien.Pose([0, 0, (bottom + base.height) / 2]),
            (base.length / 2, base.width / 2, (base.height - bottom) / 2),
            material=slippery,
        )
        for x in (-base.wheelbase / 2, base.wheelbase / 2):
            for y in (-base.track / 2, base.track / 2):
                at = sapien.Pose([x, y, SUPPORT_RADIUS])
                chassis.add_sphere_collision(at, SUPPORT_RADIUS, material=slippery)
        chassis.set_mass_and_inertia(
            base.mass,
            sapien.Pose([0, 0, 0.15]),
            (np.array([1.9, 3.2, 4.2]) * base.mass / 40).tolist(),
        )

    def _shape_wheel(self, wheel: LinkBuilder, name: str) -> None:
        base = self._spec.base
        x = base.wheelbase / 2 * (1 if name.startswith("front") else -1)
        y = base.track / 2 * (1 if name.endswith("left") else -1)
        # A revolute joint turns about x of its frame, which here must be y of the base.
        turned = [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
        wheel.set_name(name)
        wheel.set_joint_name(f"{name}_wheel")
        wheel.set_joint_properties(
            "continuous",
            [[-math.inf, math.inf]],
            sapien.Pose([x, y, base.wheel_radius], turned),
            sapien.Pose(q=turned),
        )
        wheel.set_mass_and_inertia(1.0, sapien.Pose(), [0.02, 0.02, 0.02])

    def _dress(self) -> None:
        if not self._visible:
            return
        for link in self._articulation.links:
            if link.name == "chassis":
                foot = foot_meshes(self._spec.arm) if self._spec.arm else ()
                link.entity.add_component(render_body((*chassis_meshes(self._spec), *foot)))
            elif link.name in WHEELS:
                link.entity.add_component(render_body(wheel_meshes(self._spec)))

    @property
    def world_from_base(self) -> Pose2:
        """True pose on the ground plane."""
        pose = self._articulation.root_pose
        x, y, _ = (float(value) for value in pose.p)
        w, qx, qy, qz = (float(value) for value in pose.q)
        yaw = math.atan2(2 * (w * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        return Pose2(x, y, wrap_angle(yaw))

    @property
    def wheel_angles(self) -> NDArray[np.float64]:
        """(4,) in the order of `WHEELS` [rad]."""
        return np.asarray(self._articulation.qpos, np.float64)[self._wheels]

    def place(self, world_from_base: Pose2, wheel_angles: NDArray[np.float64]) -> None:
        """Put the resting base somewhere."""
        self._articulation.set_root_pose(_lifted(world_from_base))
        everything = np.asarray(self._articulation.qpos)
        everything[self._wheels] = wheel_angles
        self._articulation.set_qpos(everything)
        self.drive(0.0, 0.0, np.zeros(4))

    def drive(self, linear: float, angular: float, wheels: NDArray[np.float64]) -> None:
        """Impose planar speeds [m/s, rad/s] for the next physics step and turn the wheels [rad/s].

        Heave, roll and pitch are left to the physics, so the base can tilt and be held up.
        """
        body = self._articulation
        yaw = self.world_from_base.yaw
        heave = float(body.root_linear_velocity[2])
        roll, pitch, _ = (float(value) for value in body.root_angular_velocity)
        body.set_root_linear_velocity([linear * math.cos(yaw), linear * math.sin(yaw), heave])
        body.set_root_angular_velocity([roll, pitch, angular])
        speeds = np.asarray(body.qvel)
        speeds[self._wheels] = wheels
        body.set_qvel(speeds)
        for joint, speed in zip(self._wheel_joints, wheels, strict=True):
            joint.set_drive_velocity_target(float(speed))


def _lifted(pose: Pose2) -> sapien.Pose:
    half = pose.yaw / 2
    return sapien.Pose([pose.x, pose.y, 0.0], [math.cos(half), 0.0, 0.0, math.sin(half)])
