"""The suite never sends a message that is not allowed, whatever a check does."""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import product

import pytest
from watched_links import MOTION, WatchedLink, controller_of, declared_as, made, run_made

import stagewire_virtual
from allowances import everything, everything_but
from parts import every_nth
from stagewire.framing import CommandReceived, End, Received
from stagewire.protocols import CommandProtocol, FramedProtocol
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_conformance.device.declaration import Declaration, declare, known_units
from stagewire_conformance.device.errors import NotAllowedError
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import ChannelPics, Pics
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.run import run
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

UNITS = sorted({*known_units()} & {*simulated_units()})
PERMISSIONS = {
    "no": Permissions(),
    "settings": Permissions(settings=True),
    "tuning": Permissions(tuning=True),
    "motion": Permissions(motion=MOTION),
    "eeprom": Permissions(eeprom=True),
    "settings+motion": Permissions(settings=True, motion=MOTION),
    "outputs": Permissions(settings=True, motion=MOTION, piezo=True, shutter=True),
    "light+heat": Permissions(laser=True, heater=True),
}
OPEN = {"none", "stream", "stop"}
HIDES = {
    "PZ_SET_IOSETTINGS": "byte 1 begins MOT_MOVE_SYNCHSTART_0A06",
    "PZ_SET_OUTPUTMAXVOLTS": "byte 1 begins PZ_SET_NTTRACKTHRESHOLD",
    "PZ_SET_PICONSTS": "byte 1 begins PZ_SET_NTTRACKTHRESHOLD",
}
"""Messages whose bytes contain the id of another that may be forbidden: then allowed, but not as bytes."""


def opened(declared: Declaration, allowed: Permissions, name: str) -> bool:
    """Return whether a message is allowed, derived independently of the suite."""
    entry = declared.registry.messages[name]
    effects = set(OPEN)
    if allowed.settings:
        effects.add("settings")
        if isinstance(declared.protocol, CommandProtocol):
            effects.add("connection")  # mode switches
    hazard = declared.hazard(name)
    if allowed.motion or hazard in ("laser", "heater"):
        effects.add("motion")
    if allowed.tuning:
        effects.add("tuning")
    if allowed.eeprom:
        effects.add("eeprom")
    return entry["effect"] in effects and (not hazard or getattr(allowed, hazard))


def said(declared: Declaration, writes: list[bytes]) -> Iterator[str]:
    """Yield the names of all messages that a controller finds in the written bytes."""
    protocol = declared.protocol
    if isinstance(protocol, FramedProtocol):
        for event in protocol.framer(End.DEVICE).feed(b"".join(writes)):
            if isinstance(event, Received):
                yield event.frame.message.layout.message
    else:
        assert isinstance(protocol, CommandProtocol)
        for event in protocol.framer().feed(b"".join(writes)):
            if isinstance(event, CommandReceived):
                yield event.frame.message.layout.message


@pytest.mark.parametrize(("unit", "granted"), every_nth(product(UNITS, PERMISSIONS), 4))
def test_no_run_sends_a_forbidden_message(unit: str, granted: str) -> None:
    allowed = PERMISSIONS[granted]
    declared = declared_as(unit)
    link = WatchedLink(SteppedLink(controller_of(unit)))
    checks = plan(declared, allowed)
    if allowed.granted:  # checks without needs run without permissions
        checks = [check for check in checks if check.needs]
    report = run(link, checks, declared, allowed, seed=3)
    assert not report.unfinished, report.unfinished
    sent = {*said(declared, link.writes)}
    if isinstance(declared.protocol, CommandProtocol):
        # This is the only way into the command format, and the format is restored afterwards.
        sent -= {"SWITCH_TO_LOW_LEVEL", "SWITCH_TO_HIGH_LEVEL"}
    assert not {name for name in sent if not opened(declared, allowed, name)}
    assert sent  # and something was sent


@pytest.mark.parametrize("allowed", PERMISSIONS.values(), ids=PERMISSIONS)
def test_every_message_is_sent_or_refused_by_its_effect(
    allowed: Permissions,
) -> None:
    declared = declare("TDC001")
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    line = AptLine(link, declared, allowed)
    host, effects = 0x01, declared.registry.messages
    sent, refused = [], []
    for message in messages_of(declared):
        name = message.layout.message
        effect = effects[name]["effect"]
        may = opened(declared, allowed, name) and not effects[name].get("not_sent")
        for is_bytes, send in enumerate(
            (
                lambda message=message: line.send(message, 0x50),
                lambda message=message: line.send_bytes(message.pack(0x50, host)),
            )
        ):
            before = len(link.writes)
            if (
                may
                and is_bytes
                and HIDES.get(name, "no message") in line.refusal(message.pack(0x50, host))
            ):
                with pytest.raises(NotAllowedError, match=HIDES[name]):
                    send()
                assert len(link.writes) == before, name
            elif may:
                send()
                assert message.pack(0x50, host) in link.writes[before:], name
                sent.append(name)
            elif effect is not None:
                with pytest.raises(NotAllowedError, match=name):
                    send()
                assert len(link.writes) == before, name
                refused.append(name)
            else:  # messages that only a controller sends
                with pytest.raises(NotAllowedError, match="controllers do not receive it"):
                    line.send(message, 0x50)
    assert len(sent) > 60
    assert len(refused) > 4


DANGEROUS = {
    "motion": ("PZ_SET_OUTPUTVOLTS", "PZ_SET_OUTPUTLUT", "PZ_SET_OUTPUTLUTPARAMS"),
    "eeprom": ("MOT_SET_EEPROMPARAMS", "PZ_SET_EEPROMPARAMS"),
    "tuning": (
        "MOT_SET_DCPIDPARAMS", "MOT_SET_PMDPOSITIONLOOPPARAMS", "MOT_SET_PMDMOTOROUTPUTPARAMS",
        "MOT_SET_PMDCURRENTLOOPPARAMS", "MOT_SET_PMDSETTLEDCURRENTLOOPPARAMS",
        "MOT_SET_KCUBEKSTLOOPPARAMS", "PZ_SET_PICONSTS", "PZ_SET_TPZ_SLEWRATES",
    ),
    "laser": ("LA_ENABLEOUTPUT", "LA_SET_POWERSETPOINT", "LD_CLOSEDLOOP", "LD_SET_MAXCURRENTDIGPOT"),
    "heater": ("TEC_SET_TEMPSETPOINT", "TEC_SET_IOSETTINGS", "TEC_SET_LOOPPARAMS"),
    "shutter": ("MOT_SET_SOL_STATE", "MOT_SET_SOL_OPERATINGMODE", "MOT_SET_SOL_CYCLEPARAMS"),
    "piezo": ("PZ_SET_OUTPUTVOLTS", "PZ_SET_NTMODE", "QUAD_SET_OPERMODE", "PZ_START_LUTOUTPUT"),
    "zero": ("PZ_SET_ZERO",),
    "inertial": ("PZMOT_SET_DRIVEOPPARAMS",),
    "never": ("MOT_SET_PZSTAGEPARAMDEFAULTS",),
}  # fmt: skip
"""Flag -> messages that are sent only with it."""
ALL_BUT = {flag: everything_but(everything(MOTION), flag) for flag in DANGEROUS}
"""Every permission but one."""
APT_UNITS = [unit for unit in UNITS if isinstance(known_units()[unit], FramedProtocol)]


@pytest.mark.parametrize("unit", APT_UNITS)
def test_a_dangerous_message_is_refused_without_its_own_flag(unit: str) -> None:
    declared = declared_as(unit)
    link = WatchedLink(SteppedLink(controller_of(unit)))
    messages = [*messages_of(declared)]
    for flag, allowed in ALL_BUT.items():
        line = AptLine(link, declared, allowed)
        dangerous = [each for each in messages if each.layout.message in DANGEROUS[flag]]
        assert {each.layout.message for each in dangerous} == {*DANGEROUS[flag]}
        for message, place in product(dangerous, declared.places):
            with pytest.raises(NotAllowedError, match=message.layout.message):
                line.send(message, place.address)
            with pytest.raises(NotAllowedError, match=message.layout.message):
                line.send_bytes(message.pack(place.address, declared.framed.host))
    assert link.writes == []


@pytest.mark.parametrize(("unit", "flag"), every_nth(product(APT_UNITS, DANGEROUS), 20))
def test_no_dangerous_message_leaves_without_its_own_flag(unit: str, flag: str) -> None:
    declared, allowed = declared_as(unit), ALL_BUT[flag]
    link = WatchedLink(SteppedLink(controller_of(unit)))
    report = run(link, plan(declared, allowed), declared, allowed, seed=3)
    assert not report.unfinished, report.unfinished
    assert not {*said(declared, link.writes)} & {*DANGEROUS[flag]}


def messages_of(declared: Declaration) -> Iterator[m.FramedMessage]:
    """Yield every message in every form, with positions inside the allowed range."""
    protocol = declared.protocol
    for cls in protocol.messages:
        layout = cls.layout
        if layout.form in ("undocumented", "data:undecided"):
            continue
        fields = declared.registry.fields(layout.message, layout.form)
        values = {field: empty(fields.get(field)) for field in layout.fields}
        yield cls.keep({**values, **({"chan_ident": 1} if "chan_ident" in values else {})})


def empty(entry: dict | None) -> object:
    if entry and entry["constant"] is not None:
        return entry["constant"]
    kind = "integer" if entry is None else entry["kind"]
    if kind == "text":
        return ""
    if kind == "array":
        return ()
    return bytes(entry["size"]) if entry and kind == "bytes" else 0


def test_a_message_that_is_not_sent_is_refused_with_every_permission() -> None:
    declared = declare("TDC001")
    every = everything(MOTION)
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    line = AptLine(link, declared, every)
    unsent = [
        message
        for message in messages_of(declared)
        if declared.registry.messages[message.layout.message].get("not_sent")
    ]
    assert unsent
    for message in unsent:
        with pytest.raises(NotAllowedError, match="no source shows which a controller obeys"):
            line.send(message, 0x50)
        assert message.layout.message in line.refusal(message.pack(0x50, 0x01))
    assert link.writes == []


@pytest.mark.parametrize(
    "raw",
    [
        m.MotMoveHome(1).pack(0x50, 0x01),
        m.MotMoveAbsolute(1, 5).pack(0x50, 0x01)[
            :8
        ],  # the next bytes may complete a truncated message
        m.MotMoveHome(1).pack(0x50, 0x01)[:2],
        m.MotReqVelParams(1).pack(0x50, 0x01) + m.MotMoveHome(1).pack(0x50, 0x01),
        b"\x00\xff\x00" + m.MotMoveHome(1).pack(0x50, 0x01),  # for a controller that is out of step
        m.MotMoveHome(1).pack(0x33, 0x07),  # for a controller that ignores addresses
        b"\xaa" + m.MotMoveHome(1).pack(0x50, 0x01)[:3],
        m.HwDisconnect().pack(0x50, 0x01),
        m.MotSetEepromParams(1, 0x0413).pack(0x50, 0x01),
    ],
    ids=lambda raw: raw.hex(),
)
def test_bytes_that_contain_a_forbidden_message_are_not_sent(raw: bytes) -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    line = AptLine(link, declare("TDC001"), Permissions(settings=True))
    assert line.refusal(raw)
    with pytest.raises(NotAllowedError, match="not allowed"):
        line.send_bytes(raw)
    assert link.writes == []


def test_a_sub_message_is_judged_apart_from_others_with_its_id() -> None:
    line = AptLine(
        WatchedLink(SteppedLink(stagewire_virtual.TDC001())),
        declare("TDC001"),
        Permissions(settings=True),
    )
    display = m.QuadSetDisplaySettings(255, 1, 0).pack(0x50, 0x01)
    outputs = m.QuadSetPositionOutputs(1, 1).pack(0x50, 0x01)
    assert line.refusal(display) == ""
    assert line.refusal(outputs).startswith("byte 0 begins QUAD_SET_POSITIONOUTPUTS")
    assert line.refusal(display[:7]).startswith(
        "byte 0 begins QUAD_SET_"
    )  # its sub-message is cut off
    assert line.refusal(b"\x00" + display).startswith("byte 1 begins QUAD_SET_")


def test_random_garbage_may_be_sent_and_moves_no_stage() -> None:
    controller = stagewire_virtual.TDC001(stage=stages.Z8)
    link = WatchedLink(SteppedLink(controller))
    line = AptLine(link, declare("TDC001"), Permissions())
    chance = random.Random(7)
    refused = 0
    for _ in range(300):
        raw = chance.randbytes(chance.randrange(1, 60))
        refused += bool(line.refusal(raw))
        if not line.refusal(raw):
            line.send_bytes(raw)
    assert refused < 30
    line.drain()
    assert all(effect_is_open(name) for name in said(line.declared, link.writes))


def effect_is_open(name: str) -> bool:
    return declare("TDC001").registry.messages[name]["effect"] in OPEN


def test_a_target_outside_the_range_is_not_sent() -> None:
    pics = Pics(unit="TDC001", channels=(ChannelPics(stage="Z8", travel=Range.parse("0..12mm")),))
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001(stage=stages.Z8)))
    line = AptLine(link, declare(pics), Permissions(motion=Range.parse("1..20mm")))
    for counts in (34303, 411649, -1):
        with pytest.raises(NotAllowedError, match=r"is outside 34304\.\.411648"):
            line.send(m.MotMoveAbsolute(1, counts), 0x50)
    with pytest.raises(NotAllowedError, match="no unit is declared at this address"):
        line.send(m.MotMoveAbsolute(1, 34304), 0x21)
    with pytest.raises(NotAllowedError, match="channel 2 is not declared at this address"):
        line.send(m.MotMoveHome(2), 0x50)
    assert link.writes == []
    moves = [m.MotMoveAbsolute(1, 34304), m.MotMoveAbsolute(1, 411648)]
    with line.silent():
        for move in moves:
            line.send(move, 0x50)
    assert link.writes == [move.pack(0x50, 0x01) for move in moves]


def test_a_range_in_mm_is_refused_for_an_unknown_stage() -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    line = AptLine(link, declare("TDC001"), Permissions(motion=Range.parse("1..20mm")))
    with pytest.raises(NotAllowedError, match="the number of counts per mm is not known"):
        line.send(m.MotMoveAbsolute(1, 34304), 0x50)


def test_a_check_that_sends_a_forbidden_message_ends_the_run_as_a_defect() -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    report = run_made(
        link,
        made(lambda trial: trial.line.send(m.MotMoveHome(1), 0x50)),
        allowed=Permissions(settings=True),
    )
    assert isinstance(report.defect, NotAllowedError)
    assert "MOT_MOVE_HOME to 0x50 is not allowed: its effect is motion" in report.unfinished
