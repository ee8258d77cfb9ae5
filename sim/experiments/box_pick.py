"""The arm alone: look into an open box, take a thing out by planned motions, hold it.

The box and the thing are known here as perception would tell them in its message `Bodies`; the base
stands still. `python -m sim.experiments.box_pick` runs it over many seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro
from PIL import Image

from robots.arm_kinematics import pose
from robots.husky_ur5.spec import HUSKY_UR5, UR5
from schemas.arrays import Floats
from schemas.geometry import Pose2, Pose3
from schemas.motion import GripperCommand
from schemas.perception import Bodies
from schemas.sensing import JointState, RgbdFrame
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision
from services.manipulation.errors import RefusalError
from services.manipulation.following import Follower, Progress
from services.manipulation.grasps import Thing
from services.manipulation.holding import fingers_gap, is_held
from services.manipulation.looks import look_into
from services.manipulation.motions import free_motion
from services.manipulation.obstacles import body_frame, from_bodies, own_body
from services.manipulation.picking import Pick, plan_pick
from services.manipulation.straight import tool_frame
from services.manipulation.timing import Motion
from sim import vulkan
from sim.assets.library import bounds
from sim.experiments.true_bodies import message_of, true_body
from sim.scenes.boxes import put_into
from sim.scenes.model import Ground, PlacedObject, Sun, World

HOLD_S = 3.0
THING, BOX = "thing", "box"
_tick_ns = 10_000_000
_at_hand = 0.15
"""Further from the fingers than this the thing is not what they hold [m]."""
_send_ticks = 5
_here = Pose3((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


@dataclass
class PickTrial:
    """What came of one seed."""

    seed: int
    failure: HandlingFailure | None = None
    reason: str = "held"
    time_s: float = 0.0
    arm_force: float = 0.0
    """Largest of the arm on the box [N]."""
    thing_force: float = 0.0
    """Largest of the thing on the box from when it is held on [N]."""
    slip: float = 0.0
    """How far the thing moved in the hand while it was held [m]."""
    pictures: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])


def box_world(seed: int, label: str = "ball") -> World:
    """A box before the robot with a thing of a class in it, another box beside."""
    rng = np.random.default_rng([seed, 6])
    at = Pose2(rng.uniform(0.80, 0.95), rng.uniform(-0.2, 0.2), rng.uniform(-math.pi, math.pi))
    box = PlacedObject(id=BOX, label="box", look=int(rng.integers(1000)), world_from_object=at)
    thing = put_into(box, label, rng, THING)
    beside = Pose2(at.x + rng.uniform(-0.1, 0.1), at.y + rng.choice([-1, 1]) * 0.62, 0.3)
    other = PlacedObject(
        id="other", label="box", look=int(rng.integers(1000)), world_from_object=beside
    )
    return World(
        name="box_pick",
        seed=seed,
        ground=Ground(kind="concrete", look=seed),
        sun=Sun(azimuth=1.0, elevation=1.0),
        world_from_start=Pose2(0.0, 0.0, 0.0),
        objects=(box, thing, other),
    )


def true_bodies(world: World, thing: Pose3) -> tuple[Bodies, tuple[str, ...]]:
    """The things of a world as perception would tell them, the robot standing at the origin."""
    bodies = [true_body(one, thing if one.id == THING else None) for one in world.objects]
    exactly = [0.0] * len(bodies)
    return message_of(bodies, _here, Pose2(0.0, 0.0, 0.0), exactly), tuple(
        body.label for body in bodies
    )


class StuckError(Exception):
    """The arm does not follow its motion."""


class BoxPick:
    """One trial: the hands of a planner on a driver."""

    def __init__(
        self, seed: int, label: str, camera: bool, meddle: Callable[[BoxPick], None] | None
    ) -> None:
        # sapien must not be imported before the Vulkan driver is chosen.
        from sim.driver import SapienDriver  # noqa: PLC0415
        from sim.touch import forces  # noqa: PLC0415

        self._forces = forces
        self.world = box_world(seed, label)
        self.driver = SapienDriver(HUSKY_UR5, self.world, seed, camera=camera)
        self.trial = PickTrial(seed)
        self._camera = camera
        self._meddle = meddle
        self._rng = np.random.default_rng([seed, 7])
        self._motions = 0
        self._joints = np.zeros(8)
        self.lifted = False
        self._wait(0.5)

    def run(self) -> PickTrial:
        """Look, take, lift, carry, hold."""
        try:
            self._run()
        except RefusalError as refusal:
            self.trial.failure, self.trial.reason = refusal.failure, refusal.reason
        except StuckError:
            self.trial.failure, self.trial.reason = HandlingFailure.STUCK, "the arm does not move"
        self.trial.time_s = self.driver.stamp_ns / 1e9
        return self.trial

    def _run(self) -> None:
        bodies, labels = self._bodies()
        around = [*own_body(HUSKY_UR5), *from_bodies(bodies, labels, _here)]
        box, size, wide = body_frame(bodies, 0), bodies.sizes[0], UR5.gripper.opening
        look = look_into(HUSKY_UR5, box, size, around, self._joints[:6], wide)
        self._grip(wide)
        self._move(self._free(ArmCollision(UR5, around, wide), look.joints))
        self._picture("look")
        pick = self._taken(bodies, labels)
        self._picture("held")
        self._hold(pick)

    def _taken(self, bodies: Bodies, labels: tuple[str, ...]) -> Pick:
        """Go to the thing, shut the gripper, lift."""
        others = [*own_body(HUSKY_UR5), *from_bodies(bodies, labels, _here, without=1)]
        # Of other things the box is known best, whatever they consist of.
        kind = "ball" if labels[1] == "ball" else "box"
        thing = Thing(kind, body_frame(bodies, 1), bodies.sizes[1])
        pick = plan_pick(UR5, thing, others, self._joints[:6], self._rng)
        self._grip(pick.opening)
        self._move(pick.approach)
        self._move(pick.descend)
        self._picture("reach")
        self._grip(pick.grip)
        self._check(pick, HandlingFailure.NOT_HELD, "the fingers closed on nothing")
        self.lifted = True
        self._move(pick.lift)
        self._check(pick, HandlingFailure.DROPPED, "it fell while it was lifted")
        loaded = ArmCollision(UR5, others, pick.width, held=pick.held)
        self._move(self._free(loaded, np.array(UR5.poses["carry"])))
        return pick

    def _hold(self, pick: Pick) -> None:
        before = self.thing_in_hand()
        self._wait(HOLD_S)
        self.trial.slip = float(np.linalg.norm(self.thing_in_hand() - before))
        self._check(pick, HandlingFailure.DROPPED, "it fell while it was held")
        # The truth has the last word: fingers can be held apart by something else.
        if np.linalg.norm(self.thing_in_hand()) > _at_hand:
            raise RefusalError(HandlingFailure.NOT_HELD, "the fingers hold something else")

    def thing_in_hand(self) -> Floats:
        """The thing's place from the point between the fingers (3,) [m]; far if it is gone."""
        assert self.driver.loose is not None
        poses = self.driver.loose.poses
        if THING not in poses:
            return np.full(3, np.inf)
        placed = self.world.find(THING)
        middle = poses[THING].apply(np.mean(bounds(placed.label, placed.look), axis=0))
        tool = tool_frame(UR5, self._joints[:6])
        return tool[:3, :3].T @ (middle - tool[:3, 3])

    def _bodies(self) -> tuple[Bodies, tuple[str, ...]]:
        assert self.driver.loose is not None
        return true_bodies(self.world, self.driver.loose.poses[THING])

    def _free(self, collision: ArmCollision, goal: Floats) -> Motion:
        return free_motion(UR5, collision, self._joints[:6], goal[None], self._rng)

    def _check(self, pick: Pick, failure: HandlingFailure, reason: str) -> None:
        gap = fingers_gap((float(self._joints[6]), float(self._joints[7])))
        if not is_held(UR5.gripper, gap, pick.grip, pick.width):
            raise RefusalError(failure, reason)

    def _grip(self, opening: float) -> None:
        self.driver.command_gripper(GripperCommand(stamp_ns=self.driver.stamp_ns, opening=opening))
        self._wait(1.0)

    def _move(self, motion: Motion) -> None:
        self._motions += 1
        follower = Follower(motion, str(self._motions), self.driver.stamp_ns)
        while True:
            self.driver.command_arm(follower.command(self.driver.stamp_ns))
            self._wait(_send_ticks * _tick_ns / 1e9)
            progress = follower.watch(self._joints[:6], self.driver.stamp_ns)
            if progress is Progress.ARRIVED:
                return
            if progress is Progress.STUCK:
                raise StuckError

    def _wait(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e9 / _tick_ns)):
            if self._meddle:
                self._meddle(self)
            for reading in self.driver.step(self.driver.stamp_ns + _tick_ns):
                if isinstance(reading, JointState):
                    self._joints = reading.positions[4:]
                elif isinstance(reading, RgbdFrame):
                    self.trial.pictures["last " + type(reading).__name__] = reading.color
            self._feel()

    def _feel(self) -> None:
        scene, trial = self.driver.scene, self.trial
        arm = self._forces(scene, (*UR5.joints, *UR5.fingers), BOX)
        trial.arm_force = max(trial.arm_force, arm)
        if self.lifted:
            trial.thing_force = max(trial.thing_force, self._forces(scene, (THING,), BOX))

    def _picture(self, name: str) -> None:
        if not self._camera:
            return
        from sim.rendering.camera import Camera  # noqa: PLC0415

        outside = Camera(self.driver.scene, 640, 480, math.radians(45.0))
        self._wait(0.25)
        self.trial.pictures[f"{name} wrist"] = self.trial.pictures["last WristFrame"]
        self.trial.pictures[f"{name} base"] = self.trial.pictures["last RgbdFrame"]
        self.trial.pictures[name] = outside.picture(_beside()).color

    def close(self) -> None:
        """Let the simulator go."""
        self.driver.close()


def _beside() -> Pose3:
    """A camera to the right of the robot and ahead that looks at it."""
    eye, target = np.array([1.9, -1.5, 1.25]), np.array([0.45, 0.0, 0.45])
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(z, [0.0, 0.0, 1.0]))
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), eye
    return pose(frame)


def run_pick(
    seed: int,
    label: str = "ball",
    camera: bool = False,
    meddle: Callable[[BoxPick], None] | None = None,
) -> PickTrial:
    """One trial.

    Args:
        seed: of the world and of the search.
        label: class of what is taken.
        camera: whether to draw.
        meddle: called before every step, to make something go wrong.
    """
    vulkan.activate()
    trial = BoxPick(seed, label, camera, meddle)
    try:
        return trial.run()
    finally:
        trial.close()


def _save(trial: PickTrial, folder: Path) -> None:
    for name, picture in trial.pictures.items():
        Image.fromarray(picture).save(folder / f"{name.replace(' ', '_')}.png")


def main(runs: int = 20, seed: int = 0, label: str = "ball", pictures: Path | None = None) -> None:
    """Run many seeds and print what came of them.

    Args:
        runs: how many seeds.
        seed: the first of them.
        label: class of what is taken: ball, cracker box, mustard bottle, banana, drill, pitcher.
        pictures: folder for pictures of the first.
    """
    trials: list[PickTrial] = []
    for number in range(seed, seed + runs):
        trial = run_pick(number, label, camera=bool(pictures) and number == seed)
        trials.append(trial)
        print(
            f"seed {number}: {trial.failure or 'held'} ({trial.reason}), {trial.time_s:.1f} s, "
            f"arm on box {trial.arm_force:.1f} N, thing on box {trial.thing_force:.1f} N, "
            f"slip {trial.slip * 1e3:.2f} mm",
            flush=True,
        )
        if pictures:
            _save(trial, pictures)
    held = sum(trial.failure is None for trial in trials)
    worst = max((trial.arm_force for trial in trials if trial.failure is None), default=0.0)
    print(f"{held} of {runs} held; largest force of the arm on a box in these {worst:.1f} N")


if __name__ == "__main__":
    tyro.cli(main)
