"""A log is read by another project's readers (@mcap/core, @mcap/support), not only by ours."""

import json
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from schemas.run import RunConfig
from schemas.topics import topic_named
from services.recorder.run_log import RunLog
from services.runtime.log_file import log_summary, read_log
from services.runtime.mailbox import Sample
from tests.replay.cases import CASES

script = Path(__file__).parents[1] / "data" / "read_mcap.mjs"
packages = (
    "@mcap/core@2.2.2",
    "@mcap/support@1.1.0",
    "@foxglove/wasm-zstd@1.0.1",
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("npm") is None, reason="npm is not installed"),
]


def write_run(path: Path) -> Counter[str]:
    """A file of everything in the recordings; returns how many messages of each topic."""
    log, sent = RunLog(path, RunConfig()), Counter[str]()
    for case in CASES:
        for record in read_log(case.path):
            number = sent.total()
            at_ns = number * 50_000_000
            log.write(Sample(topic_named(record.topic), record.data, 1, number, at_ns), at_ns)
            sent[record.topic] += 1
    log.close()
    return sent


def test_another_projects_readers_count_the_same_and_decode_what_is_for_viewers(
    tmp_path: Path,
) -> None:
    sent = write_run(tmp_path / "run.mcap")
    shutil.copy(script, tmp_path)
    install = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(tmp_path), *packages]
    if subprocess.run(install, capture_output=True, check=False).returncode != 0:
        pytest.skip("the readers cannot be installed here")
    ran = subprocess.run(
        ["node", script.name, "run.mcap"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    read = json.loads(ran.stdout)
    shown = log_summary(tmp_path / "run.mcap")["shown"]
    assert read["messages"] == {**sent, **shown}
    assert read["decoded"].keys() == shown.keys()
    assert read["decoded"]["/map/objects"] == "foxglove.SceneUpdate"
