"""House rules as tests: each failure says why the rule is there."""

import ast
import re
from pathlib import Path

import pytest

from schemas.topics import ALL_TOPICS

root = Path(__file__).parents[2]
packages = ("schemas", "robots", "services", "sim", "web")
modules = sorted(path for package in packages for path in (root / package).rglob("*.py"))
nodes = [path for path in modules if path.name == "node.py"]


def relative(path: Path) -> str:
    return str(path.relative_to(root))


@pytest.mark.parametrize("path", modules, ids=relative)
def test_no_module_is_a_drawer_for_odds_and_ends(path: Path) -> None:
    assert path.stem not in ("utils", "util", "helpers", "common", "misc"), (
        "name a module after what it does; a drawer grows until nobody finds anything in it"
    )


@pytest.mark.parametrize("path", modules, ids=relative)
def test_nothing_goes_on_after_an_unknown_error(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ExceptHandler):
            caught = ast.unparse(node.type) if node.type else "everything"
            raises = any(isinstance(part, ast.Raise) for part in ast.walk(node))
            assert raises or caught not in ("everything", "Exception", "BaseException"), (
                "catch what you can mend; a process that meets the unknown dies and is restarted"
            )


@pytest.mark.parametrize("path", nodes, ids=relative)
def test_nodes_read_no_clock_and_open_no_socket(path: Path) -> None:
    if "recorder" in path.parts:
        pytest.skip("the recorder stamps what it writes with the time it heard it")
    imported = {
        name.name.split(".")[0]
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Import)
        for name in node.names
    }
    assert not imported & {"time", "datetime", "socket", "threading", "asyncio", "zenoh"}, (
        "a handler lives on its messages: else lockstep and the wire disagree"
    )


def test_no_other_file_holds_a_key_expression() -> None:
    keys = [topic.key for topic in ALL_TOPICS if "/" in topic.key]
    pattern = re.compile("|".join(f'"{re.escape(key)}"' for key in keys))
    guilty = [
        relative(path)
        for path in modules
        if path.name != "topics.py" and pattern.search(path.read_text())
    ]
    assert guilty == [], "use the topic from schemas/topics.py: its type and QoS come with it"


reads_the_machine = ("vulkan.py", "testing.py")
"""A driver the user chose, and where programs are found."""


def test_the_command_line_sets_no_default_from_the_environment() -> None:
    guilty = [
        relative(path)
        for path in modules
        if "os.environ.get" in path.read_text() and path.name not in reads_the_machine
    ]
    assert guilty == [], "a default that reads the environment is a setting nobody can see"
