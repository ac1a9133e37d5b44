"""Files of a spec that stand where nothing reads them; what is in them would be missing without a word."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from pathlib import Path

from stagewire_generator.files import NotReadError, content, leads_out

__all__ = ["strays"]

_KEY = re.compile(rb"^([a-z]+):", re.MULTILINE)
_PATTERNS = ("*.y*ml", "*/*.y*ml", "*/*/overlay.y*ml")  # the last where `overlays` is misspelt
_PLACES = {  # first key of a file, or second of worked examples -> where files of its kind are read
    b"quantities": "quantities.yaml",
    b"controllers": "stages.yaml",
    b"stages": "stages.yaml",
    b"units": "units.yaml",
    b"families": "units.yaml",
    b"chapter": "messages/",
    b"errata": "errata/",
    b"rules": "rules.yaml",
}
_OF_PROTOCOL = {
    **_PLACES,
    b"protocol": "protocol.yaml",
    b"overlay": "overlays/NAME/overlay.yaml",
    b"examples": "conformance/examples/",
    b"captures": "conformance/captures/",
}
_OF_OVERLAY = {
    **_PLACES,
    b"protocol": "examples.yaml",
    b"overlay": "overlay.yaml",
    b"examples": "examples.yaml",
    b"captures": "captures.yaml",
}


def strays(
    folder: Path, read: Collection[Path], *, overlay: bool = False
) -> Iterator[tuple[Path, str]]:
    """Yield files of a protocol in ``folder`` or right below it that are not read, and their place.

    Other YAML may lie there, so a file counts if it begins as one of a spec does. What stands in the folder
    of an overlay is asked for by itself.

    :param read: the files that are read.
    :param overlay: whether the folder is that of an overlay.
    """
    root, places = (folder.parents[2], _OF_OVERLAY) if overlay else (folder.parent, _OF_PROTOCOL)
    for path in sorted({path for pattern in _PATTERNS for path in folder.glob(pattern)}):
        of_overlay = path.parents[1] == folder / "overlays"
        if path in read or of_overlay or leads_out(path, root):
            continue
        try:
            keys = _KEY.findall(content(path))
        except (NotReadError, OSError):
            continue
        if keys[:1] and keys[0] in places:
            kind = next(key for key in (*keys[1:2], keys[0]) if key in places)
            yield path, places[kind]
