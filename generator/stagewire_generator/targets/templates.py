"""The templates of all targets, and the user's templates that replace them.

A user's file shadows our template of the same name, so template names are unique across targets.
``stagewire/NAME`` always means our template: a user's template can include the one it shadows.

The module also writes canonical JSON (the same bytes for the same data) and wraps prose.
"""

from __future__ import annotations

import json
import traceback
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import jinja2

from stagewire_generator.files import NotReadError, content, leads_out
from stagewire_generator.targets.environment import (
    compiled_templates,
    environment,
    our_templates,
)

# Characters that JSON allows unescaped but that can control a terminal. An example may hold any byte as text.
_HIDDEN = "".join(map(chr, (*range(0x7F, 0xA0), 0xAD)))
_INDENTED = json.JSONEncoder(ensure_ascii=False, indent=2, sort_keys=True)
_ON_ONE_LINE, _IN_ASCII = (
    json.JSONEncoder(
        ensure_ascii=ascii, separators=(",", ":"), sort_keys=True, check_circular=False
    )
    for ascii in (False, True)
)


def canonical(data: dict[str, Any], lines: Collection[str] = ()) -> str:
    """Return ``data`` as JSON with sorted keys, an indent of two spaces, and a final newline.

    :param lines: keys of long lists. Each of their items is written on one line, without spaces.
    """
    rest = _INDENTED.encode({key: [] if key in lines else value for key, value in data.items()})
    rest = _escaped(rest)
    parts: list[str] = []
    for key in sorted(lines):
        if data.get(key):
            # JSON escapes line feeds in strings, so this text cannot occur anywhere else.
            before, _, rest = rest.partition(f'\n  "{key}": []')
            items = ",\n    ".join(map(_line, data[key]))
            parts += (before, f'\n  "{key}": [\n    ', items, "\n  ]")
    return "".join([*parts, rest, "\n"])  # at once: it may have megabytes


def _line(item: object) -> str:
    """Return an item on one line. The encoder for ASCII is faster, and most items need no other."""
    line = _IN_ASCII.encode(item)
    return _escaped(_ON_ONE_LINE.encode(item)) if "\\u" in line else line


def _escaped(text: str) -> str:
    """Return JSON in which the characters that can control a terminal are escaped."""
    for char in _HIDDEN:  # one by one: most texts have none of them, and a search is fast
        if char in text:
            text = text.replace(char, f"\\u{ord(char):04x}")
    return text


def wrapped(text: str, width: int, hanging: int = 0) -> list[str]:
    """Wrap a text into lines. A word longer than a line gets a separate line.

    :param hanging: number of spaces before every line except the first; they count towards the width.
    """
    rest = " ".join(text.split())
    pad = ""
    lines = []
    while len(pad) + len(rest) > width:
        end = rest.rfind(" ", 0, max(0, width - len(pad) + 1))
        if end < 0:  # the word is longer than a line
            end = rest.find(" ")
        if end < 0:
            break
        lines.append(pad + rest[:end])
        rest, pad = rest[end + 1 :], " " * hanging
    return [*lines, pad + rest] if rest else lines


_OURS = "stagewire"
_OWN = "_"  # prefix of user templates that shadow nothing and are only included by others


class TemplatesError(Exception):
    """The user's templates cannot be used. The message has a line for each problem, with file and line."""


class Templates:
    """Renders the templates of all targets.

    :param folder: directory with the user's templates.
    :raises TemplatesError: with all problems of the directory; later, if a template fails to render.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._texts: dict[str, tuple[str, Path]] = {}
        ours = our_templates()
        from_text = jinja2.FileSystemLoader(sorted({path.parent for path in ours}))
        if folder is None:
            from_modules = jinja2.ModuleLoader(compiled_templates(ours))
            self._environment = environment(jinja2.ChoiceLoader([from_modules, from_text]))
            return
        self._environment = environment(
            jinja2.ChoiceLoader(
                [
                    jinja2.FunctionLoader(self._own),
                    jinja2.PrefixLoader({_OURS: from_text}),
                    from_text,
                ]
            )
        )
        if problems := list(self._read(folder)):
            raise TemplatesError("\n".join(problems))

    @property
    def of_a_user(self) -> bool:
        """Whether there are user templates."""
        return bool(self._texts)

    def render(self, name: str, **values: object) -> str:
        """Render a template with the given values."""
        try:
            text = self._environment.get_template(name).render(values)
            text.encode("utf-8")
        except Exception as error:  # a template may raise anything
            if not self.of_a_user:
                raise  # a bug in our templates, not the user's
            raise TemplatesError(self._problem(name, error)) from error
        return text

    def _own(self, name: str) -> tuple[str, str, None] | None:
        text, path = self._texts.get(name, (None, None))
        return None if text is None else (text, str(path), None)

    def _read(self, folder: Path) -> Iterator[str]:
        """Read and compile all files of a directory; yield their problems."""
        known = {path.name for path in our_templates()}
        paths = templates_in(folder)
        if not paths:
            yield f"{folder}: contains no templates"
        for path in paths:
            if path.is_dir():
                yield f"{path}: is a directory; put templates directly in {folder}"
            elif path.name not in known and not path.name.startswith(_OWN):
                yield f"{path}: no template has this name{_near(path.name)}"
            else:
                try:
                    self._texts[path.name] = (_text(path, folder), path)
                except ValueError as error:
                    yield f"{path}: {error}"
        for name, (_, path) in self._texts.items():
            try:
                self._environment.get_template(name)
            except jinja2.TemplateSyntaxError as error:
                yield f"{path}:{error.lineno}: {error.message}"
            except (RecursionError, ValueError, SyntaxError) as error:  # Python cannot compile it
                yield f"{path}: cannot be compiled: {error}"

    def _problem(self, name: str, error: Exception) -> str:
        """Return the place of an error in a template, and its message."""
        message = str(error) or "failed"
        if isinstance(error, jinja2.TemplateNotFound):
            missing = str(error.name)
            message = f"unknown template {missing} in an include{_near(missing)}"
        elif isinstance(error, UnicodeEncodeError):
            message = "produces text that cannot be encoded as UTF-8"
        elif not isinstance(error, jinja2.TemplateError):
            message = f"{type(error).__name__}: {message}"
        shown = {str(path): str(path) for _, path in self._texts.values()}
        shown |= {str(path): f"{_OURS}/{path.name}" for path in our_templates()}
        where = str(self._texts[name][1]) if name in self._texts else f"{_OURS}/{name}"
        for frame, line in traceback.walk_tb(error.__traceback__):
            if template := shown.get(frame.f_code.co_filename):
                where = f"{template}:{line}"  # the last frame is the innermost
        return f"{where}: {message}"


def templates_in(folder: Path) -> list[Path]:
    """Return all entries of a directory of templates except hidden files, sorted."""
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def _text(path: Path, folder: Path) -> str:
    """Return the text of a template.

    :raises ValueError: if it cannot be read; the message gives the reason.
    """
    if leads_out(path, folder):
        raise ValueError("is a link to a file outside the directory of templates")
    try:
        return content(path).decode("utf-8-sig")  # some editors write a byte order mark
    except NotReadError as error:
        raise ValueError(str(error)) from None
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is not UTF-8") from None


def _near(name: str) -> str:
    """Return a suggestion of similar names of our templates, or an empty text."""
    ours = [path.name for path in our_templates()]
    stems = {_stem(known) for known in ours}
    near = get_close_matches(_stem(name.removeprefix(f"{_OURS}/")), stems)
    meant = [known for known in ours if _stem(known) in near]
    return f"; did you mean {' or '.join(meant)}?" if meant else ""


def _stem(name: str) -> str:
    return name.partition(".")[0]
