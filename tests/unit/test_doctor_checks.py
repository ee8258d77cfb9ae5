import json
from importlib import metadata
from pathlib import Path

import pytest

from services.doctor import checks, packages
from services.doctor.checks import Check

GOOD = Check(name="good", ok=True, detail="here")
OPTIONAL = Check(name="extra", ok=False, detail="gone", remedy="get it", needed=False)
BROKEN = Check(name="broken", ok=False, detail="gone", remedy="mend it")


def doctor(monkeypatch: pytest.MonkeyPatch, *results: Check, as_json: bool = False) -> int:
    monkeypatch.setattr(checks, "CHECKS", [lambda result=result: result for result in results])
    return checks.run_doctor(fix=False, as_json=as_json)


def test_only_a_needed_part_makes_the_exit_code_five(monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor(monkeypatch, GOOD, OPTIONAL) == 0
    assert doctor(monkeypatch, GOOD, BROKEN) == 5


def test_each_check_is_one_line_with_its_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    doctor(monkeypatch, GOOD, OPTIONAL, BROKEN)
    good, extra, broken = capsys.readouterr().out.splitlines()
    assert good.startswith("ok ")
    assert extra.startswith("optional ")
    assert broken.startswith("MISSING ")
    assert broken.endswith("gone; mend it")


def test_json_is_one_document_with_every_check(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    doctor(monkeypatch, GOOD, BROKEN, as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document["ok"] is False
    assert [check["name"] for check in document["checks"]] == ["good", "broken"]
    assert document["checks"][1]["remedy"] == "mend it"


def lock(folder: Path, *lines: str) -> Path:
    path = folder / "requirements.lock"
    path.write_text("".join(f"{line} \\\n    --hash=sha256:00\n" for line in lines))
    return path


def test_packages_for_other_machines_are_not_missed(tmp_path: Path) -> None:
    here = metadata.version("numpy")
    path = lock(tmp_path, f"numpy=={here}", "absent==1.0 ; sys_platform == 'elsewhere'")
    assert packages.locked(path) == {"numpy": here}
    assert packages.differences(path) == []


def test_a_missing_and_an_other_version_are_named(tmp_path: Path) -> None:
    path = lock(tmp_path, "numpy==0.0.1", "no-such-distribution==1.0")
    here = metadata.version("numpy")
    assert packages.differences(path) == [
        f"numpy {here} (locked 0.0.1)",
        "no-such-distribution missing (locked 1.0)",
    ]
    check = checks.check_packages(path)
    assert not check.ok
    assert "numpy" in check.detail


def test_a_run_folder_that_does_not_exist_yet_is_judged_by_its_parent(tmp_path: Path) -> None:
    assert checks.check_disk(tmp_path / "runs" / "today").ok
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "_FREE_SPACE_NEEDED", 2**80)
    check = checks.check_disk(tmp_path)
    assert not check.ok
    assert "2 GB" in check.remedy
