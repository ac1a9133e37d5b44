"""Cache the work on unchanged parts of a spec, for tests that check it repeatedly with one file changed.

A valid file is read and validated against its schema only once. A protocol whose files are unchanged is
checked and rendered only once. This saves nine tenths of the time and does not change the results.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from stagewire_generator import pipeline, reader, strict_yaml
from stagewire_generator.strict_yaml import Document
from stagewire_generator.targets import templates

MOST = 16  # more than the protocols in a spec


@contextmanager
def quick_specs() -> Iterator[None]:
    """Reuse the results of valid files and protocols until the block ends."""
    with pytest.MonkeyPatch.context() as patch:
        _read_once(patch)
        _check_once(patch)
        _compile_once(patch)
        for name, target in pipeline.TARGETS.items():
            patch.setitem(pipeline.TARGETS, name, _rendered_once(target))
        yield


class _Recent:
    """A cache of recently used results."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()

    def get(
        self, key: Hashable, make: Callable[[], Any], good: Callable[[], bool] = lambda: True
    ) -> Any:
        """Return the cached result for a key, or make it and cache it if it is good."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        made = make()
        if good():
            self._kept[key] = made
            if len(self._kept) > MOST:
                self._kept.popitem(last=False)
        return made


def _read_once(patch: pytest.MonkeyPatch) -> None:
    """Read and validate a valid file only once while it is unchanged."""
    load, valid = strict_yaml.load, reader.fits_schema
    good: dict[tuple[str, bytes], Document] = {}  # all are kept, so that no id is reused
    seen: dict[int, Document] = {}

    def load_once(path: Path, name: str, diagnostics: Any, **options: Any) -> Document | None:
        try:
            key = (name, path.read_bytes())
        except OSError:
            return load(path, name, diagnostics, **options)
        if key not in good:
            before = len(diagnostics.found)
            document = load(path, name, diagnostics, **options)
            if document is None or len(diagnostics.found) > before:
                return document
            good[key] = document
        return good[key]

    def valid_once(document: Document, kind: str, diagnostics: Any, **options: Any) -> bool:
        if id(document) not in seen:
            if not valid(document, kind, diagnostics, **options):
                return False
            seen[id(document)] = document
        return True

    patch.setattr(strict_yaml, "load", load_once)
    patch.setattr(reader, "fits_schema", valid_once)


def _check_once(patch: pytest.MonkeyPatch) -> None:
    """Check a valid protocol and its overlays only once while no file changes."""
    alone, overlays = pipeline.check_protocol, pipeline.check_overlays
    checked, over = _Recent(), _Recent()

    def same(files: Any) -> Hashable:
        return tuple((kind, *map(id, documents)) for kind, documents in sorted(files.items()))

    def check_once(files: Any, diagnostics: Any, say: Any) -> Any:
        before = len(diagnostics.found)
        return checked.get(
            same(files),
            lambda: alone(files, diagnostics, say),
            lambda: len(diagnostics.found) == before,
        )

    def overlays_once(
        source: Any, base: Any, requested: Any, diagnostics: Any, say: Any, **options: Any
    ) -> Any:
        before = len(diagnostics.found)
        found = sorted(path for path in (source.path / "overlays").rglob("*") if path.is_file())
        contents = ((path, path.read_bytes()) for path in found)
        key = (source, same(base.files), tuple(requested), *options.items(), *contents)
        return over.get(
            key,
            lambda: overlays(source, base, requested, diagnostics, say, **options),
            lambda: len(diagnostics.found) == before,
        )

    patch.setattr(pipeline, "check_protocol", check_once)
    patch.setattr(pipeline, "check_overlays", overlays_once)


def _compile_once(patch: pytest.MonkeyPatch) -> None:
    """Compile the built-in templates only once. Templates of a user are always compiled."""
    made = templates.Templates
    ours = made()
    patch.setattr(templates, "Templates", lambda folder=None: made(folder) if folder else ours)


def _rendered_once(target: Callable[..., dict[str, str]]) -> Callable[..., dict[str, str]]:
    made = _Recent()

    def render(protocol: Any, templates: Any) -> dict[str, str]:
        # the cache keeps the protocol and the templates, so that their ids are not reused
        *_, files = made.get(
            (id(protocol), id(templates)),
            lambda: (protocol, templates, target(protocol, templates)),
        )
        return dict(files)

    return render
