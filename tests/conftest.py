"""Fixtures that several folders of tests share."""

import os
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.running import started


@pytest.fixture
def up(tmp_path: Path, request: pytest.FixtureRequest) -> Callable[..., object]:
    """Starts systems: `with up("--seed", "1") as system`. All of a test share one realm."""
    realm = f"test-{os.getpid()}-{zlib.crc32(request.node.name.encode()) % 10000}"
    return lambda *arguments: started(tmp_path, realm, *arguments)
