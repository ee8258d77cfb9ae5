"""A log is read by another project's reader (@mcap/core), not only by ours."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from schemas import topics
from schemas.codec import encode
from schemas.geometry import Pose2
from schemas.health import Tick
from schemas.sensing import LaserScan
from services.runtime.mailbox import Sample
from services.runtime.record import LogWriter

script = Path(__file__).parents[1] / "data" / "read_mcap.mjs"
packages = ("@mcap/core@2.2.2", "@foxglove/wasm-zstd@1.0.1")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("npm") is None, reason="npm is not installed"),
]


def test_another_projects_reader_counts_the_same(tmp_path: Path) -> None:
    scan = LaserScan(
        stamp_ns=1,
        angle_min=0.0,
        angle_increment=0.1,
        range_max=20.0,
        ranges=np.ones(360, np.float32),
        base_from_laser=Pose2(0.0, 0.0, 0.0),
        odom_from_base=Pose2(0.0, 0.0, 0.0),
    )
    writer = LogWriter(tmp_path / "run.mcap", {"run": {"seed": "1"}})
    for number in range(300):
        writer.write(Sample(topics.SCAN, encode(scan), 1, number, number), number)
        writer.write(Sample(topics.TICK, encode(Tick(stamp_ns=number)), 2, number, number), number)
    writer.close()
    shutil.copy(script, tmp_path)
    install = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(tmp_path), *packages]
    if subprocess.run(install, capture_output=True, check=False).returncode != 0:
        pytest.skip("the reader cannot be installed here")
    ran = subprocess.run(
        ["node", script.name, "run.mcap"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == {"messages": 600}
