"""What an ONNX file says of itself: inputs, outputs, operators and the exporter's notes.

OpenCV runs such files and tells none of this. An ONNX file is a protocol buffer: a message is a
row of fields, each with a number and a value that is an integer or a piece of bytes, which may be
a message again. Walking it needs no package. Weights are skipped over, so large files are quick.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from services.perception.errors import DetectorFileError

Field = tuple[int, int | memoryview]
"""Its number and its value."""

_VARINT, _EIGHT_BYTES, _PIECE, _FOUR_BYTES = 0, 1, 2, 5


@dataclass(frozen=True)
class Port:
    """An input or output of the network."""

    name: str
    shape: tuple[int | None, ...]
    """None where the size is decided when the network is run."""

    def __str__(self) -> str:
        sizes = ", ".join("?" if size is None else str(size) for size in self.shape)
        return f"{self.name} ({sizes})"


@dataclass(frozen=True)
class OnnxFile:
    """The outside of a network, and what its exporter noted."""

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    metadata: dict[str, str]
    operators: frozenset[str]
    premature: str
    """A value that is used before it is made, which OpenCV cannot load; "" if there is none."""


def read_onnx_file(path: Path) -> OnnxFile:
    """Read what a file says of itself.

    Raises:
        DetectorFileError: there is no such file, or it is cut short, or no ONNX file at all.
    """
    try:
        data = memoryview(path.read_bytes())
    except OSError as error:
        raise DetectorFileError(f"cannot read {path}: {error.strerror}") from error
    try:
        model = list(_fields(data))
        graphs = [_piece(value) for number, value in model if number == 7]
        if len(graphs) != 1:
            raise ValueError("there is no graph in it")
        metadata = dict(_entry(_piece(value)) for number, value in model if number == 14)
        return _described(list(_fields(graphs[0])), metadata)
    except ValueError as error:
        raise DetectorFileError(
            f"{path} ({len(data)} bytes) is not a whole ONNX file: {error}"
        ) from error


def _described(graph: list[Field], metadata: dict[str, str]) -> OnnxFile:
    nodes = [_node(_piece(value)) for number, value in graph if number == 1]
    stored = {_text(_piece(value), 8) for number, value in graph if number == 5}
    inputs = [_port(_piece(value)) for number, value in graph if number == 11]
    return OnnxFile(
        # Old exporters list the weights among the inputs.
        inputs=tuple(port for port in inputs if port.name not in stored),
        outputs=tuple(_port(_piece(value)) for number, value in graph if number == 12),
        metadata=metadata,
        operators=frozenset(node.operator for node in nodes),
        premature=_premature(nodes, stored | {port.name for port in inputs}),
    )


@dataclass(frozen=True)
class _Node:
    operator: str
    uses: tuple[str, ...]
    makes: tuple[str, ...]


def _node(data: memoryview) -> _Node:
    fields = list(_fields(data))
    uses = tuple(_decoded(value) for number, value in fields if number == 1)
    # An output that nobody wants has no name.
    makes = tuple(_decoded(value) for number, value in fields if number == 2 and value)
    return _Node(_text(data, 4), uses, makes)


def _premature(nodes: list[_Node], made: set[str]) -> str:
    late = {name for node in nodes for name in node.makes}
    for node in nodes:
        for name in node.uses:
            # Names from elsewhere belong to the graph around a loop or a branch.
            if name in late and name not in made:
                return name
        made.update(node.makes)
    return ""


def _port(data: memoryview) -> Port:
    """ValueInfo: name 1, type 2 > tensor 1 > shape 2 > dimensions 1 > value 1 or name 2."""
    tensor = _inner(_inner(data, 2), 1)
    shape = _inner(tensor, 2)
    sizes = [_size(_piece(value)) for number, value in _fields(shape) if number == 1]
    return Port(_text(data, 1), tuple(sizes))


def _size(data: memoryview) -> int | None:
    values = [value for number, value in _fields(data) if number == 1]
    return values[0] if values and isinstance(values[0], int) and values[0] > 0 else None


def _entry(data: memoryview) -> tuple[str, str]:
    return _text(data, 1), _text(data, 2)


def _text(data: memoryview, wanted: int) -> str:
    return next((_decoded(value) for number, value in _fields(data) if number == wanted), "")


def _inner(data: memoryview, wanted: int) -> memoryview:
    pieces = (_piece(value) for number, value in _fields(data) if number == wanted)
    return next(pieces, memoryview(b""))


def _decoded(value: int | memoryview) -> str:
    return str(_piece(value), "utf-8")


def _piece(value: int | memoryview) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number stands where a message should")
    return value


def _fields(data: memoryview) -> Iterator[Field]:
    """All fields of a message, in the order of the file."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        if kind == _VARINT:
            value, at = _varint(data, at)
            yield number, value
            continue
        size, at = _length(data, at, kind)
        if at + size > len(data):
            raise ValueError(f"it ends {at + size - len(data)} bytes too soon")
        yield number, data[at : at + size]
        at += size


def _length(data: memoryview, at: int, kind: int) -> tuple[int, int]:
    """Bytes of a value that is not a varint, and where they begin."""
    if kind == _PIECE:
        return _varint(data, at)
    sizes = {_EIGHT_BYTES: 8, _FOUR_BYTES: 4}
    if kind not in sizes:
        raise ValueError("it is no protocol buffer")
    return sizes[kind], at


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Seven bits a byte, lowest first, the eighth says that more follow."""
    value = shift = 0
    while at < len(data) and shift < 70:
        byte = data[at]
        value, at, shift = value | (byte & 127) << shift, at + 1, shift + 7
        if byte < 128:
            return value, at
    raise ValueError("it ends within a number")
