"""The process graph as text, read off the nodes' own handler tables by their source.

A node's inputs are the keys of `handlers()`, its outputs the topics it calls `.of` on. Reading the
source keeps the picture true without starting a robot to draw it.
"""

import ast
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from schemas import topics
from schemas.topics import Topic
from services.process_table import Process

_all = {name: value for name, value in vars(topics).items() if isinstance(value, Topic)}


def mermaid(processes: Iterable[Process]) -> str:
    """A Mermaid flow chart: processes as boxes, topics as arrows between them."""
    ends = {process.name: inputs_and_outputs(process.node) for process in processes}
    lines = ["graph LR"]
    lines += [f'  {p.name}["{p.name}<br/>{p.purpose}"]' for p in processes]
    for source, (_, outputs) in ends.items():
        for target, (inputs, _) in ends.items():
            shared = sorted(_all[name].key for name in outputs & inputs if name != "TICK")
            if shared and source != target:
                lines.append(f"  {source} -->|{'<br/>'.join(shared)}| {target}")
    return "\n".join(lines)


def inputs_and_outputs(node: str) -> tuple[set[str], set[str]]:
    """Names in `schemas.topics` that a node handles, and that it publishes."""
    module, _ = node.split(":")
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(f"{module} of the process table does not exist")
    tree = ast.parse(Path(spec.origin).read_text())
    outputs = {
        name
        for part in ast.walk(tree)
        if isinstance(part, ast.Attribute) and part.attr == "of"
        for name in [_topic_name(part.value)]
        if name
    }
    inputs = {
        name
        for part in ast.walk(tree)
        if isinstance(part, ast.Dict)
        for key in part.keys
        if key is not None and (name := _topic_name(key))
    }
    return inputs, outputs


def _topic_name(node: ast.expr) -> str | None:
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", None)
    return name if name in _all else None
