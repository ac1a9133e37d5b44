"""Shell completion: ``stagewire completion``, and the names that complete arguments.

No port is opened: serial ports are only listed.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator
from enum import StrEnum
from typing import Annotated

import typer

EXAMPLE = """\b
Examples:
  eval "$(stagewire completion bash)"                 in ~/.bashrc
  eval "$(stagewire completion zsh)"                  in ~/.zshrc, after compinit
  stagewire completion fish > ~/.config/fish/completions/stagewire.fish
"""

_VARIABLE = "_STAGEWIRE_COMPLETE"  # set while a shell asks for completions
_BASH = """\
_stagewire_completion() {
    local line="${COMP_LINE:0:COMP_POINT}" words word prefix
    read -ra words <<< "$line"
    [[ $line == *[[:space:]] ]] && words+=("")
    word="${words[-1]#[\\"\\']}"
    # bash replaces only what follows the last colon or equals sign of a word
    prefix="${word%"${word##*[:=]}"}"
    local IFS=$'\\n'
    COMPREPLY=($(COMP_WORDS="${line% }" COMP_CWORD=$((${#words[@]} - 1)) \\
        _STAGEWIRE_COMPLETE=complete_bash "$1" 2>/dev/null))
    COMPREPLY=("${COMPREPLY[@]#"$prefix"}")
}
complete -o default -F _stagewire_completion stagewire
"""


_KINDS = ("messages", "sets", "units", "stages", "enumerations", "flags", "quantities", "aliases")
_ZSH = """\
#compdef stagewire
_stagewire_completion() {
    eval $(env _TYPER_COMPLETE_ARGS="${words[1,$CURRENT]}" \\
        _STAGEWIRE_COMPLETE=complete_zsh stagewire 2>/dev/null)
}
compdef _stagewire_completion stagewire
"""
_FISH = """\
function __stagewire_completion
    env _TYPER_COMPLETE_ARGS=(commandline -cp | string collect) _TYPER_COMPLETE_FISH_ACTION=$argv[1] \
        _STAGEWIRE_COMPLETE=complete_fish stagewire 2>/dev/null
end
complete --command stagewire --no-files --condition "__stagewire_completion is-args" \
    --arguments "(__stagewire_completion get-args)"
"""


class Shell(StrEnum):
    """The shells that completion supports."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(
    shell: Annotated[Shell, typer.Argument(help="bash, zsh or fish.", show_choices=False)],
) -> None:
    """Print the completion script of a shell.

    It completes commands, options, units, stages, messages, serial ports and virtual controllers.
    """
    typer.echo({Shell.BASH: _BASH, Shell.ZSH: _ZSH, Shell.FISH: _FISH}[shell], nl=False)


def completed_words() -> list[str] | None:
    """Return the words after ``stagewire`` on the line that a shell completes, and prepare typer for it.

    None if no shell asks.
    """
    if _VARIABLE not in os.environ:
        return None
    from typer.completion import completion_init  # type: ignore[attr-defined]

    completion_init()  # otherwise typer knows no shell
    line = os.environ.get("COMP_WORDS", "") or os.environ.get("_TYPER_COMPLETE_ARGS", "")
    try:
        return shlex.split(line)[1:]
    except ValueError:  # an open quote
        return line.split()[1:]


def units(incomplete: str) -> list[str]:
    """Return the names of units that begin with a text."""
    return _beginning(_names("units"), incomplete)


def stages(incomplete: str) -> list[str]:
    """Return the names of stages that begin with a text."""
    return _beginning(_names("stages"), incomplete)


def messages(incomplete: str) -> list[str]:
    """Return the names of messages and commands that begin with a text."""
    return _beginning(_names("messages"), incomplete)


def entries(incomplete: str) -> list[str]:
    """Return names of entries that ``show`` finds."""
    return _beginning(_names(*_KINDS), incomplete)


def urls(incomplete: str) -> list[str]:
    """Return serial ports, USB serial numbers and virtual controllers."""
    from stagewire.discovery import discover

    found = [one.port for one in discover()]
    ports = [port.device for port in found]
    numbers = [f"usb://{port.serial_number}" for port in found if port.serial_number]
    virtual = [f"virtual://{name}" for name in _names("units")]
    return _with((*ports, *numbers, *virtual, "socket://"), incomplete)


def _names(*kinds: str) -> Iterator[str]:
    """Yield the names of some kinds of entries in the registries of all protocols."""
    from stagewire.protocols import available_protocols, load_protocol

    for name in available_protocols():
        registry = load_protocol(name).registry()
        for kind in kinds:
            for entry in registry[kind]:
                yield entry if isinstance(entry, str) else entry["name"]


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    """Return the names that begin with a text, in lower case if the text is; shells compare the case."""
    if incomplete.islower():
        names = (name.lower() for name in names)
    return _with(names, incomplete)


def _with(names: Iterable[str], incomplete: str) -> list[str]:
    return sorted({name for name in names if name.startswith(incomplete)})
