"""Every topic and query of the system. No other file holds a key expression."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, TypeVar

from msgspec import Struct

from schemas.belief import MapBelief, OccupancyGrid
from schemas.errors import UserError
from schemas.fleet import Access, AccessRequest, ClockReading, ClockRequest, RunRequest
from schemas.health import Fault, Heartbeat, StatusRequest, SystemStatus, Tick
from schemas.language import Annotations, Answer, Behaviors, Instruction
from schemas.motion import ArmCommand, BaseCommand, DriverCheckpoint, GripperCommand, StopLatch
from schemas.perception import (
    Bodies,
    Detections,
    Fiducials,
    Focus,
    Inspection,
    SceneObservation,
)
from schemas.run import RunConfig
from schemas.sensing import JointState, LaserScan, Odometry, RgbdFrame, WristFrame
from schemas.task import (
    CancelRequest,
    Decision,
    Goal,
    GoalStatus,
    HandlingGoal,
    HandlingStatus,
    InstructionStatus,
)

# Python 3.11 has no `class Topic[T]` syntax yet.
T = TypeVar("T", bound=Struct)
Req = TypeVar("Req", bound=Struct)
Rep = TypeVar("Rep", bound=Struct)


class Qos(StrEnum):
    """The two classes of service, and no others."""

    NEVER_DROP = "never drop"
    """Queued at the reader; gaps in the sequence numbers are counted as losses."""
    LATEST_WINS = "latest wins"
    """A newer message replaces one that was not read yet."""


@dataclass(frozen=True)
class Topic(Generic[T]):
    """A typed stream of messages."""

    key: str
    """Last part of the full key `incognita/<realm>/<robot>/<key>`."""
    type: type[T]
    qos: Qos
    rate_hz: float
    """Usual rate; 0 for topics that follow events."""
    rank: int
    """Among messages due at the same time the lower rank is handled first."""
    keep_last: bool = False
    """Late joiners get the last message: the topic is state, not an event."""
    queue: int = 256
    """Messages a reader holds before it loses some (never drop only)."""

    def of(self, message: T) -> "Output":
        """Pair a message with its topic, for a handler to return."""
        return Output(self, message)


@dataclass(frozen=True)
class Output:
    """A message on its way out of a handler."""

    topic: Topic[Any]
    message: Struct


@dataclass(frozen=True)
class Query(Generic[Req, Rep]):
    """A typed question for a snapshot; queries never move anything."""

    key: str
    request: type[Req]
    reply: type[Rep]


Handler = Callable[[Any], Iterable[Output]]
Handlers = Mapping[Topic[Any], Handler]

_never, _latest = Qos.NEVER_DROP, Qos.LATEST_WINS

STOP = Topic("stop", StopLatch, _never, 0, rank=0, keep_last=True)
BASE_COMMAND = Topic("base/command", BaseCommand, _latest, 20, rank=1)
TICK = Topic("tick", Tick, _latest, 20, rank=2)
ODOMETRY = Topic("odometry", Odometry, _latest, 20, rank=3)
JOINT_STATE = Topic("joint_state", JointState, _latest, 20, rank=4)
SCAN = Topic("scan", LaserScan, _latest, 10, rank=5)
RGBD = Topic("camera/rgbd", RgbdFrame, _latest, 5, rank=6)
DRIVER_CHECKPOINT = Topic("driver/checkpoint", DriverCheckpoint, _latest, 5, rank=7, keep_last=True)
INSTRUCTION = Topic("instruction", Instruction, _never, 0, rank=10, keep_last=True)
CANCEL = Topic("cancel", CancelRequest, _never, 0, rank=11)
SCENE = Topic("scene", SceneObservation, _latest, 5, rank=8)
ANSWER = Topic("answer", Answer, _never, 0, rank=9)
ANNOTATIONS = Topic("annotations", Annotations, _never, 0, rank=12, keep_last=True)
DETECTIONS = Topic("detections", Detections, _latest, 5, rank=13)
BODIES = Topic("bodies", Bodies, _latest, 5, rank=22)
GRID = Topic("map/grid", OccupancyGrid, _latest, 2, rank=14, keep_last=True)
BELIEF = Topic("map/belief", MapBelief, _latest, 5, rank=15, keep_last=True)
BEHAVIORS = Topic("behaviors", Behaviors, _latest, 5, rank=16, keep_last=True)
DECISION = Topic("decision", Decision, _never, 0, rank=17, keep_last=True)
GOAL = Topic("goal", Goal, _never, 0, rank=18, keep_last=True)
GOAL_STATUS = Topic("goal/status", GoalStatus, _latest, 2, rank=19, keep_last=True)
INSTRUCTION_STATUS = Topic(
    "instruction/status", InstructionStatus, _never, 0, rank=20, keep_last=True
)
ARM_COMMAND = Topic("arm/command", ArmCommand, _latest, 20, rank=24)
GRIPPER_COMMAND = Topic("gripper/command", GripperCommand, _never, 0, rank=25)
WRIST_RGBD = Topic("wrist/rgbd", WristFrame, _latest, 5, rank=26)
HANDLING_GOAL = Topic("handling/goal", HandlingGoal, _never, 0, rank=27, keep_last=True)
HANDLING_STATUS = Topic("handling/status", HandlingStatus, _latest, 2, rank=28, keep_last=True)
WRIST_DETECTIONS = Topic("wrist/detections", Detections, _latest, 5, rank=33)
"""Of the wrist's camera: it tells what is there, and nothing of the ground that it did not see."""
WRIST_BODIES = Topic("wrist/bodies", Bodies, _latest, 5, rank=34)
INSPECTION = Topic("handling/inspection", Inspection, _never, 0, rank=35)
FIDUCIALS = Topic("fiducials", Fiducials, _latest, 5, rank=21)
FOCUS = Topic("focus", Focus, _latest, 5, rank=23)
HEARTBEAT = Topic("heartbeat", Heartbeat, _never, 5, rank=30)
FAULT = Topic("fault", Fault, _never, 0, rank=31)
SYSTEM_STATUS = Topic("status", SystemStatus, _latest, 1, rank=32, keep_last=True)

ALL_TOPICS: tuple[Topic[Any], ...] = (
    STOP,
    BASE_COMMAND,
    TICK,
    ODOMETRY,
    JOINT_STATE,
    SCAN,
    RGBD,
    DRIVER_CHECKPOINT,
    INSTRUCTION,
    SCENE,
    ANSWER,
    CANCEL,
    ANNOTATIONS,
    DETECTIONS,
    BODIES,
    FIDUCIALS,
    FOCUS,
    GRID,
    BELIEF,
    BEHAVIORS,
    DECISION,
    GOAL,
    GOAL_STATUS,
    INSTRUCTION_STATUS,
    ARM_COMMAND,
    GRIPPER_COMMAND,
    WRIST_RGBD,
    HANDLING_GOAL,
    HANDLING_STATUS,
    WRIST_DETECTIONS,
    WRIST_BODIES,
    INSPECTION,
    HEARTBEAT,
    FAULT,
    SYSTEM_STATUS,
)

STATUS = Query("query/status", StatusRequest, SystemStatus)
RUN = Query("query/run", RunRequest, RunConfig)
CLOCK = Query("query/clock", ClockRequest, ClockReading)
ACCESS = Query("query/access", AccessRequest, Access)

ALL_QUERIES: tuple[Query[Any, Any], ...] = (STATUS, RUN, CLOCK, ACCESS)


class UnknownTopicError(UserError):
    """No topic has that key; the message lists those that exist."""


def topic_named(key: str) -> Topic[Any]:
    """Look up a topic by its key.

    Raises:
        UnknownTopicError: the key is not in `ALL_TOPICS`.
    """
    for topic in ALL_TOPICS:
        if topic.key == key:
            return topic
    valid = ", ".join(topic.key for topic in ALL_TOPICS)
    raise UnknownTopicError(f"unknown topic {key!r}; topics are: {valid}")


LAST, READY = "last", "ready"
"""First parts of the keys below which last values are asked for, and services say they are there.

Both are followed by a name: `last/<topic>`, `ready/<service>`.
"""
ANY_ROBOT = "*"
"""For asking the hub of a realm which robot it is for."""


def full_key(realm: str, robot: str, key: str) -> str:
    """Key on the wire; the realm isolates parallel runs."""
    return f"incognita/{realm}/{robot}/{key}"
