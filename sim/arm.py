"""The arm's body in PhysX: capsules and boxes on the links of the base's articulation."""

from __future__ import annotations

import math

import numpy as np
import sapien
from sapien import physx
from sapien.wrapper.articulation_builder import ArticulationBuilder, LinkBuilder

from robots.arm import ArmSpec, HandBox, LinkShape, Triple, finger_boxes, hand_boxes
from robots.arm_kinematics import inverse_of, joint_steps, pose
from schemas.arrays import Floats
from schemas.geometry import Pose3
from sim.arm_governor import Setpoint
from sim.arm_looks import finger_meshes, link_meshes
from sim.rendering.bodies import render_body

STIFFNESS, DAMPING = 8000.0, 800.0
"""Of the arm's drives [N m/rad, N m s/rad]."""
FINGER_DAMPING = 100.0
"""[N s/m]"""
FINGER_MASS = 0.1
"""[kg]"""
PAD_FRICTION = 1.0
NO_SELF_COLLISION = [1, 1, 2, 1]
"""Shapes that share the third group pass through one another: a link that is pressed into its
neighbour for good would blow the robot apart without a message."""
_z_from_x = sapien.Pose(q=[math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0])
"""Joints turn about x of their frame, which here must be z of the link before."""
_jammed = 1e6
"""Stiffness of a joint that does not move any more."""


class ArmBody:
    """Links, joints and fingers of an arm; they are added to an articulation before it is built.

    Args:
        builder: of the whole robot.
        chassis: what the arm's foot stands on.
        scene: for the materials.
        arm: its measures.
    """

    def __init__(
        self,
        builder: ArticulationBuilder,
        chassis: LinkBuilder,
        scene: sapien.Scene,
        arm: ArmSpec,
    ) -> None:
        self._arm = arm
        self._jammed: set[int] = set()
        self._dull = scene.create_physical_material(0.3, 0.3, 0.0)
        self._grippy = scene.create_physical_material(PAD_FRICTION, PAD_FRICTION, 0.0)
        parent = chassis
        for index in range(6):
            parent = self._add_link(builder, parent, index)
        for name, side in zip(arm.fingers, (1, -1), strict=True):
            self._add_finger(builder, parent, name, side)

    def _add_link(
        self, builder: ArticulationBuilder, parent: LinkBuilder, index: int
    ) -> LinkBuilder:
        arm = self._arm
        link = builder.create_link_builder(parent)
        link.set_name(arm.joints[index])
        rest = pose(inverse_of(joint_steps(arm, np.zeros(6))[index]))
        foot = _sapien(arm.base_from_foot) if index == 0 else sapien.Pose()
        link.set_joint_properties(
            "revolute",
            [[arm.limits.low[index], arm.limits.high[index]]],
            foot * _z_from_x,
            _sapien(rest) * _z_from_x,
        )
        link.set_joint_name(arm.joints[index])
        shapes = [shape for shape in arm.shapes if shape.link == index + 1]
        for shape in shapes:
            _add_capsule(link, shape, self._dull)
        if index == 5:
            for box in hand_boxes(arm):
                _add_box(link, box, self._dull)
        middle = np.mean([np.add(shape.start, shape.end) / 2 for shape in shapes], axis=0)
        _weigh(link, arm.masses[index], _triple(middle), max(_length(s) for s in shapes))
        return link

    def _add_finger(
        self, builder: ArticulationBuilder, hand: LinkBuilder, name: str, side: int
    ) -> None:
        gripper = self._arm.gripper
        finger = builder.create_link_builder(hand)
        finger.set_name(name)
        # It slides along x of the joint's frame, outwards.
        outwards = sapien.Pose(q=[math.sqrt(0.5), 0.0, 0.0, side * math.sqrt(0.5)])
        finger.set_joint_properties("prismatic", [[0.0, gripper.opening / 2]], outwards, outwards)
        finger.set_joint_name(name)
        box = finger_boxes(gripper, 0.0)[0 if side > 0 else 1]
        _add_box(finger, box, self._grippy)
        _weigh(finger, FINGER_MASS, box.center, gripper.finger[2])

    def bind(self, articulation: physx.PhysxArticulation, visible: bool) -> None:
        """Take hold of the joints once the articulation is built, and dress the links."""
        names = [joint.name for joint in articulation.active_joints]
        self._articulation = articulation
        self._joints = [names.index(name) for name in self._arm.joints]
        self._fingers = [names.index(name) for name in self._arm.fingers]
        links = {link.name: link for link in articulation.links}
        for link in links.values():
            for shape in link.collision_shapes:
                shape.set_collision_groups(NO_SELF_COLLISION)
        for index, name in enumerate((*self._arm.joints, *self._arm.fingers)):
            # A real arm's controller carries the weight of the arm itself.
            links[name].disable_gravity = True
            if visible:
                meshes = (
                    link_meshes(self._arm, index + 1)
                    if index < len(self._arm.joints)
                    else finger_meshes(self._arm, index - len(self._arm.joints))
                )
                links[name].entity.add_component(render_body(meshes))
        self._set_drives()

    def _set_drives(self) -> None:
        joints, gripper = self._articulation.active_joints, self._arm.gripper
        for index, torque in zip(self._joints, self._arm.limits.torque, strict=True):
            joints[index].set_drive_properties(STIFFNESS, DAMPING, torque)
        for index in self._fingers:
            joints[index].set_drive_properties(gripper.stiffness, FINGER_DAMPING, gripper.force)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all joints, fingers last."""
        return (*self._arm.joints, *self._arm.fingers)

    @property
    def positions(self) -> Floats:
        """(8,) in the order of `names` [rad, m]."""
        return np.asarray(self._articulation.qpos, np.float64)[self._joints + self._fingers]

    @property
    def velocities(self) -> Floats:
        """(8,) in the order of `names` [rad/s, m/s]."""
        return np.asarray(self._articulation.qvel, np.float64)[self._joints + self._fingers]

    def place(self, positions: Floats) -> None:
        """Put the joints (8,) somewhere, at rest."""
        everything = np.asarray(self._articulation.qpos)
        everything[self._joints + self._fingers] = positions
        self._articulation.set_qpos(everything)
        still = Setpoint(positions[:6], np.zeros(6))
        self.drive(still, float(positions[6:].sum()))

    def drive(self, setpoint: Setpoint, opening: float) -> None:
        """Where the joints and the gap between the pads [m] are to be after the next step."""
        joints = self._articulation.active_joints
        targets = zip(self._joints, setpoint.positions, setpoint.velocities, strict=True)
        for index, position, velocity in targets:
            if index not in self._jammed:
                joints[index].set_drive_target(float(position))
                # Without it the arm would lag behind by damping over stiffness.
                joints[index].set_drive_velocity_target(float(velocity))
        for index in self._fingers:
            joints[index].set_drive_target(opening / 2)

    def jam(self, name: str) -> None:
        """From now on a joint stays where it is, whatever is commanded."""
        index = [joint.name for joint in self._articulation.active_joints].index(name)
        joint = self._articulation.active_joints[index]
        self._jammed.add(index)
        joint.set_drive_properties(_jammed, _jammed / 10, math.inf)
        joint.set_drive_target(float(self._articulation.qpos[index]))
        joint.set_drive_velocity_target(0.0)


def _add_capsule(link: LinkBuilder, shape: LinkShape, material: physx.PhysxMaterial) -> None:
    start, end = np.array(shape.start), np.array(shape.end)
    middle, half = (start + end) / 2, _length(shape) / 2
    link.add_capsule_collision(
        sapien.Pose(middle.tolist(), _along(end - start)), shape.radius, half, material=material
    )


def _add_box(link: LinkBuilder, box: HandBox, material: physx.PhysxMaterial) -> None:
    x, y, z = box.size
    half = (x / 2, y / 2, z / 2)
    link.add_box_collision(sapien.Pose(list(box.center)), half, material=material)


def _weigh(link: LinkBuilder, mass: float, middle: Triple, length: float) -> None:
    inertia = mass * (length**2 / 12 + 0.002)
    link.set_mass_and_inertia(mass, sapien.Pose(list(middle)), [inertia] * 3)


def _length(shape: LinkShape) -> float:
    return math.dist(shape.start, shape.end)


def _along(direction: Floats) -> list[float]:
    """Rotation that takes x to a direction (3,)."""
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    if x < -0.999:
        return [0.0, 0.0, 0.0, 1.0]
    quaternion = np.array([1 + x, 0.0, -z, y])
    return (quaternion / np.linalg.norm(quaternion)).tolist()


def _sapien(pose: Pose3) -> sapien.Pose:
    return sapien.Pose(list(pose.position), list(pose.wxyz))


def _triple(values: Floats) -> Triple:
    x, y, z = values.tolist()
    return x, y, z
