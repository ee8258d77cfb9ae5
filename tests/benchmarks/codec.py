"""Messages to bytes and back, beside the same content as nested objects and as JSON."""

import json
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, NamedTuple

import msgspec
import numpy as np
from msgspec import Struct

from schemas.belief import MapBelief
from schemas.codec import as_builtins, decode, encode
from schemas.geometry import Pose2, Pose3
from schemas.motion import BaseCommand
from schemas.sensing import Intrinsics, Odometry, RgbdFrame
from tests.benchmarks.rows import Row, compared
from tests.benchmarks.timing import interleaved

OBJECTS = f"msgspec {version('msgspec')} of nested objects"
JSON = "json"

_particles, _objects_each = 100, 10
_drift = 3.0


class FrameTree(Struct, frozen=True, kw_only=True):
    """An `RgbdFrame` without arrays."""

    stamp_ns: int
    color: list[list[tuple[int, int, int]]]
    depth_mm: list[list[int]]
    intrinsics: Intrinsics
    base_from_camera: Pose3
    odom_from_base: Pose2


class ObjectTree(Struct, frozen=True, kw_only=True):
    """One object of one hypothesis."""

    node: int
    class_name: str
    class_probability: float
    position: tuple[float, float]
    covariance: tuple[tuple[float, float], tuple[float, float]]
    extent: tuple[float, float, float]
    existence: float


class ParticleTree(Struct, frozen=True, kw_only=True):
    """One hypothesis."""

    weight: float
    figure: int
    landmark: int
    objects: list[ObjectTree]


class BeliefTree(Struct, frozen=True, kw_only=True):
    """A `MapBelief` as objects in hypotheses instead of columns."""

    stamp_ns: int
    instruction_id: str
    particles: list[ParticleTree]
    viewer: Pose2
    map_from_odom: Pose2
    map_from_base: Pose2
    trajectory: list[tuple[float, float, float]]
    effective_particles: float


class Rival(NamedTuple):
    """One way to write a message, and to read what was written."""

    name: str
    write: Callable[[], bytes]
    read: Callable[[bytes], object]


def picture() -> RgbdFrame:
    rng = np.random.default_rng(0)
    return RgbdFrame(
        stamp_ns=1,
        color=rng.integers(0, 255, (240, 320, 3), np.uint8),
        depth_mm=rng.integers(0, 9000, (240, 320), np.uint16),
        intrinsics=Intrinsics(320, 240, 233.0, 233.0, 159.5, 119.5),
        base_from_camera=Pose3((0.2, 0.0, 0.9), (0.5, -0.5, 0.5, -0.5)),
        odom_from_base=Pose2(1.0, 2.0, 0.3),
    )


def belief() -> MapBelief:
    rng = np.random.default_rng(0)
    rows = _particles * _objects_each
    return MapBelief(
        stamp_ns=1,
        instruction_id="cli-1",
        classes=("cone", "hydrant", "barrel"),
        weights=np.full(_particles, 1 / _particles),
        particle=np.repeat(np.arange(_particles, dtype=np.int32), _objects_each),
        node=np.arange(rows, dtype=np.int32),
        class_index=rng.integers(0, 3, rows).astype(np.int32),
        class_probability=rng.uniform(size=rows),
        position=rng.uniform(-9, 9, (rows, 2)),
        covariance=rng.uniform(size=(rows, 2, 2)),
        extent=rng.uniform(size=(rows, 3)),
        existence=rng.uniform(size=rows),
        figure=np.zeros(_particles, np.int32),
        landmark=np.ones(_particles, np.int32),
        figure_class=np.zeros(_particles, np.int32),
        landmark_class=np.ones(_particles, np.int32),
        topology=np.zeros(_particles, np.int32),
        node_regions=np.zeros((0, 50), np.int32),
        region_edges=np.zeros((0, 3), np.int32),
        viewer=Pose2(0.0, 0.0, 0.0),
        map_from_odom=Pose2(0.1, 0.0, 0.0),
        map_from_base=Pose2(1.0, 2.0, 0.3),
        trajectory=rng.uniform(size=(50, 3)),
        effective_particles=80.0,
    )


def odometry() -> Odometry:
    return Odometry(
        stamp_ns=1,
        odom_from_base=Pose2(1.0, 2.0, 0.3),
        linear=0.5,
        angular=0.1,
        variance_per_metre=1e-3,
        variance_per_radian=1e-3,
    )


def command() -> BaseCommand:
    return BaseCommand(stamp_ns=1, linear=0.5, angular=0.1, valid_ms=200)


def measure(rounds: int) -> list[Row]:
    frame, maps = picture(), belief()
    frame_tree = msgspec.convert(as_builtins(frame), FrameTree)
    return [
        *_rows("RgbdFrame 320x240", frame, [_objects(frame_tree), _json(frame)], rounds),
        *_rows("MapBelief 100x10", maps, [_objects(belief_tree(maps)), _json(maps)], rounds),
        *_rows("Odometry", odometry(), [_json(odometry())], rounds),
        *_rows("BaseCommand", command(), [_json(command())], rounds),
    ]


def belief_tree(maps: MapBelief) -> BeliefTree:
    """The same belief as nested objects."""
    content: dict[str, Any] = as_builtins(maps)
    rows = [_object(content, row) for row in range(len(maps.node))]
    content["particles"] = [
        {
            "weight": content["weights"][particle],
            "figure": content["figure"][particle],
            "landmark": content["landmark"][particle],
            "objects": rows[particle * _objects_each : (particle + 1) * _objects_each],
        }
        for particle in range(_particles)
    ]
    return msgspec.convert(content, BeliefTree)


def _object(content: dict[str, Any], row: int) -> dict[str, Any]:
    columns = ("node", "class_probability", "position", "covariance", "extent", "existence")
    class_name = content["classes"][content["class_index"][row]]
    return {"class_name": class_name, **{name: content[name][row] for name in columns}}


def _ours(message: Struct) -> Rival:
    kind: type[Struct] = type(message)

    def read(data: bytes) -> object:
        return decode(data, kind)

    return Rival("ours", lambda: encode(message), read)


def _objects(tree: Struct) -> Rival:
    encoder, decoder = msgspec.msgpack.Encoder(), msgspec.msgpack.Decoder(type(tree))
    return Rival(OBJECTS, lambda: encoder.encode(tree), decoder.decode)


def _json(message: Struct) -> Rival:
    tree: Any = as_builtins(message)
    return Rival(JSON, lambda: json.dumps(tree).encode(), json.loads)


def _rows(name: str, message: Struct, rivals: list[Rival], rounds: int) -> list[Row]:
    ours = _ours(message)
    written = {each.name: each.write() for each in (ours, *rivals)}
    works = {
        "encode": {each.name: each.write for each in (ours, *rivals)},
        "decode": {
            each.name: lambda each=each: each.read(written[each.name]) for each in (ours, *rivals)
        },
    }
    spent = {work: interleaved(calls, rounds) for work, calls in works.items()}
    return [
        compared(
            f"codec {name}",
            work,
            "us",
            1e6 * spent[work][ours.name],
            (rival.name, 1e6 * spent[work][rival.name]),
            drift=_drift,
        )
        for work in works
        for rival in rivals
    ]
