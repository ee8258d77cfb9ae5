import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from services.doctor import driver
from services.doctor import vulkan as ways
from services.doctor.driver import UnavailableError
from services.doctor.vulkan import Way
from sim import vulkan

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.fixture(autouse=True)
def private_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(vulkan, "DRIVER_FOLDER", tmp_path / "share" / "vulkan")
    return tmp_path


def compiled(folder: Path, name: str, source: str, *needs: str) -> Path:
    folder.mkdir(exist_ok=True)
    output = folder / f"lib{name}.so"
    options = [f"-Wl,-soname,lib{name}.so", f"-L{folder}", *(f"-l{need}" for need in needs)]
    command = ["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", str(output), *options]
    subprocess.run(command, input=source, text=True, check=True)
    return output


@pytest.fixture
def installed(private_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed driver that needs a chain of two libraries the machine does not have."""
    # Names are unique per test: a library that is loaded once stays in this process.
    one, two, top = (f"{part}{os.getpid()}{private_folder.name}" for part in ("one", "two", "top"))
    folder = private_folder / "unpacked"
    compiled(folder, one, "int one(void) { return 1; }")
    compiled(folder, two, "int one(void); int two(void) { return 1 + one(); }", one)
    top_path = compiled(folder, top, "int two(void); int three(void) { return 1 + two(); }", two)
    manifest = private_folder / "icd.json"
    manifest.write_text(json.dumps({"ICD": {"library_path": "somewhere"}}))
    monkeypatch.setattr(vulkan, "device_name", lambda: "a device")
    assert driver.install(manifest, top_path, folder) == "a device"
    return vulkan.DRIVER_FOLDER


@needs_compiler
def test_libraries_are_listed_after_those_they_need(installed: Path) -> None:
    names = (installed / "preload.txt").read_text().split()
    assert [name[3:6] for name in names] == ["one", "two", "top"]
    assert sorted(path.name for path in (installed / "lib").iterdir()) == sorted(names)


@needs_compiler
def test_activated_driver_loads_without_a_library_path(installed: Path) -> None:
    shutil.rmtree(installed.parents[1] / "unpacked")
    program = f"""
import ctypes, json, os
from pathlib import Path
from sim import vulkan
vulkan.DRIVER_FOLDER = Path({str(installed)!r})
vulkan.activate()
manifest = Path(os.environ["VK_DRIVER_FILES"])
path = manifest.parent / json.loads(manifest.read_text())["ICD"]["library_path"]
print(ctypes.CDLL(str(path)).three())
"""
    environment = {k: v for k, v in os.environ.items() if k != "LD_LIBRARY_PATH"}
    root = Path(vulkan.__file__).parents[1]
    command = [sys.executable, "-c", program]
    done = subprocess.run(
        command, cwd=root, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "3"


@needs_compiler
def test_a_library_that_is_nowhere_is_named(private_folder: Path) -> None:
    folder = private_folder / "unpacked"
    lost = f"lost{os.getpid()}"
    compiled(folder, lost, "int lost(void) { return 1; }").rename(private_folder / "away")
    (private_folder / f"lib{lost}.so").symlink_to(private_folder / "away")
    source = "int lost(void); int f(void) { return lost(); }"
    broken = folder / "broken.so"
    command = ["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", str(broken)]
    options = [f"-L{private_folder}", f"-l{lost}"]
    subprocess.run([*command, *options], input=source, text=True, check=True)
    with pytest.raises(UnavailableError, match=f"no lib{lost}.so"):
        driver.libraries_to_load(broken, folder)


def test_a_driver_named_by_the_user_is_left_alone(
    private_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    vulkan.DRIVER_FOLDER.mkdir(parents=True)
    (vulkan.DRIVER_FOLDER / "driver.json").write_text("{}")
    (vulkan.DRIVER_FOLDER / "preload.txt").write_text("libnot-there.so")
    monkeypatch.setenv("VK_DRIVER_FILES", "/mine.json")
    vulkan.activate()
    assert os.environ["VK_DRIVER_FILES"] == "/mine.json"
    assert vulkan.user_driver() == "/mine.json"


def test_our_driver_inherited_from_a_parent_process_is_no_choice_of_the_user(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", str(vulkan.DRIVER_FOLDER / "driver.json"))
    assert vulkan.user_driver() is None


def test_without_a_driver_from_set_up_the_environment_stays_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("LP_NUM_THREADS", "7")
    vulkan.activate()
    assert "VK_DRIVER_FILES" not in os.environ
    assert os.environ["LP_NUM_THREADS"] == "7"


def no_device() -> str:
    raise vulkan.NoVulkanDeviceError("no device")


def closed(work: Path) -> tuple[Path, Path, Path]:
    raise UnavailableError("closed road")


def forbidden(work: Path) -> tuple[Path, Path, Path]:
    pytest.fail(f"downloaded into {work}")


def test_where_every_way_is_closed_the_remedies_are_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(vulkan, "device_name", no_device)
    monkeypatch.setattr(ways, "WAYS", [Way("first", closed), Way("second", closed)])
    assert not ways.ensure_driver()
    words = capsys.readouterr().err
    assert words.index("trying first") < words.index("trying second")
    assert "closed road" in words
    assert ways.REMEDY in words


def test_a_machine_with_a_device_downloads_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vulkan, "device_name", lambda: "a graphics card")
    monkeypatch.setattr(ways, "WAYS", [Way("never", forbidden)])
    assert ways.ensure_driver()


@needs_compiler
def test_what_sapien_itself_lacks_is_laid_beside_the_driver(
    private_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = private_folder / "unpacked"
    mark = f"{os.getpid()}{private_folder.name}"
    top = compiled(folder, f"top{mark}", "int f(void) { return 1; }")
    window = compiled(folder, f"window{mark}", "int g(void) { return 1; }")
    manifest = private_folder / "icd.json"
    manifest.write_text(json.dumps({"ICD": {}}))

    def device_name() -> str:
        if window.name in (vulkan.DRIVER_FOLDER / "preload.txt").read_text():
            return "a device"
        words = f"ImportError: {window.name}: cannot open shared object file: No such file"
        raise vulkan.NoVulkanDeviceError(words)

    monkeypatch.setattr(vulkan, "device_name", device_name)
    assert driver.install(manifest, top, folder) == "a device"
    assert (vulkan.DRIVER_FOLDER / "lib" / window.name).exists()


@needs_compiler
def test_a_driver_that_gives_no_device_is_taken_away(
    private_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = private_folder / "unpacked"
    top = compiled(folder, f"useless{os.getpid()}", "int f(void) { return 1; }")
    manifest = private_folder / "icd.json"
    manifest.write_text(json.dumps({"ICD": {}}))
    monkeypatch.setattr(vulkan, "device_name", no_device)
    with pytest.raises(UnavailableError, match="no device"):
        driver.install(manifest, top, folder)
    assert not vulkan.DRIVER_FOLDER.exists()
