"""What stands in deploy/ goes with the code."""

import json
import re
import shlex
import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest

from services.cli import VERBS
from services.roles import HUB, ROLES
from services.runtime.identity import Identity
from services.runtime.link import Listen
from services.runtime.wire import hub_settings

deploy = Path(__file__).parents[2] / "deploy"
units = sorted((deploy / "systemd").glob("*.service"))
roles = {role.name for role in ROLES}
socket = "unixsock-stream//run/incognita/hub.sock"


def hub_identity() -> Identity:
    now = datetime.now(UTC)
    return Identity(Path("/etc/incognita/hub"), HUB, now, now.replace(year=now.year + 1), ())


shown = {
    "loopback.json": Listen((socket,)),
    "mtls.json": Listen((socket, "tls/0.0.0.0:7447"), hub_identity()),
}


@pytest.mark.parametrize(("file", "listen"), shown.items())
def test_the_settings_shown_are_those_of_the_code(file: str, listen: Listen) -> None:
    wanted = json.loads(json.dumps(hub_settings(listen, "default", "husky")))
    assert json.loads((deploy / "zenoh" / file).read_text()) == wanted, (
        f"python -m tests.unit.test_deploy writes deploy/zenoh/{file} again"
    )


@pytest.mark.parametrize("unit", units, ids=lambda unit: unit.name)
def test_a_unit_is_right_and_locked_in(unit: Path, tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd-analyze on this machine")
    program = tmp_path / "incognita"
    program.touch(mode=0o755)
    copy = tmp_path / unit.name.replace("@.", "@compute.")
    copy.write_text(unit.read_text().replace("/opt/incognita/incognita", str(program)))
    verified = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(copy)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert (verified.returncode, verified.stderr) == (0, "")
    judged = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--threshold=20", str(copy)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert judged.returncode == 0, judged.stdout


@pytest.mark.parametrize("unit", units, ids=lambda unit: unit.name)
def test_a_unit_starts_a_verb_there_is(unit: Path) -> None:
    (start,) = re.findall(r"^ExecStart=(.*)$", unit.read_text(), re.MULTILINE)
    assert shlex.split(start)[1] in VERBS


def test_compose_starts_verbs_and_roles_there_are() -> None:
    text = (deploy / "compose" / "compose.yaml").read_text()
    commands = [line.split(", ") for line in re.findall(r"command: \[(.*)\]", text)]
    assert {command[0] for command in commands} <= set(VERBS)
    mounted = set(re.findall(r"\./certs/(\w+):/certs:ro", text))
    assert mounted <= roles | {HUB}
    assert HUB in mounted


def test_the_page_that_says_which_to_use_names_every_role_and_file() -> None:
    text = (deploy / "README.md").read_text()
    for role in ROLES:
        assert f"| `{role.name}` |" in text
    for name in (*(unit.name for unit in units), *(p.name for p in deploy.glob("presets/*"))):
        assert name.split("@")[0].removesuffix(".service") in text


if __name__ == "__main__":
    for name, where in shown.items():
        settings = json.dumps(hub_settings(where, "default", "husky"), indent=2)
        (deploy / "zenoh" / name).write_text(settings + "\n")
