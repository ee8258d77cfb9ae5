"""JSON Schema of messages, for readers of a log that do not know them."""

from typing import Any

import msgspec
import numpy as np


def json_schema(message_type: type[msgspec.Struct]) -> dict[str, Any]:
    """JSON Schema of a message as `schemas.codec.as_builtins` shows it."""
    (reference,), definitions = msgspec.json.schema_components(
        [message_type], schema_hook=_array_schema, ref_template="#/$defs/{name}"
    )
    name = reference["$ref"].rsplit("/", 1)[1]
    root = definitions.pop(name)
    return {**root, "$defs": definitions} if definitions else root


def _array_schema(kind: type) -> dict[str, Any]:
    if getattr(kind, "__origin__", kind) is np.ndarray:
        return {"type": "array", "description": "type code, dimensions, sizes, raw elements"}
    raise NotImplementedError(f"no JSON schema for {kind}")
