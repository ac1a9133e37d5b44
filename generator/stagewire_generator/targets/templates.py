"""The templates of all targets, and the ones of a user that stand in for them.

A user's file shadows ours by its name, whatever target has it; so no two targets have a template of one
name. ``stagewire/NAME`` is always ours, so that a template can include what it shadows.

Also here: canonical JSON, the same bytes for the same data, and prose broken into lines.
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

# What JSON allows as it stands, and could steer a terminal: an example may hold any byte as text.
_HIDDEN = "".join(map(chr, (*range(0x7F, 0xA0), 0xAD)))
_INDENTED = json.JSONEncoder(ensure_ascii=False, indent=2, sort_keys=True)
_ON_ONE_LINE = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"), sort_keys=True)


def canonical(data: dict[str, Any], lines: Collection[str] = ()) -> str:
    """Return ``data`` as JSON with sorted keys, two blanks of indent, and a final newline.

    :param lines: keys of long lists; each of their items stands on one line, without blanks in it.
    """
    text = _INDENTED.encode({key: [] if key in lines else value for key, value in data.items()})
    for key in lines:
        if data.get(key):
            items = ",\n    ".join(map(_ON_ONE_LINE.encode, data[key]))
            # No text of the data has a line feed in it, so that nothing else looks like this.
            text = text.replace(f'\n  "{key}": []', f'\n  "{key}": [\n    {items}\n  ]')
    for char in _HIDDEN:  # one after the other: most are in no text, and a search is quick
        if char in text:
            text = text.replace(char, f"\\u{ord(char):04x}")
    return text + "\n"


def wrapped(text: str, width: int, hanging: int = 0) -> list[str]:
    """Return the lines of a text; a word that is longer than a line has one of its own.

    :param hanging: blanks before every line but the first; they count as part of its width.
    """
    words = text.split()
    whole = " ".join(words)
    if len(whole) <= width:
        return [whole] if whole else []
    pad = " " * hanging
    lines = []
    line = ""
    for word in words:
        if not line:
            line = word
        elif len(line) + 1 + len(word) <= width:
            line = f"{line} {word}"
        else:
            lines.append(line)
            line = pad + word
    return [*lines, line] if line else lines


_OURS = "stagewire"
_OWN = (
    "_"  # what a name begins with that shadows nothing: a part that templates of the user include
)


class TemplatesError(Exception):
    """Templates of a user that cannot be used; a line for each problem, with file and line."""


class Templates:
    """Renders the templates of all targets.

    :param folder: where a user has some of his own.
    Raises :class:`TemplatesError` with everything that is wrong in the folder, and later for a template
    that fails while it is rendered.
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
        """Whether some of the templates are a user's."""
        return bool(self._texts)

    def render(self, name: str, **values: object) -> str:
        """Return the text that a template makes of the values."""
        try:
            text = self._environment.get_template(name).render(values)
            text.encode("utf-8")
        except Exception as error:  # a template may do anything, and raise anything
            if not self.of_a_user:
                raise  # ours alone: that is no fault of the user
            raise TemplatesError(self._problem(name, error)) from error
        return text

    def _own(self, name: str) -> tuple[str, str, None] | None:
        text, path = self._texts.get(name, (None, None))
        return None if text is None else (text, str(path), None)

    def _read(self, folder: Path) -> Iterator[str]:
        """Read and compile all files of a folder; yield what is wrong with them."""
        known = {path.name for path in our_templates()}
        paths = templates_in(folder)
        if not paths:
            yield f"{folder}: there is no template in it"
        for path in paths:
            if path.is_dir():
                yield f"{path}: is a folder; templates stand in {folder} itself"
            elif path.name not in known and not path.name.startswith(_OWN):
                yield f"{path}: there is no template of this name to shadow{_near(path.name)}"
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
            except (RecursionError, ValueError, SyntaxError) as error:  # what Python cannot compile
                yield f"{path}: cannot be compiled: {error}"

    def _problem(self, name: str, error: Exception) -> str:
        """Return where in a template an error came up, and what it says."""
        message = str(error) or "it failed"
        if isinstance(error, jinja2.TemplateNotFound):
            missing = str(error.name)
            message = f"there is no template {missing} to include{_near(missing)}"
        elif isinstance(error, UnicodeEncodeError):
            message = "makes a text that cannot be written as UTF-8"
        elif not isinstance(error, jinja2.TemplateError):
            message = f"{type(error).__name__}: {message}"
        shown = {str(path): str(path) for _, path in self._texts.values()}
        shown |= {str(path): f"{_OURS}/{path.name}" for path in our_templates()}
        where = str(self._texts[name][1]) if name in self._texts else f"{_OURS}/{name}"
        for frame, line in traceback.walk_tb(error.__traceback__):
            if template := shown.get(frame.f_code.co_filename):
                where = f"{template}:{line}"  # the innermost is the last
        return f"{where}: {message}"


def templates_in(folder: Path) -> list[Path]:
    """Return what stands in a folder of templates, right or wrong, but for hidden files; sorted."""
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def _text(path: Path, folder: Path) -> str:
    """Return the text of a template; raise ValueError that says why it has none."""
    if leads_out(path, folder):
        raise ValueError("is a link out of the folder of the templates")
    try:
        return content(path).decode("utf-8-sig")  # some editors put a mark before the text
    except NotReadError as error:
        raise ValueError(str(error)) from None
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is not UTF-8") from None


def _near(name: str) -> str:
    """Return a question after those of ours that a name may mean; all their endings are alike."""
    ours = [path.name for path in our_templates()]
    stems = {_stem(known) for known in ours}
    near = get_close_matches(_stem(name.removeprefix(f"{_OURS}/")), stems)
    meant = [known for known in ours if _stem(known) in near]
    return f"; did you mean {' or '.join(meant)}?" if meant else ""


def _stem(name: str) -> str:
    return name.partition(".")[0]
