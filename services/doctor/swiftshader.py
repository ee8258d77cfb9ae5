"""SwiftShader, a software driver without further needs, out of a browser's package."""

import hashlib
from pathlib import Path

from services.doctor.driver import UnavailableError, find, run, say
from services.doctor.mesa import X11_PACKAGE, PrivateApt, unpack

_NPM_PACKAGE = "@sparticuz/chromium@147.0.0"
_ARCHIVE = "package/bin/swiftshader.tar.br"
_ARCHIVE_SHA256 = "f957ea867313f9815b71dc2ed30cce301e01db4f3973fbdb31ffa5391b0ec45a"
# Python's library cannot read Brotli; Node.js, which comes with npm, can.
_DECOMPRESS = """
const [from, to] = process.argv.slice(1);
const fs = require("fs");
fs.writeFileSync(to, require("zlib").brotliDecompressSync(fs.readFileSync(from)));
"""

Unpacked = tuple[Path, Path, Path]


def fetch_from_npm(work: Path) -> Unpacked:
    """Downloads the npm package below `work`; returns and raises as `mesa.fetch` does."""
    say(f"  downloading {_NPM_PACKAGE} with npm (68 MB, of which 3.5 MB are needed)")
    folder = work / "npm"
    folder.mkdir()
    run(["npm", "pack", "--silent", _NPM_PACKAGE], cwd=folder)
    run(["tar", "-xf", str(find(folder, "*.tgz")), _ARCHIVE], cwd=folder)
    compressed = folder / _ARCHIVE
    if hashlib.sha256(compressed.read_bytes()).hexdigest() != _ARCHIVE_SHA256:
        raise UnavailableError(f"{_NPM_PACKAGE} is not the package that was checked")
    run(["node", "-e", _DECOMPRESS, str(compressed), "swiftshader.tar"], cwd=folder)
    run(["tar", "-xf", "swiftshader.tar"], cwd=folder)
    return _found(folder)


def fetch_from_apt(work: Path) -> Unpacked:
    """Downloads the distribution's browser below `work`; as `mesa.fetch`, raises included."""
    apt = PrivateApt(work / "apt")
    apt.update()
    say("  downloading chromium-common, which holds SwiftShader")
    folder = work / "chromium"
    folder.mkdir()
    # Not the browser's own dependencies: of it, the driver alone is used.
    apt.run("apt-get", "download", "chromium-common", cwd=folder)
    unpack([*folder.glob("*.deb"), *apt.download(X11_PACKAGE)], folder)
    return _found(folder)


def _found(unpacked: Path) -> Unpacked:
    driver = find(unpacked, "libvk_swiftshader.so")
    return find(unpacked, "vk_swiftshader_icd.json"), driver, unpacked
