"""Fixtures that several folders of tests share."""

import os
import zlib
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from services.mapping import prior, relation_table
from services.mapping.place_prior import by_hand
from tests.running import started


@pytest.fixture
def up(tmp_path: Path, request: pytest.FixtureRequest) -> Callable[..., object]:
    """Starts systems: `with up("--seed", "1") as system`. All of a test share one realm."""
    realm = f"test-{os.getpid()}-{zlib.crc32(request.node.name.encode()) % 10000}"
    return lambda *arguments: started(tmp_path, realm, *arguments)


@pytest.fixture
def without_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Places, densities and relations without data, so that laws do not hang on weights."""
    unlearned = msgspec.structs.replace(prior.learned(), densities={})
    monkeypatch.setattr(prior, "learned", lambda: unlearned)
    monkeypatch.setattr(prior, "place_prior", lambda role: by_hand)
    monkeypatch.setattr(relation_table, "relation_table", lambda: relation_table.defaults)
