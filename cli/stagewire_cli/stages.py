"""The stage of a command: one of the registry, or of a TOML file of the user."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli import completion
from stagewire_cli.errors import CalledWronglyError

if TYPE_CHECKING:
    from stagewire import Stage

StageName = Annotated[
    str | None,
    typer.Option(
        "--stage",
        metavar="NAME",
        help="Stage on the controller, such as Z8; needed for mm and degrees.",
        autocompletion=completion.stages,
    ),
]
StagesFile = Annotated[
    Path | None,
    typer.Option(
        "--stages",
        metavar="FILE",
        envvar="STAGEWIRE_STAGES",
        help="TOML file with your own stages, which --stage or a PICS can name.",
    ),
]


def own_stages(file: Path | None) -> dict[str, Stage]:
    """Return the stages of a file by name; raise :class:`CalledWronglyError` if it is invalid."""
    if file is None:
        return {}
    from stagewire import read_stages
    from stagewire.errors import BadValueError

    try:
        return read_stages(file)
    except BadValueError as error:
        raise CalledWronglyError(f"--stages {error}") from None
    except OSError as error:
        raise CalledWronglyError(f"--stages {file}: {error.strerror or error}") from None


def known_stages() -> dict[str, Stage]:
    """Return the stages of all registries by each of their names, those of catalogues included."""
    from stagewire.quantities import stages_of
    from stagewire_cli.protocols import one_or_all

    found: dict[str, Stage] = {}
    for protocol in one_or_all(None):
        if protocol.registry().get("stages"):
            stages = stages_of(protocol.package)
            found |= {name: stage for stage in stages for name in stage.catalogue}
            found |= {stage.name: stage for stage in stages}
    return found


def chosen_stage(name: str | None, file: Path | None) -> Stage | str | None:
    """Return the stage of the user with a name in any case, or else the name, which is in a registry.

    Raises :class:`CalledWronglyError` for an unknown name, and for an invalid file.
    """
    own = own_stages(file)  # also without a name, to report a wrong file
    if name is None:
        return None
    for known, stage in own.items():
        if known.upper() == name.upper():
            return stage
    names = {known.upper(): known for known in (*own, *known_stages())}
    if name.upper() in names:
        return name
    close = difflib.get_close_matches(name.upper()[:80], names, n=3)
    like = f"; did you mean {' or '.join(names[word] for word in close)}?" if close else ""
    raise CalledWronglyError(
        f"--stage: unknown stage {name}{like} (stagewire show stages lists all; --stages FILE adds your own)"
    )


def check_unit(name: str) -> None:
    """Raise :class:`CalledWronglyError` for a unit that no registry has."""
    from stagewire_cli.protocols import one_or_all

    registries = [protocol.registry() for protocol in one_or_all(None)]
    units = {entry["name"] for registry in registries for entry in registry.get("units", ())}
    known = {
        unit.upper(): unit
        for unit in units.union(*(each.get("aliases", ()) for each in registries))
    }
    if name.upper() not in known:
        close = difflib.get_close_matches(name.upper()[:80], known)
        hint = f"did you mean {' or '.join(close)}?" if close else "stagewire show units lists all"
        raise CalledWronglyError(f"--unit: unknown unit {name}; {hint}")


def one_stage(name: str, file: Path | None, unit: str | None) -> Stage:
    """Return the stage with a name in any case, preferably one that is known on a unit.

    Raises :class:`CalledWronglyError` for an unknown name, and for one of several stages.
    """
    from stagewire.quantities import find_stages
    from stagewire_cli.protocols import one_or_all

    chosen = chosen_stage(name, file)
    if not isinstance(chosen, str):
        assert chosen is not None
        return chosen
    found = [
        stage
        for protocol in one_or_all(None)
        if protocol.registry().get("stages")
        for stage in find_stages(protocol.package, chosen)
    ]
    usable = [stage for stage in found if unit and stage.is_known_on(unit)] or found
    if len(usable) > 1:
        several = ", ".join(f"{stage.name} ({stage.title})" for stage in usable)
        raise CalledWronglyError(
            f"--stage: {name} is the catalogue name of several stages; choose {several}"
        )
    return usable[0]
