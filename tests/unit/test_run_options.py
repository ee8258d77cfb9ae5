"""What the options of up, demo and hub come to."""

from pathlib import Path

import pytest

from schemas.errors import UserError
from schemas.run import RunConfig
from services.commands.run_options import DEFAULTS, RunOptions, SourceOptions, config_of


def test_without_options_a_run_has_the_settings_of_every_run() -> None:
    assert config_of("husky", "hydrant", DEFAULTS) == RunConfig()


def test_files_are_named_so_that_services_in_other_folders_find_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tags.json").write_text("{}")
    source = SourceOptions(tags=Path("tags.json"))
    run = config_of("wheelchair", "office", RunOptions(no_adaptive=True, seed=3), source)
    assert Path(run.tags) == tmp_path / "tags.json"
    assert not run.adaptive
    assert run.seed == 3


def test_what_is_no_camera_is_refused_before_anything_starts() -> None:
    with pytest.raises(UserError, match="nowhere"):
        config_of("husky", "hydrant", DEFAULTS, SourceOptions(camera="/nowhere/at/all"))
