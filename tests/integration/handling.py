"""The arm's process with a simulated robot before a box, in lockstep; nothing else runs."""

from collections.abc import Callable

import numpy as np

from robots.husky_ur5.spec import HUSKY_UR5
from schemas import topics
from schemas.codec import decode
from schemas.geometry import Pose3
from schemas.motion import StopLatch
from schemas.perception import Inspection
from schemas.run import RunConfig
from schemas.task import Handling, HandlingGoal, HandlingStatus, TaskState
from services.manipulation.node import ManipulationNode
from services.process_table import process_named
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from services.runtime.node import node_generator
from sim.driver import SapienDriver
from sim.experiments.assembly import row_of
from sim.experiments.body_model import BodySettings, ModelledBodies
from sim.experiments.box_pick import BOX, THING, box_world
from sim.experiments.true_bodies import true_body
from sim.node import RobotNode
from sim.touch import forces

SECOND_NS = 1_000_000_000
RUN = RunConfig(robot="husky_ur5", world="box_pick")


class Stage:
    """A robot before a box with a ball in it.

    Args:
        seed: of the world.
        label: class of what lies in the box.
    """

    def __init__(self, seed: int = 1, label: str = "ball") -> None:
        self.world = box_world(seed, label)
        self.driver = SapienDriver(HUSKY_UR5, self.world, seed, camera=False)
        self.eyes = ModelledBodies(
            self.world, self.driver, HUSKY_UR5, BodySettings(), np.random.default_rng(seed)
        )
        nodes = {
            "robot": RobotNode(RUN, node_generator(RUN, "robot"), self.driver),
            "perception": self.eyes,
            "manipulation": ManipulationNode(RUN, node_generator(RUN, "manipulation")),
        }
        self.statuses: list[HandlingStatus] = []
        self.inspections: list[Inspection] = []
        self.force = 0.0
        self._goals = 0
        self._lockstep = Lockstep(
            {row_of(process_named(name), node): node for name, node in nodes.items()},
            on_message=self._note,
        )
        self.wait(0.5)

    def _note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        del publisher, stamp_ns
        if sample.topic is topics.HANDLING_STATUS:
            self.statuses.append(decode(sample.payload, HandlingStatus))
        elif sample.topic is topics.INSPECTION:
            self.inspections.append(decode(sample.payload, Inspection))
        elif sample.topic is topics.ODOMETRY:
            arm = HUSKY_UR5.arm
            pressed = forces(self.driver.scene, (*arm.joints, *arm.fingers), BOX)
            self.force = max(self.force, pressed)

    def do(
        self,
        action: Handling,
        thing: str = THING,
        until: Callable[[], bool] | None = None,
        at: Pose3 | None = None,
        seconds: float = 60.0,
    ) -> HandlingStatus:
        """Ask for something and wait for its end, or for something else to happen."""
        body = true_body(self.world.find(thing))
        self._goals += 1
        goal = HandlingGoal(
            stamp_ns=self._lockstep.now_ns,
            id=f"goal {self._goals}",
            instruction_id="test",
            action=action,
            label=body.label,
            map_from_thing=at or body.world_from_box,
            size=tuple(body.size.tolist()),
        )
        self._lockstep.send(topics.HANDLING_GOAL.of(goal))
        limit_ns = self._lockstep.now_ns + round(seconds * SECOND_NS)
        self._lockstep.run(limit_ns, until or (lambda: self._has_ended(goal.id)))
        return self.statuses[-1]

    def wait_for_end(self, seconds: float = 30.0) -> HandlingStatus:
        """Wait for the end of the goal that is being worked on."""
        limit_ns = self._lockstep.now_ns + round(seconds * SECOND_NS)
        self._lockstep.run(limit_ns, lambda: self._has_ended(f"goal {self._goals}"))
        return self.statuses[-1]

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self._lockstep.run(self._lockstep.now_ns + round(seconds * SECOND_NS))

    def stop(self, stopped: bool) -> None:
        """Latch the stop, or release it."""
        latch = StopLatch(stamp_ns=self._lockstep.now_ns, stopped=stopped, source="test")
        self._lockstep.send(topics.STOP.of(latch))

    def doing(self, words: str) -> Callable[[], bool]:
        """Whether the arm says that it does something."""
        return lambda: bool(self.statuses) and words in self.statuses[-1].reason

    @property
    def now_s(self) -> float:
        """Simulated time [s]."""
        return self._lockstep.now_ns / SECOND_NS

    @property
    def height(self) -> float:
        """Of the thing above the ground [m]."""
        return self.driver.loose.poses[THING].position[2]

    def _has_ended(self, goal_id: str) -> bool:
        return any(
            one.goal_id == goal_id and one.state is not TaskState.ACTIVE for one in self.statuses
        )

    def close(self) -> None:
        """Let the simulator go."""
        self._lockstep.close()
