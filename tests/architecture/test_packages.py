"""Laws about how the five packages are named and installed."""

import importlib.util
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("schemas", "robots", "services", "sim", "web")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.mark.parametrize("name", PACKAGES)
def test_name_resolves_to_this_project(name: str) -> None:
    """The names are plain words: a package from elsewhere may bear one and would shadow ours."""
    spec = importlib.util.find_spec(name)
    assert spec is not None
    assert spec.origin is not None, f"{name} has no __init__.py"
    assert Path(spec.origin) == ROOT / name / "__init__.py"


def test_no_installed_distribution_holds_one_of_the_names() -> None:
    holders = metadata.packages_distributions()
    taken = {
        name: holders[name]
        for name in PACKAGES
        if holders.get(name, ["incognita"]) != ["incognita"]
    }
    assert taken == {}


def test_every_list_of_the_packages_in_the_project_file_is_complete() -> None:
    tool = PROJECT["tool"]
    lists = (
        tool["hatch"]["build"]["targets"]["wheel"]["packages"],
        tool["pyright"]["include"],
        tool["importlinter"]["root_packages"],
    )
    assert all(sorted(names) == sorted(PACKAGES) for names in lists)


def test_every_folder_with_modules_is_a_regular_package() -> None:
    """A folder without __init__.py would be left out of the import contracts silently."""
    folders = {path.parent for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    bare = sorted(
        str(folder.relative_to(ROOT)) for folder in folders if not (folder / "__init__.py").exists()
    )
    assert bare == []


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-test.lock"])
def test_lock_has_hashes_and_no_address_and_no_unwanted_package(lock: str) -> None:
    text = (ROOT / lock).read_text()
    names = [line.partition("==")[0] for line in text.splitlines() if line[:1].isalnum()]
    assert "://" not in text
    assert "opencv-python" not in names
    assert text.count("\n    --hash=") >= len(names)
    assert all("==" in line for line in text.splitlines() if line[:1].isalnum())


def test_services_that_start_quickly_import_no_heavy_library() -> None:
    """`doctor` has to answer on a machine where these do not even load."""
    program = "import services.doctor, services.testing, sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    heavy = {"sapien", "gtsam", "cv2", "viser", "zenoh", "torch", "scipy", "numpy"}
    assert heavy.isdisjoint(done.stdout.split())
