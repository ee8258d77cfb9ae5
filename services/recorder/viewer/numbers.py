"""Numbers over time, for plots: small protobuf messages that are made from a table."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from google.protobuf import descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.message import Message
from msgspec import Struct

from schemas.belief import MapBelief
from schemas.health import Heartbeat
from schemas.motion import BaseCommand
from schemas.sensing import Odometry
from schemas.task import Decision
from services.recorder.viewer.parts import time_of
from services.recorder.viewer.scene import seen_rows

Figures = Mapping[str, Callable[[Any], float | str]]


def _least_cost(decision: Decision) -> float:
    return float(decision.costs.min()) if len(decision.costs) else 0.0


_motion: Figures = {
    "linear": lambda odometry: odometry.linear,
    "angular": lambda odometry: odometry.angular,
}
_belief: Figures = {
    "effective_particles": lambda belief: belief.effective_particles,
    "heaviest": lambda belief: float(np.max(belief.weights, initial=0.0)),
    "seen": lambda belief: float(len(seen_rows(belief))),
}
_decision: Figures = {
    "confirmed": lambda decision: decision.confirmed,
    "candidates": lambda decision: float(len(decision.kinds)),
    "least_cost": _least_cost,
}
_health: Figures = {
    "node": lambda beat: beat.node,
    "busy": lambda beat: beat.busy,
    "handler_ms": lambda beat: beat.handler_ms,
    "lost": lambda beat: beat.lost,
    "replaced": lambda beat: beat.replaced,
    "malformed": lambda beat: beat.malformed,
}
_texts = {"node"}
"""Fields that are no numbers: what a plot chooses by."""
_tables: dict[str, tuple[type[Struct], Figures]] = {
    "Motion": (Odometry, _motion),
    "Command": (BaseCommand, _motion),
    "Belief": (MapBelief, _belief),
    "Decision": (Decision, _decision),
    "Health": (Heartbeat, _health),
}
"""Of each protobuf message: what it is made of, and how each number comes out of that."""
FIELDS: dict[str, tuple[str, ...]] = {name: tuple(of) for name, (_, of) in _tables.items()}


_package = "incognita.numbers"
_double, _text = FieldDescriptorProto.TYPE_DOUBLE, FieldDescriptorProto.TYPE_STRING


def _file() -> FileDescriptorProto:
    file = FileDescriptorProto(
        name="incognita/numbers.proto",
        package=_package,
        syntax="proto3",
        dependency=[timestamp_pb2.DESCRIPTOR.name],
    )
    for name, (_, figures) in _tables.items():
        kind = file.message_type.add(name=name)
        kind.field.add(
            name="timestamp",
            number=1,
            type=FieldDescriptorProto.TYPE_MESSAGE,
            type_name=f".{timestamp_pb2.Timestamp.DESCRIPTOR.full_name}",
            label=FieldDescriptorProto.LABEL_OPTIONAL,
        )
        for number, field in enumerate(figures, start=2):
            kind.field.add(
                name=field,
                number=number,
                type=_text if field in _texts else _double,
                label=FieldDescriptorProto.LABEL_OPTIONAL,
            )
    return file


_pool = descriptor_pool.Default()
_pool.Add(_file())  # type: ignore[no-untyped-call]
_classes: dict[str, type[Message]] = {
    name: message_factory.GetMessageClass(_pool.FindMessageTypeByName(f"{_package}.{name}"))
    for name in _tables
}


def numbers(name: str) -> Callable[[Any], Message]:
    """What makes the protobuf message of a name out of its source."""
    make, (_, figures) = _classes[name], _tables[name]

    def show(message: Any) -> Message:
        values = {field: read(message) for field, read in figures.items()}
        return make(timestamp=time_of(message.stamp_ns), **values)

    return show
