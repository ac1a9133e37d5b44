"""Build the archives of a release: sdist, wheel, and ``stagewire-c-VERSION.tar.gz`` for C users.

    python tools/archives.py --out dist

The C archive contains the packages with their tests, the registries and vectors as JSON, the licence, and the
pages about C and the vectors. With the same versions of hatchling and Jinja, the same commit gives the same
bytes: files are sorted, and all have the time of ``SOURCE_DATE_EPOCH`` or of the commit.
"""

from __future__ import annotations

import argparse
import gzip
import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import stagewire
from stagewire_generator import check, render

__all__ = ["NAME", "c_archive", "c_files"]

ROOT = Path(__file__).parents[1]
NAME = f"stagewire-c-{stagewire.__version__}"
TARGETS = ("c", "c-tests", "registry", "vectors")
PAGES = ("LICENSE", "docs/reference/c.md", "docs/reference/vectors.md")


def c_files() -> dict[str, bytes]:
    """Return the files of the C archive: path -> content."""
    made = render(check(ROOT / "spec"), TARGETS)
    files = {path: text.encode("utf-8") for path, text in made.items()}
    return files | {path: (ROOT / path).read_bytes() for path in PAGES}


def c_archive(epoch: int) -> bytes:
    """Return the C archive, in which all files have this time."""
    packed = io.BytesIO()
    with (
        gzip.GzipFile(filename="", mode="wb", fileobj=packed, mtime=epoch) as stream,
        tarfile.open(fileobj=stream, mode="w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for path, content in sorted(c_files().items()):
            member = tarfile.TarInfo(f"{NAME}/{path}")
            member.size, member.mtime, member.mode = len(content), epoch, 0o644
            archive.addfile(member, io.BytesIO(content))
    return packed.getvalue()


def epoch() -> int:
    """Return the time of the release in seconds since 1970."""
    if given := os.environ.get("SOURCE_DATE_EPOCH"):
        return int(given)
    words = ["git", "log", "-1", "--format=%ct"]
    try:
        return int(subprocess.run(words, cwd=ROOT, check=True, capture_output=True).stdout)
    except (OSError, subprocess.CalledProcessError):
        sys.exit(f"{ROOT} is not a git checkout: set SOURCE_DATE_EPOCH to the time of the release")


def main() -> None:
    """Write all archives to a folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder to write to")
    out: Path = parser.parse_args().out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    now = epoch()
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(now)}
    command = [sys.executable, "-m", "hatchling", "build", "--directory", str(out)]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    path = out / f"{NAME}.tar.gz"
    path.write_bytes(c_archive(now))
    print(path)


if __name__ == "__main__":
    main()
