"""Messages to bytes and back: one encoder, one typed decoder per type.

Arrays travel as a msgpack extension: type code, number of dimensions, sizes, raw little-endian
elements. They come back as read-only views into the received bytes, without a copy.
"""

import math
import struct
from functools import cache
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Shape, type_codes

T = TypeVar("T", bound=msgspec.Struct)

_array_extension = 1
_codes = {dtype: code for code, dtype in type_codes.items()}


class MalformedMessageError(ValueError):
    """Bytes that are not the message they should be; the text says where and why."""


def encode(message: msgspec.Struct) -> bytes:
    """Bytes of a message.

    Raises:
        TypeError: an array has an element type outside `schemas.arrays.type_codes`.
    """
    return _encoder.encode(message)


def decode(data: bytes, message_type: type[T]) -> T:
    """Message of the given type; arrays are read-only views into `data`.

    Raises:
        MalformedMessageError: wrong type, shape, truncated, or a time that is not an int64.
    """
    try:
        message: T = _decoder(message_type).decode(data)
    except (msgspec.DecodeError, ValueError, struct.error, OverflowError, RecursionError) as error:
        raise MalformedMessageError(f"{message_type.__name__}: {error}") from error
    _check_shapes(message)
    return message


def as_builtins(message: msgspec.Struct) -> Any:
    """The message as plain dicts and lists, for JSON output."""
    return msgspec.to_builtins(message, enc_hook=_array_as_lists)


def pack_array(array: NDArray[Any]) -> bytes:
    """Header and raw elements of an array."""
    code = _codes.get(array.dtype.newbyteorder("<"))
    if code is None:
        allowed = ", ".join(str(dtype) for dtype in _codes)
        raise TypeError(f"arrays of {array.dtype} cannot be sent; allowed: {allowed}")
    header = struct.pack(f"<BB{array.ndim}I", code, array.ndim, *array.shape)
    return header + np.ascontiguousarray(array, type_codes[code]).tobytes()


def unpack_array(data: memoryview) -> NDArray[Any]:
    """Read-only view of a packed array.

    Raises:
        ValueError: unknown element type, or the sizes do not match the bytes.
    """
    code, dimensions = struct.unpack_from("<BB", data)
    dtype = type_codes.get(code)
    if dtype is None:
        raise ValueError(f"unknown array element type {code}; known: {sorted(type_codes)}")
    shape = struct.unpack_from(f"<{dimensions}I", data, 2)
    body = data[2 + 4 * dimensions :]
    if len(body) != dtype.itemsize * math.prod(shape):
        raise ValueError(f"array of shape {shape} {dtype} does not fit {len(body)} bytes")
    return np.frombuffer(body, dtype).reshape(shape)


def _encode_hook(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return msgspec.msgpack.Ext(_array_extension, pack_array(value))
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} cannot be sent")


def _extension_hook(code: int, data: memoryview) -> Any:
    if code != _array_extension:
        raise ValueError(f"unknown extension {code}")
    return unpack_array(data)


def _decode_hook(expected: Any, value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        raise ValueError(f"expected an array, got {type(value).__name__}")
    dtype = np.dtype(get_args(get_args(expected)[1])[0])
    if value.dtype != dtype:
        raise ValueError(f"expected an array of {dtype}, got {value.dtype}")
    return value


def _array_as_lists(value: Any) -> Any:
    return value.tolist()


_encoder = msgspec.msgpack.Encoder(enc_hook=_encode_hook)


@cache
def _decoder(message_type: type[msgspec.Struct]) -> msgspec.msgpack.Decoder[Any]:
    return msgspec.msgpack.Decoder(message_type, ext_hook=_extension_hook, dec_hook=_decode_hook)


@cache
def _shapes(message_type: type[msgspec.Struct]) -> tuple[tuple[str, Shape], ...]:
    hints = get_type_hints(message_type, include_extras=True)
    return tuple(
        (name, extra)
        for name, hint in hints.items()
        if get_origin(hint) is Annotated
        for extra in get_args(hint)[1:]
        if isinstance(extra, Shape)
    )


def _check_shapes(message: msgspec.Struct) -> None:
    sizes: dict[str, int] = {}
    for name, shape in _shapes(type(message)):
        problem = shape.mismatch(getattr(message, name).shape, sizes)
        if problem:
            raise MalformedMessageError(f"{type(message).__name__}.{name}: {problem}")
