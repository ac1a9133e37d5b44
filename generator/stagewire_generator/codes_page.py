"""Makes ``docs/diagnostics.md`` from the table of codes.

``python -m stagewire_generator.codes_page FILE`` writes it.
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from stagewire_generator.codes import GROUPS, Code

_WIDTH = 110

_HEAD = """\
<!-- Made by `python -m stagewire_generator.codes_page docs/diagnostics.md` from its table; edit that. -->
# Diagnostics

`stagewire check` and `stagewire generate` report everything that is wrong with a spec in one run, sorted by
file and line, and then end with exit code 1; nothing is written. Each message reads

```text
spec/thorlabs_apt/messages/motor.yaml:97:3: SW031 MOT_VELPARAMS: the fields take 14 bytes, the length is 12
    hint: correct the length or the fields
```

that is file (from the current folder), line, column, code, what is wrong, and what to do about it.
`stagewire check --explain SW031` prints what stands here, and `stagewire check --format json|github|junit`
reports for programs. Codes are stable: one that is no longer needed is not given to something else.
`tests/generator/bad_specs/` has at least one broken spec for each, with the messages that it brings in
its first comments.
"""


def anchor(name: str) -> str:
    """Return where the page explains a code, as a link from the top of the project."""
    return f"docs/diagnostics.md#{name.lower()}"


def page() -> str:
    """Return the whole page, as Markdown; every code is a heading, and so an anchor."""
    parts = [_HEAD]
    for group in GROUPS:
        parts += [f"## {group.title}\n", _filled(group.introduction)]
        for name, code in group.codes.items():
            parts += [f"### {name}\n", *_explained(code)]
    return "\n".join(parts)


def _explained(code: Code) -> list[str]:
    return [
        _filled(f"**{_sentence(code.title)}**"),
        _filled(f"Cause: {code.cause}"),
        _filled(f"Cure: {_sentence(code.hint)}"),
    ]


def _sentence(text: str) -> str:
    """Return a title or hint as a sentence."""
    return f"{text[:1].upper()}{text[1:]}."


def _filled(text: str) -> str:
    lines = textwrap.wrap(text, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8", newline="\n")
