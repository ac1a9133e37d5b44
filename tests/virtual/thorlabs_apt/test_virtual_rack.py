"""Motherboards, bays, and the USER IO connector (pages 23 to 26)."""

from __future__ import annotations

import pytest
from apt_host import BAY, MOTHERBOARD, USB, Host, host_of

from stagewire.errors import EncodeError
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import BadOptionError, UnknownPartError
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options, Settings
from stagewire_virtual.thorlabs_apt.instrument import rack_of

OCCUPIED, EMPTY = 1, 2


def rack(*names: str | None, **options) -> Host:
    units = [find_unit(name) if name else None for name in names]
    return Host(rack_of(units, SteppedClock(), Options(**options)))


def used(far: Host, address: int = MOTHERBOARD) -> list[int]:
    """Return the bays that are reported as used."""
    answers = [far.ask(m.RackReqBayUsed(bay), address) for bay in range(10)]
    assert all(len(answer) == 1 for answer in answers)
    for bay, [answer] in enumerate(answers):
        assert answer == m.RackGetBayUsed(bay, answer.bay_state)
        assert answer.bay_state in (OCCUPIED, EMPTY)
    return [bay for bay, [answer] in enumerate(answers) if answer.bay_state == OCCUPIED]


@pytest.mark.parametrize(
    ("unit", "address", "bays"),
    [
        ("BBD101", MOTHERBOARD, [0]),
        ("BSC103", MOTHERBOARD, [0, 1, 2]),
        ("MPZ601", MOTHERBOARD, [0]),
        ("BPC301", USB, [0]),
    ],
)
def test_the_used_bays_are_reported(unit, address, bays, host):
    assert used(host(unit), address) == bays


def test_an_empty_bay_is_reported_and_does_not_answer(host):
    far = host("BSC103", empty_bays=frozenset({2}))
    assert used(far) == [0, 2]
    assert far.ask(m.HwReqInfo(), MOTHERBOARD)[0].nchs == 2
    assert far.ask(m.HwReqInfo(), BAY + 1) == []
    assert len(far.ask(m.HwReqInfo(), BAY + 2)) == 1


@pytest.mark.parametrize("address", [BAY, BAY + 1])
def test_a_bay_does_not_report_the_others(address, host):
    assert host("BSC103").ask(m.RackReqBayUsed(0), address) == []


def test_an_unknown_bay_is_refused(host):
    far = host("BSC103", answer_unsupported=True)
    assert far.ask(m.RackReqBayUsed(10), MOTHERBOARD) == [m.HwResponse()]


def test_a_motherboard_has_no_channels(host):
    far = host("BSC103", answer_unsupported=True)
    assert far.ask(m.MotReqVelParams(1), MOTHERBOARD) == [m.HwResponse()]
    assert far.ask(m.ModSetChanEnableState(1, 2), MOTHERBOARD) == [m.HwResponse()]
    assert far.ask(m.MotSetEepromParams(1, 0x0413), MOTHERBOARD) == [m.HwResponse()]
    assert far.ask(m.MotAckDcStatusUpdate(), MOTHERBOARD) == [m.HwResponse()]
    assert far.refusals[-1] == "BSC103 at 0x11: it does not accept MOT_ACK_DCSTATUSUPDATE"
    assert far.ask(m.HwStartUpdateMsgs(10), MOTHERBOARD) == []
    far.clock.advance(1)
    assert far.heard() == []


def test_bays_keep_parameters_of_their_own(host):
    far = host("BBD102")
    before = far.ask(m.MotReqVelParams(1), BAY)
    far.say(m.MotSetVelParams(1, 0, 11, 22), BAY + 1)
    assert far.ask(m.MotReqVelParams(1), BAY) == before
    assert far.ask(m.MotReqVelParams(1), BAY + 1) == [m.MotGetVelParams(1, 0, 11, 22)]


def test_outputs_are_stored_and_inputs_are_the_status(host):
    far = host("BSC103")
    io = far.instrument.user_io()
    far.say(m.RackSetDigOutputs(0x0A), MOTHERBOARD)
    assert io.outputs == 0x0A
    io.inputs = 0x05
    # In a card slot system both belong to the motherboard, whatever the address of the request.
    for address in (MOTHERBOARD, BAY, BAY + 2):
        assert far.ask(m.RackReqDigOutputs(), address) == [m.RackGetDigOutputs(0x0A)]
        assert far.ask(m.RackReqStatusBits(), address) == [m.RackGetStatusBits(0x05)]
    far.say(m.RackSetDigOutputs(0xFF), BAY + 1)
    assert far.ask(m.RackReqDigOutputs(), MOTHERBOARD) == [m.RackGetDigOutputs(0x0F)]
    far.instrument.power_cycle()
    assert (io.outputs, io.inputs) == (0, 0x05)


def test_the_answer_of_a_bay_is_the_example_of_page_25(host):
    far = host("BSC103")
    far.say(m.RackReqStatusBits(), BAY + 1)
    assert far.heard_raw() == [bytes.fromhex("27 02 04 00 81 22 00 00 00 00")]


@pytest.mark.parametrize("inputs", [-1, 1 << 32, "high"])
def test_inputs_that_do_not_fit_are_refused(inputs, host):
    io = host("BSC103").instrument.user_io()
    with pytest.raises(EncodeError, match="status_bits must be"):
        io.inputs = inputs
    assert io.inputs == 0


def test_each_module_has_its_own_connector():
    far = rack("MST601", "MST601")
    far.instrument.user_io(2).inputs = 0x02
    far.say(m.RackSetDigOutputs(0x01), BAY)
    assert far.ask(m.RackReqStatusBits(), BAY) == [m.RackGetStatusBits(0)]
    assert far.ask(m.RackReqStatusBits(), BAY + 1) == [m.RackGetStatusBits(2)]
    assert far.ask(m.RackReqDigOutputs(), BAY) == [m.RackGetDigOutputs(1)]
    assert far.ask(m.RackReqDigOutputs(), BAY + 1) == [m.RackGetDigOutputs(0)]
    assert far.ask(m.RackReqDigOutputs(), MOTHERBOARD) == [m.RackGetDigOutputs(0)]


def test_a_rack_can_have_different_modules():
    far = rack("MST601", None, "MPZ601")
    assert used(far) == [0, 2]
    models = {a: far.ask(m.HwReqInfo(), a) for a in (MOTHERBOARD, BAY, BAY + 1, BAY + 2)}
    assert [info.model_number for answer in models.values() for info in answer] == [
        "RACK",
        "MST601",
        "MPZ601",
    ]
    assert len(far.ask(m.PzReqMaxTravel(2), BAY + 2)) == 1
    assert far.ask(m.PzReqMaxTravel(2), BAY) == []
    assert [row.part for row in far.instrument.rows()] == [
        "motherboard",
        "bay 1, channel 1",
        "bay 1, channel 2",
        "bay 3, channel 1",
        "bay 3, channel 2",
    ]


def test_the_last_bay_has_the_last_address():
    far = rack(*[None] * 9, "MST601")
    assert [frame for a in range(BAY, BAY + 10) for frame in far.ask(m.HwReqInfo(), a)] == far.ask(
        m.HwReqInfo(), 0x2A
    )


def test_settings_apply_bay_by_bay_and_the_last_one_to_the_rest():
    settings = tuple(Settings(position=place) for place in (10, 20, 30))
    instrument = rack("MST601", None, "MST601", channels=settings).instrument
    assert [channel.settings.position for channel in instrument.channels] == [10, 20, 30, 30]
    assert instrument.channel(1, bay=3).settings.position == 30
    assert instrument.channel(2).settings.position == 20


def test_parts_are_found_and_blocked_by_name(host):
    instrument = host("BBD102").instrument
    instrument.stick("bay 2, channel 1", True)
    assert [channel.stuck for channel in instrument.channels] == [False, True]
    instrument.stick("bay 2, channel 1", False)
    assert not instrument.channels[1].stuck
    for wrong in (
        lambda: instrument.stick("channel 1", True),
        lambda: instrument.channel(2),
        lambda: instrument.channel(1, bay=3),
        lambda: instrument.stick("motherboard", True),
    ):
        with pytest.raises(UnknownPartError, match="bay 1, channel 1, bay 2, channel 1"):
            wrong()
    with pytest.raises(UnknownPartError, match=r"no bay 8 .*bay 1, bay 2"):
        instrument.user_io(8)


def test_a_unit_without_bays_reports_that_in_the_error(host):
    instrument = host("TDC001").instrument
    with pytest.raises(UnknownPartError, match=r"no channel 2 \(available: channel 1\)"):
        instrument.channel(2)
    with pytest.raises(UnknownPartError, match="no bay 2, channel 1"):
        instrument.channel(1, bay=2)
    with pytest.raises(UnknownPartError, match=r"no bay 1 \(none available\)"):
        instrument.user_io(1)


def test_a_stuck_axis_continues_when_released(host):
    far = host("BSC103")
    far.say(m.MotMoveVelocity(1, 1), BAY + 1)
    far.clock.advance(0.5)
    far.instrument.stick("bay 2, channel 1", True)
    [before] = far.ask(m.MotReqPosCounter(1), BAY + 1)
    far.clock.advance(0.5)
    assert far.ask(m.MotReqPosCounter(1), BAY + 1) == [before]
    far.instrument.stick("bay 2, channel 1", False)
    far.clock.advance(0.5)
    [after] = far.ask(m.MotReqPosCounter(1), BAY + 1)
    assert 0 < before.position < after.position


@pytest.mark.parametrize(
    ("unit", "options", "message"),
    [
        ("BSC103", {"empty_bays": frozenset({4})}, r"BSC103 has no bay 4 .*1 to 3"),
        ("BSC103", {"empty_bays": frozenset({0})}, r"BSC103 has no bay 0 .*1 to 3"),
        ("TDC001", {"empty_bays": frozenset({1})}, r"TDC001 has no bay 1 .*it has no bays"),
        (
            "TDC001",
            {"channels": (Settings(),) * 2},
            r"settings for 2 channels were given, but TDC001 has 1",
        ),
        ("TDC001", {"quirks": frozenset({"talkative"})}, r"no quirk talkative .*long_status"),
        ("TDC001", {"strategies": {"colon_in_data": "ends"}}, r"no strategy .*none available"),
    ],
)
def test_an_unsupported_option_is_refused(unit, options, message):
    with pytest.raises(BadOptionError, match=message):
        host_of(unit, **options)


def test_a_stage_must_be_known_on_one_of_the_modules():
    with_stage = {"channels": (Settings(stage=stages.MLS203),)}
    unknown = "the scales of MLS203 on MST601 are unknown"
    for make in (rack, host_of):
        with pytest.raises(BadOptionError, match=unknown):
            make("MST601", **with_stage)
    assert rack("MST601", "MPZ601", channels=(Settings(stage=stages.APT_STEPPER),))
    assert rack(None, None).instrument.channels == ()


@pytest.mark.parametrize(
    ("modules", "message"),
    [(["TDC001"], "TDC001 is not a module"), ([None] * 11, "at most 10 bays, not 11")],
)
def test_an_invalid_rack_is_refused(modules, message):
    with pytest.raises(BadOptionError, match=message):
        rack(*modules)
