"""What the docstring of a generated class says: what it is for, its fields, its errata."""

from __future__ import annotations

import ast

import pytest

DOCSTRINGS = {
    "PosSetVelParams": """\
``POS_SET_VELPARAMS`` (0x0101), to the controller, 14 bytes of data; page 4.

Sets the velocity parameters. Speed of the next move.

Kept until the device is switched off.

:param chan_ident: :class:`~.Channel`; from 0 to 65535; by default 1.
:param min_velocity: always zero at present; in counts; the scale to mm/s depends on the stage;
    from 0 to 1000; by default 0.
:param max_velocity: in counts; the scale to mm/s depends on the stage; from 0 to 4294967295.
:param wait: in counts of 512/5 us; from -32768 to 32767.
:param marker: always 0x1234; from 0 to 65535.""",
    "PosReqVelParams": """\
``POS_REQ_VELPARAMS`` (0x0102), to the controller, header only; page 4.

Requests the velocity parameters. Speed of the next move.

Answered by ``POS_GET_VELPARAMS``.

:param chan_ident: :class:`~.Channel`; from 0 to 255.""",
    "PosMoveHeader": """\
``POS_MOVE`` (0x0120), to the controller, header only; page 4.

Moves to a position.

Completes with ``POS_MOVED``. Muted by ``POS_ALIVE``.

Not without a slide.

To the stored position.

:param chan_ident: :class:`~.Channel`; from 0 to 255.

Erratum ``tiny-move-length``: printed 08; encoded 06.""",
    "PosMovedHeader": """\
``POS_MOVED`` (0x0121), to the host, header only; pages 5, 6.

Reports that the target is reached.

:param chan_ident: from 0 to 255.
:param param2: always 0x07; from 0 to 255.""",
    "PosMovedServo": """\
``POS_MOVED`` (0x0121), to the host, 14 bytes of data; pages 5, 6.

Reports that the target is reached.

This layout: status servo.

With a servo.

:param chan_ident: :class:`~.Channel`; from 0 to 65535.
:param position: in counts; the scale to mm depends on the stage; from -2147483648 to
    2147483647.
:param velocity: in counts; the scale to mm/s depends on the stage; from 0 to 65535.
:param reserved: reserved, sent as zero; from 0 to 65535.
:param status_bits: :class:`~.StateBits`; from 0 to 4294967295.""",
    "PosMovedCoil": """\
``POS_MOVED`` (0x0121), to the host, 14 bytes of data; pages 5, 6.

Reports that the target is reached.

This layout: status coil.

:param chan_ident: :class:`~.Channel`; from 0 to 65535.
:param position: from -2147483648 to 2147483647.
:param encoder_count: in counts; unit and scale depend on display_mode; from -2147483648 to
    2147483647.
:param status_bits: :class:`~.CoilBits`; from 0 to 4294967295.""",
    "PosMovedUndecided": """\
``POS_MOVED`` (0x0121) whose layout no context has decided; page 5.

Reports that the target is reached. Bytes do not tell its layouts apart (status servo or status
coil). The fields that all of them share can be read; it encodes back from ``data`` alone.""",
    "PosEcho": """\
``POS_ECHO`` (0x0122), either way, 16 bytes of data; page 6.

Returns the received data.

:param label: text of at most 8 characters.
:param blob: 6 bytes.
:param load: in counts; the scale to percent depends on maximum_volts; from 0 to 65535.""",
    "Lamp": """\
``LAMP`` (0x0201), to the controller, 4 bytes of data; page 7.

Switches the lamp.

:param sample_time: in counts; the scale to ms depends on the unit; from 0 to 65535.
:param force: in counts; the scale to Pa is unknown; from 0 to 65535.""",
    "LampTest": """\
``LAMP_TEST`` (0x0202), to the controller, layout not documented; page 7.

Named, but not described.

Erratum ``tiny-lamp-test``: printed the names; encoded messages without a layout.""",
}


COMMANDS = {
    "Wake": """\
``WAKE`` (0xFE 0x57), two bytes.

Wakes the turtle.

It never snaps.

Firmware 1.3: At once.

Section Setup. Typed as ``W`` after the prefix.""",
    "GoTo": """\
``GO_TO`` (0x47), 6 bytes of data, size 6.

Walks to a place.

Stops ``HALT``.

Slowly.

Two numbers.

Section Go to. Typed as ``G``.

:param place: in counts, 10 per um; from -8388608 to 8388607.
:param height: from 0 to 1000.

Erratum ``turtle-height``: printed 1; encoded 0.""",
    "Mood": """\
``MOOD`` (0x3F), no data, no size slot.

Requests the mood.

Section Mood. Typed as ``?``.""",
    "MoodReply": """\
The reply to ``MOOD``, 1 byte.

It has no frame: only the command that was sent says what its bytes are.

:param mood: :class:`~.Feeling`; from 0 to 255.""",
    "WhereReply": """\
The reply to ``WHERE``, 7 bytes.

It has no frame: only the command that was sent says what its bytes are.

Place, height and eyes.

:param place: of the nose; in counts, 10 per um; from -8388608 to 8388607.
:param height: from 0 to 16777215.
:param eyes_wide: :class:`~.Eyes`; from 0 to 255.""",
    "Spin": """\
``SPIN`` (0x53), 2 bytes of data, size 2.

Spins.

A dummy function: refused unless ``allow_dummy`` is given.

Section Spin (about). Typed as ``S``.

:param turns: from -32768 to 32767; by default 1.

Erratum ``turtle-spin-byte``: printed 0x35; encoded 0x53.""",
    "Name": """\
``NAME`` (0x4E), 4 bytes of data, size 4.

Sets the name, and returns the old one.

Firmware 1.5: Names may be long.

Section Name. Typed as ``N``.

:param name: text of at most 3 characters.
:param spare: reserved, sent as zero; from 0 to 255.""",
    "Halt": """\
``HALT`` (0x48), no data, size 0.

Stops immediately.

Section Halt. Typed as ``H``.

Erratum ``turtle-stop``: printed Stop; encoded Halt.""",
}


def docstring(files: dict[str, str], name: str) -> str | None:
    modules = [
        text for path, text in files.items() if "/messages/" in path and path.endswith(".py")
    ]
    [found] = [
        node
        for text in modules
        for node in ast.parse(text).body
        if isinstance(node, ast.ClassDef) and node.name == name
    ]
    return ast.get_docstring(found)


@pytest.mark.parametrize("name", DOCSTRINGS)
def test_docstring(files: dict[str, str], name: str) -> None:
    assert docstring(files, name) == DOCSTRINGS[name]


@pytest.mark.parametrize("name", COMMANDS)
def test_docstring_of_a_command(command_files: dict[str, str], name: str) -> None:
    assert docstring(command_files, name) == COMMANDS[name]
