"""Parameter sets: every unit stores them by channel and returns them."""

from __future__ import annotations

import pytest
from apt_host import BAY, host_of
from parameter_sets import (
    UNITS,
    address_of,
    channel_of,
    idents_of,
    plain_sets,
    wanted_values,
)

from stagewire_apt import messages as m
from stagewire_virtual.thorlabs_apt.facts import class_of

LIVING = {
    "MOT_SET_SOL_STATE",
    "PZ_SET_OUTPUTVOLTS",
    "PZ_SET_OUTPUTPOS",
    "PZ_SET_OUTPUTMAXVOLTS",
    "MOT_SET_PMDSTAGEAXISPARAMS",
    "PZ_SET_IOSETTINGS",
    "LD_SET_MAXCURRENTDIGPOT",
    "TEC_SET_TEMPSETPOINT",
    "TEC_SET_IOSETTINGS",
    "PZ_SET_NTCIRCPARAMS",
    "PZ_SET_NTFEEDBACKSRC",
    "PZ_SET_NTTIARANGEPARAMS",
    "QUAD_SET_OPERMODE",
    "QUAD_SET_POSITIONOUTPUTS",
}
"""SETs with an action, with a live value or for all channels; other tests check these.

The channel enable state of an MPC is a mask.
"""


@pytest.mark.parametrize("unit", UNITS)
def test_a_set_changes_only_its_own_channel(unit):
    far = host_of(unit)
    channels = UNITS[unit].facts["channels"]
    tried = 0
    for set_, req, get in plain_sets(unit):
        name = set_.layout.message
        if name in LIVING or (unit.startswith("MPC") and name == "MOD_SET_CHANENABLESTATE"):
            continue
        names_channel = "chan_ident" in set_.layout.fields
        idents = idents_of(unit) if names_channel else [None]
        for number, ident in enumerate(idents, 1):
            channel = {} if ident is None else {"chan_ident": ident}
            before = {
                other: far.ask(req(chan_ident=other), address_of(unit))
                for other in idents
                if other not in (None, ident)
            }
            asked = channel or channel_of(req)
            values = wanted_values(unit, set_, number)
            far.say(set_(**channel, **values), address_of(unit))
            said = class_of(UNITS[unit], get.layout.message)
            assert far.ask(req(**asked), address_of(unit)) == [said(**channel, **values)]
            for other, answer in before.items():
                assert far.ask(req(chan_ident=other), address_of(unit)) == answer
            tried += 1
    assert tried >= channels
    assert far.refusals == []


@pytest.mark.parametrize("unit", UNITS)
def test_the_parameters_of_a_new_unit_are_within_their_ranges(unit):
    far = host_of(unit)
    for _, req, _get in plain_sets(unit):
        [told] = far.ask(req(**channel_of(req)), address_of(unit))
        assert (
            type(told)(**told.values()) == told
        )  # the constructor checks what the decoder does not


@pytest.mark.parametrize(
    ("unit", "request_", "field", "default"),
    [
        ("TDC001", m.MotReqDcPidParams(1), "filter_control", 15),  # page 52
        ("TSG001", m.PzReqTsgIoSettings(1), "force_calib", 30_000),  # page 128
        ("TPZ001", m.PzReqOutputLutParams(1), "delay_time", 1),  # the minimum on page 109
    ],
)
def test_other_values_have_the_default_of_the_registry(unit, request_, field, default):
    [told] = host_of(unit).ask(request_)
    assert told.values()[field] == default


WITH_LED = [name for name, unit in UNITS.items() if "MOT_REQ_AVMODES" in unit.messages]


@pytest.mark.parametrize("unit", WITH_LED)
def test_all_modes_of_the_led_are_enabled_by_default(unit):
    assert host_of(unit).ask(m.MotReqAvModes(1)) == [m.MotGetAvModes(1, 1 + 2 + 8)]  # page 53


def test_both_channels_are_set_and_returned_in_order():
    far = host_of("BSC002")
    far.say(m.MotSetHomeParams(3, 1, 4, 5, 6))
    assert far.ask(m.MotReqHomeParams(3)) == [
        m.MotGetHomeParams(1, 1, 4, 5, 6),
        m.MotGetHomeParams(2, 1, 4, 5, 6),
    ]


@pytest.mark.parametrize(
    ("unit", "refused", "request_"),
    [
        ("TDC001", m.MotSetVelParams(2, 0, 5, 5), m.MotReqVelParams(1)),
        ("TDC001", m.MotSetJogParams.unpack(
            bytes.fromhex("16 04 16 00 d0 01 01 00 03 00") + bytes(18)), m.MotReqJogParams(1)),
        ("TDC001", m.MotSetDcPidParams.unpack(
            bytes.fromhex("a0 04 14 00 d0 01 01 00 00 80 00 00") + bytes(14)),
         m.MotReqDcPidParams(1)),
        ("TSG001", m.PzSetTsgIoSettings.unpack(
            bytes.fromhex("da 07 0e 00 d0 01 01 00 01 00 01 00 00 00") + bytes(6)),
         m.PzReqTsgIoSettings(1)),
    ],
    ids=["unknown channel", "not in its table", "above its range", "below its range"],
)  # fmt: skip
def test_an_invalid_set_changes_nothing(unit, refused, request_):
    far = host_of(unit)
    before = far.ask(request_)
    assert far.ask(refused) == []
    assert len(far.refusals) == 1
    assert far.ask(request_) == before


def test_an_open_table_accepts_other_values():
    far = host_of("BSC001")
    far.say(m.MotSetLimSwitchParams(1, 9, 9, 1, 1, 9))
    assert far.ask(m.MotReqLimSwitchParams(1)) == [m.MotGetLimSwitchParams(1, 9, 9, 1, 1, 9)]
    assert far.refusals == []


def test_a_channel_is_enabled_until_it_is_disabled():
    far = host_of("BSC002")
    assert far.ask(m.ModReqChanEnableState(3)) == [
        m.ModGetChanEnableState(1, 1),
        m.ModGetChanEnableState(2, 1),
    ]
    far.say(m.ModSetChanEnableState(2, 2))
    assert [channel.enabled for channel in far.instrument.channels] == [True, False]
    assert far.ask(m.ModReqChanEnableState(2)) == [m.ModGetChanEnableState(2, 2)]
    far.say(m.ModSetChanEnableState(2, 1))
    assert far.instrument.channel(2).enabled


@pytest.mark.parametrize("channel", [1, 2])
def test_all_channels_share_the_output_filter_but_not_the_current_limit(channel):
    """The filter applies to all channels, whatever the channel identifier (page 119)."""

    def settings():
        answers = [far.ask(m.PzReqIoSettings(ident), BAY) for ident in (1, 2)]
        return [(answer.amp_current_lim, answer.amp_lp_filter) for [answer] in answers]

    far = host_of("MPZ601")
    far.say(m.PzSetIoSettings(3 - channel, 0, 1, 0), BAY)
    assert settings() == [(0, 1), (0, 1)]
    far.say(m.PzSetIoSettings(channel, 2, 3, 0), BAY)
    assert settings() == [(2 if ident == channel else 0, 3) for ident in (1, 2)]
    far.instrument.power_cycle()
    assert settings() == [(0, 0), (0, 0)]


def test_the_announcements_of_a_set_are_sent_unsolicited():
    far = host_of("BPC301")
    announced = far.ask(m.PzSetOutputMaxVolts(1, 1000, 0))
    assert [type(message) for message in announced] == [m.PzGetOutputMaxVolts, m.PzGetMaxTravel]


def test_a_set_refused_by_the_behaviour_is_not_stored():
    far = host_of("TPZ001", answer_unsupported=True)
    far.say(m.PzSetOutputLut(1, 512, 7))
    before = far.ask(m.PzReqOutputLut(1))
    assert far.ask(m.PzSetOutputLut(1, 513, 9)) == [
        m.HwResponse()
    ]  # page 106: 0 to 512 on a TPZ001
    assert far.ask(m.PzReqOutputLut(1)) == before
