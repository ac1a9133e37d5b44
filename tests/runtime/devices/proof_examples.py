"""The worked examples of the documents, the calls in ``worked_calls/``, and a function to perform one."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from proof_controller import answers_of, channel_of
from proof_line import FarEnd, Side, settled

import plain_yaml
from checkout import ROOT
from stagewire import End
from stagewire.protocols import DATA_FLAG, load_protocol
from stagewire_conformance.notation import octets

CALLS = Path(__file__).parent / "worked_calls"


_protocol = cache(load_protocol)  # loading reads the metadata of all installed packages


@cache
def read(folder: Path, protocol: str) -> Any:
    return plain_yaml.read(folder / f"{protocol}.yaml")


@cache
def examples(protocol: str) -> dict[str, Any]:
    found: dict[str, Any] = plain_yaml.read(ROOT / "spec" / protocol / "examples.yaml")["examples"]
    return found


def correct(protocol: str, name: str) -> bytes:
    """Return the bytes of an example, corrected if the document is wrong."""
    entry = examples(protocol)[name]
    if "shown" in entry:  # shown by a terminal; the reply is a letter or a word
        return str(entry.get("corrected", entry["shown"])).encode("ascii")
    return octets(entry, "encoded" if "encoded" in entry else "printed")


def made(protocol: str, what: Any, source: int | None, own: str) -> bytes:
    """Return the bytes of an answer: those of an example, or of a message and its fields."""
    if what is True:
        return correct(protocol, own)
    if isinstance(what, str):
        known = what in examples(protocol)
        return correct(protocol, what) if known else bytes.fromhex(what)
    [(message, fields)] = what.items()
    return frame_of(message, source or 0x50, **fields)


def frame_of(message: str, source: int, **given: Any) -> bytes:
    """Return a frame to the host; other fields are 0."""
    cls = next(
        cls
        for cls in _protocol("thorlabs_apt").messages
        if cls.layout.message == message
        and not cls.layout.when
        and "undecided" not in cls.layout.form
    )
    blank = cls.unpack(bytes(6 + cls.layout.length)).values()
    return cls(**{**blank, **given}).pack(dest=0x01, source=source)


def tables_of(protocol: str) -> dict[str, Any]:
    """Return the modules that calls and values abbreviate as e, f and m."""
    package = _protocol(protocol).package
    rooms = ("enumerations", "flags", "messages")
    return {room[0]: import_module(f"{package}.{room}") for room in rooms}


class Recorder(FarEnd):
    """A controller that records all messages except keep-alive messages, and sends given answers once.

    :ivar moves: whether the call starts a motion. If so, the library's requests about it are answered with
        values that allow the motion, zeros as far as possible, and not recorded.
    """

    def __init__(self, protocol: str) -> None:
        self._framer = _protocol(protocol).framer(*[End.DEVICE] * (protocol == "thorlabs_apt"))
        self.heard: list[Any] = []
        self.kept_alive: list[bytes] = []
        self.to_say: list[bytes] = []
        self.moves = False
        self._package = _protocol(protocol).package

    def _reply(self, frame: Any) -> bytes:
        """Return the reply to a request, filled with zeros; empty for other messages."""
        message = frame.message
        if self._package == "stagewire_apt":
            cls: Any = answers_of().get(type(message))
            if cls is None:
                return b""
            usable = {"home_velocity": 1} if "home_velocity" in cls.layout.fields else {}
            return frame_of(
                cls.layout.message, frame.dest, chan_ident=channel_of(message), **usable
            )
        cls = message.reply
        return b"" if cls is None else cls(**dict.fromkeys(cls.layout.fields, 0)).pack()

    def take(self, data: bytes) -> list[tuple[float, bytes]]:
        said = []
        for event in self._framer.feed(data):
            if "_ACK_" in type(event.frame.message).layout.message:
                self.kept_alive.append(event.raw)
                continue
            if self.moves and (reply := self._reply(event.frame)):
                said.append((0.01, reply))
                continue
            self.heard.append(event)
            said += [(0.01, answer) for answer in self.to_say]
            self.to_say.clear()
        return said


def perform(side: Side, protocol: str, entry: Any, *answers: bytes, wait: float = 0.0) -> Any:
    """Open the unit of an entry, make its call, and return its result, the controller and its events."""
    package = _protocol(protocol).package
    far = Recorder(protocol)
    options = dict(entry.get("open", {}))
    if "stage" in options:
        options["stage"] = getattr(import_module(f"{package}.stages"), options["stage"])
    names = tables_of(protocol)

    async def scenario(bench: Any) -> Any:
        if protocol == "thorlabs_apt":
            options["identify"] = False
        far.moves = "ends" in entry or ".start_" in entry["call"] or ".home(" in entry["call"]
        if "ends" in entry:
            options["target_tolerance_counts"] = 1 << 32  # the recorder does not move
        async with bench.open(entry["unit"], package, on_close="leave", **options) as device:
            if ".axis(" in entry["call"]:
                await settled(device.switch_to_low_level())
            far.heard.clear()
            far.to_say += answers
            call = compile(entry["call"].strip(), entry["call"], "eval")
            value = await settled(eval(call, {**names, entry["unit"].lower(): device}))
            if entry.get("unasked"):
                far.say(answers[0])
                far.to_say.clear()
                value = await settled(value.get(1.0))
            if wait:
                await bench.sleep(wait)
            return value, far, list(far.heard)

    return side.run(far, scenario)


def expected(protocol: str, name: str, entry: Any) -> bytes:
    sends = entry.get("sends", name)
    return correct(protocol, sends) if sends in examples(protocol) else bytes.fromhex(sends)


def replies(protocol: str, name: str, entry: Any) -> list[bytes]:
    if "answer" in entry:
        return [made(protocol, entry["answer"], entry.get("source"), name)]
    if "ends" not in entry:
        return []
    frame = correct(protocol, entry.get("sends", name)) if "counts" not in entry else b""
    source = frame[4] & ~DATA_FLAG if frame else 0x22  # an example in prose uses bay 2
    return [frame_of(entry["ends"], source, chan_ident=1)]
