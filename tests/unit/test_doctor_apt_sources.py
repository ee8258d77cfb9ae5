from pathlib import Path

import pytest

from services.doctor.apt_sources import main_archive
from services.doctor.driver import UnavailableError

DEB822 = """\
Types: deb
# a remark
URIs: http://mirror.example/debian
Suites: bookworm bookworm-updates
Components: main contrib
Signed-By: /keys/debian.gpg

Types: deb
URIs: http://mirror.example/security
Suites: bookworm-security
Components: main
"""
CLASSIC = """\
# deb http://commented.example/debian bookworm main
deb-src http://source.example/debian bookworm main
deb http://other.example/tools stable main
deb [arch=amd64 signed-by=/keys/a.gpg] http://mirror.example/debian bookworm main # ours
"""


def settings(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return folder


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "sources.list.d/debian.sources",
            DEB822,
            "[signed-by=/keys/debian.gpg] http://mirror.example/debian {} main contrib",
        ),
        ("sources.list", CLASSIC, "[signed-by=/keys/a.gpg] http://mirror.example/debian {} main"),
        (
            "sources.list.d/a.list",
            CLASSIC.replace("arch=amd64 signed-by=/keys/a.gpg", "trusted=no"),
            "http://mirror.example/debian {} main",
        ),
    ],
)
def test_release_updates_and_backports_of_the_main_archive(
    tmp_path: Path, name: str, text: str, expected: str
) -> None:
    lines = main_archive(settings(tmp_path, name, text), codename="bookworm")
    suites = ("bookworm", "bookworm-updates", "bookworm-backports")
    assert lines == [f"deb {expected.format(suite)}" for suite in suites]


@pytest.mark.parametrize(
    "text",
    ["", DEB822.replace("Types: deb", "Types: deb-src"), f"Enabled: no\n{DEB822}".split("\n\n")[0]],
)
def test_settings_without_the_archive_are_named(tmp_path: Path, text: str) -> None:
    folder = settings(tmp_path, "sources.list.d/debian.sources", text)
    with pytest.raises(UnavailableError, match=r"no archive of bookworm"):
        main_archive(folder, codename="bookworm")


def test_key_inside_the_entry_is_no_path(tmp_path: Path) -> None:
    text = DEB822.replace("/keys/debian.gpg", "\n -----BEGIN PGP PUBLIC KEY BLOCK-----\n mQ: x")
    folder = settings(tmp_path, "sources.list.d/debian.sources", text)
    assert (
        main_archive(folder, "bookworm")[0]
        == "deb http://mirror.example/debian bookworm main contrib"
    )
