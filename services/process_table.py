"""Every process of the system. Adding a service is adding a row.

The row says what a process listens to and publishes, and the executors hold it to that: a node
whose handlers differ is not started. So the drawn graph and the access rules are read from here.
"""

from dataclasses import dataclass
from typing import Any

from robots.catalogue import get_robot
from schemas import topics
from schemas.errors import UserError
from schemas.run import RunConfig
from schemas.topics import Topic

Topics = tuple[Topic[Any], ...]


@dataclass(frozen=True)
class Process:
    """One row: what the supervisor, the CLI, lockstep and the drawn graph need to know."""

    name: str
    node: str
    """`module:Class` of the node."""
    latency_ms: float
    """Time one message takes, modelled in lockstep; measured on two shared cores [ms]."""
    listens: Topics = ()
    publishes: Topics = ()
    tick_hz: float = 0.0
    """How often the node gets a `Tick`; 0 for nodes that only answer messages."""
    lockstep: bool = True
    """Whether the process takes part where no person watches."""
    needs_places: bool = False
    """Whether the process only runs for robots that have words for places."""
    needs_arm: bool = False
    """Whether the process only runs for robots with an arm."""
    guest: bool = False
    """Whether the process is started by hand beside a run. It says nothing to the others, not even
    that it lives, so that who only looks needs no right to speak."""
    purpose: str = ""

    def takes_part(self, run: RunConfig) -> bool:
        """Whether the process belongs to a run.

        Raises:
            UnknownRobotError: the run names no robot that there is.
        """
        if self.guest:
            return False
        if self.name in ("camera", "robot"):
            # Pictures from outside have no robot that drives through them.
            return bool(run.camera) == (self.name == "camera")
        robot = get_robot(run.robot)
        places = not self.needs_places or bool(robot.symbols.locations)
        return places and (not self.needs_arm or robot.arm is not None)


_shown: Topics = (
    topics.STOP,
    topics.TICK,
    topics.ODOMETRY,
    topics.JOINT_STATE,
    topics.SCAN,
    topics.RGBD,
    topics.INSTRUCTION,
    topics.ANSWER,
    topics.ANNOTATIONS,
    topics.DETECTIONS,
    topics.FOCUS,
    topics.GRID,
    topics.BELIEF,
    topics.DECISION,
    topics.GOAL,
    topics.GOAL_STATUS,
    topics.INSTRUCTION_STATUS,
    topics.FAULT,
    topics.SYSTEM_STATUS,
)
"""What the page shows."""

PROCESSES: tuple[Process, ...] = (
    Process(
        name="robot",
        node="sim.node:RobotNode",
        latency_ms=0.0,
        listens=(
            topics.STOP,
            topics.BASE_COMMAND,
            topics.ARM_COMMAND,
            topics.GRIPPER_COMMAND,
            topics.TICK,
        ),
        publishes=(
            topics.ODOMETRY,
            topics.JOINT_STATE,
            topics.SCAN,
            topics.RGBD,
            topics.WRIST_RGBD,
            topics.DRIVER_CHECKPOINT,
        ),
        tick_hz=20.0,
        purpose="moves base and arm and reads the sensors",
    ),
    Process(
        name="perception",
        node="services.perception.node:PerceptionNode",
        latency_ms=40.0,
        listens=(
            topics.RGBD,
            topics.ANNOTATIONS,
            topics.INSTRUCTION_STATUS,
            topics.WRIST_RGBD,
            topics.HANDLING_STATUS,
        ),
        publishes=(
            topics.DETECTIONS,
            topics.BODIES,
            topics.FOCUS,
            topics.SCENE,
            topics.WRIST_DETECTIONS,
            topics.WRIST_BODIES,
            topics.FAULT,
        ),
        purpose="finds objects and kinds of places in camera pictures",
    ),
    Process(
        name="camera",
        node="services.perception.camera_node:CameraNode",
        latency_ms=0.0,
        listens=(topics.TICK,),
        publishes=(topics.RGBD, topics.FAULT),
        tick_hz=30.0,
        lockstep=False,
        purpose="reads pictures of a real camera or from files, in place of the robot",
    ),
    Process(
        name="scenes",
        node="services.perception.scenes_node:ScenesNode",
        latency_ms=30.0,
        listens=(topics.RGBD,),
        publishes=(topics.SCENE, topics.FIDUCIALS),
        needs_places=True,
        purpose="recognises kinds of places by their looks and by tags",
    ),
    Process(
        name="grounding",
        node="services.grounding.node:GroundingNode",
        latency_ms=15.0,
        listens=(
            topics.INSTRUCTION,
            topics.ANSWER,
            topics.BELIEF,
            topics.INSTRUCTION_STATUS,
        ),
        publishes=(topics.ANNOTATIONS, topics.BEHAVIORS),
        purpose="turns sentences into annotations and behaviours",
    ),
    Process(
        name="mapping",
        node="services.mapping.node:MappingNode",
        latency_ms=20.0,
        listens=(
            topics.ODOMETRY,
            topics.SCAN,
            topics.SCENE,
            topics.ANNOTATIONS,
            topics.DETECTIONS,
            topics.WRIST_DETECTIONS,
            topics.INSPECTION,
        ),
        publishes=(topics.GRID, topics.BELIEF, topics.FAULT),
        purpose="keeps the distribution over maps",
    ),
    Process(
        name="policy",
        node="services.policy.node:PolicyNode",
        latency_ms=15.0,
        listens=(
            topics.STOP,
            topics.ODOMETRY,
            topics.CANCEL,
            topics.ANNOTATIONS,
            topics.GRID,
            topics.BELIEF,
            topics.BEHAVIORS,
            topics.GOAL_STATUS,
            topics.HANDLING_STATUS,
        ),
        publishes=(
            topics.DECISION,
            topics.GOAL,
            topics.HANDLING_GOAL,
            topics.INSTRUCTION_STATUS,
        ),
        purpose="chooses where to go, what to handle, and when to stop",
    ),
    Process(
        name="navigation",
        node="services.navigation.node:NavigationNode",
        latency_ms=5.0,
        listens=(
            topics.STOP,
            topics.ODOMETRY,
            topics.SCAN,
            topics.GRID,
            topics.BELIEF,
            topics.GOAL,
        ),
        publishes=(topics.BASE_COMMAND, topics.GOAL_STATUS),
        purpose="plans a path to the goal and follows it",
    ),
    Process(
        name="manipulation",
        node="services.manipulation.node:ManipulationNode",
        # Of all messages but those after which it plans: that time the node itself lets pass.
        latency_ms=5.0,
        listens=(
            topics.STOP,
            topics.ODOMETRY,
            topics.JOINT_STATE,
            topics.DETECTIONS,
            topics.BODIES,
            topics.BELIEF,
            topics.HANDLING_GOAL,
            topics.WRIST_DETECTIONS,
            topics.WRIST_BODIES,
        ),
        publishes=(
            topics.ARM_COMMAND,
            topics.GRIPPER_COMMAND,
            topics.HANDLING_STATUS,
            topics.INSPECTION,
        ),
        needs_arm=True,
        purpose="looks into boxes, takes things and puts them down",
    ),
    Process(
        name="recorder",
        node="services.recorder.node:RecorderNode",
        latency_ms=0.0,
        listens=topics.ALL_TOPICS,
        publishes=(topics.FAULT,),
        lockstep=False,
        purpose="writes every message to the log",
    ),
    Process(
        name="web",
        node="web.node:WebNode",
        latency_ms=0.0,
        listens=_shown,
        publishes=(topics.INSTRUCTION, topics.ANSWER, topics.STOP, topics.CANCEL),
        tick_hz=10.0,
        lockstep=False,
        purpose="shows the belief and takes instructions",
    ),
    Process(
        name="viewer",
        node="web.node:WebNode",
        latency_ms=0.0,
        listens=_shown,
        tick_hz=10.0,
        lockstep=False,
        guest=True,
        purpose="shows the belief to who may not instruct",
    ),
)


class UnknownServiceError(UserError):
    """No process has that name; the message lists those that exist."""


def process_named(name: str) -> Process:
    """Look up a process.

    Raises:
        UnknownServiceError: the name is not in `PROCESSES`.
    """
    for process in PROCESSES:
        if process.name == name:
            return process
    valid = ", ".join(process.name for process in PROCESSES)
    raise UnknownServiceError(f"unknown service {name!r}; services are: {valid}")


def mermaid(processes: tuple[Process, ...] = PROCESSES) -> str:
    """A Mermaid flow chart: processes as boxes, topics as arrows between them."""
    lines = ["graph LR"]
    lines += [f'  {p.name}["{p.name}<br/>{p.purpose}"]' for p in processes]
    for source in processes:
        for target in processes:
            shared = [topic.key for topic in source.publishes if topic in target.listens]
            if shared and source is not target:
                lines.append(f"  {source.name} -->|{'<br/>'.join(shared)}| {target.name}")
    return "\n".join(lines)
