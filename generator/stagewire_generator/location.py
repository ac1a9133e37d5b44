"""Where the file of a diagnostic really is: its name begins at the folder above the protocol."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from stagewire_generator.reader import files_of, protocol_folders

__all__ = ["locate"]


def locate(spec: Path, name: str) -> Path:
    """Return the path of the file that diagnostics of ``spec`` call ``name``.

    A file that is not read, such as one that is gone, is taken to be below ``spec``.
    """
    parts = PurePosixPath(name).parts
    folders = protocol_folders(spec)
    for path in (path for folder in folders for path in files_of(folder)):
        if path.parts[-len(parts) :] == parts:
            return path
    return Path(name) if Path(name) == spec else (folders[0].parent if folders else spec) / name
