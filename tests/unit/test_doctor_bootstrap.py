"""The laws of the shell script that stands before the command line."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "incognita"
FAKE_PYTHON = """\
#!/bin/sh
printf '%s\\n' "$PWD" "$@"
"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout whose environment is ready and whose Python prints folder and arguments."""
    root = tmp_path / "a checkout"
    (root / ".venv" / "bin").mkdir(parents=True)
    shutil.copy(SCRIPT, root / "incognita")
    (root / "requirements.lock").write_text("numpy==1.0 \\\n    --hash=sha256:00\n")
    python = root / ".venv" / "bin" / "python"
    python.write_text(FAKE_PYTHON)
    python.chmod(0o755)
    stamp = f"{root.resolve()}\n{(root / 'requirements.lock').read_text()}"
    (root / ".venv" / "incognita.stamp").write_text(stamp)
    return root


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A folder of programs with neither Python nor uv in it."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("sh", "dirname", "readlink", "cmp", "cat", "mkdir", "rm", "mv", "sleep"):
        found = shutil.which(name)
        assert found
        (folder / name).symlink_to(found)
    return folder


def call(script: Path, *arguments: str, cwd: Path, tools: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [script, *arguments],
        cwd=cwd,
        env={"PATH": str(tools), "HOME": os.environ.get("HOME", "/")},
        capture_output=True,
        text=True,
        timeout=20,
        check=False,
    )


def test_a_prepared_checkout_runs_at_once_in_the_callers_folder(
    checkout: Path, tools: Path, tmp_path: Path
) -> None:
    done = call(checkout / "incognita", "say", "two words", "", cwd=tmp_path, tools=tools)
    expected = [str(tmp_path.resolve()), "-m", "services.cli", "say", "two words", ""]
    assert done.stdout.split("\n")[:-1] == expected
    assert done.stderr == ""


def test_it_may_be_called_through_links(checkout: Path, tools: Path, tmp_path: Path) -> None:
    (tmp_path / "near").symlink_to(checkout / "incognita")
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "far").symlink_to("../near")
    done = call(tmp_path / "deep" / "far", "status", cwd=tmp_path, tools=tools)
    assert done.stdout.endswith("services.cli\nstatus\n")


def test_a_changed_lock_or_a_moved_checkout_is_prepared_again(
    checkout: Path, tools: Path, tmp_path: Path
) -> None:
    moved = checkout.rename(tmp_path / "elsewhere")
    done = call(moved / "incognita", cwd=tmp_path, tools=tools)
    assert "first use" in done.stderr
    stamp = moved / ".venv" / "incognita.stamp"
    stamp.write_text(f"{moved.resolve()}\n" + (moved / "requirements.lock").read_text())
    assert call(moved / "incognita", cwd=tmp_path, tools=tools).stderr == ""
    (moved / "requirements.lock").write_text("numpy==2.0\n")
    assert "first use" in call(moved / "incognita", cwd=tmp_path, tools=tools).stderr


def test_without_python_it_says_what_is_needed_and_leaves_no_guard(
    checkout: Path, tools: Path
) -> None:
    shutil.rmtree(checkout / ".venv")
    done = call(checkout / "incognita", "up", cwd=checkout, tools=tools)
    assert done.returncode == 5
    assert "Python 3.11" in done.stderr.splitlines()[-1]
    assert done.stdout == ""
    assert not (checkout / ".venv.lock").exists()


def test_the_guard_of_a_dead_set_up_is_taken_over(checkout: Path, tools: Path) -> None:
    shutil.rmtree(checkout / ".venv")
    (checkout / ".venv.lock").mkdir()
    gone = subprocess.run(["sh", "-c", "echo $$"], capture_output=True, text=True, check=True)
    (checkout / ".venv.lock" / "pid").write_text(gone.stdout)
    done = call(checkout / "incognita", cwd=checkout, tools=tools)
    assert "waiting" not in done.stderr
    assert done.returncode == 5


def test_the_guard_of_a_living_set_up_is_respected(checkout: Path, tools: Path) -> None:
    (checkout / ".venv.lock").mkdir()
    (checkout / ".venv.lock" / "pid").write_text(f"{os.getpid()}\n")
    stamp = checkout / ".venv" / "incognita.stamp"
    ready = stamp.read_text()
    stamp.unlink()
    waiting = subprocess.Popen(
        [checkout / "incognita", "later"],
        env={"PATH": str(tools)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert waiting.stderr is not None
    assert f"another set-up (process {os.getpid()})" in waiting.stderr.readline()
    stamp.write_text(ready)
    shutil.rmtree(checkout / ".venv.lock")
    output, _ = waiting.communicate(timeout=20)
    assert output.endswith("later\n")
