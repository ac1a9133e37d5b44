"""The messages of each unit of Issue 3: its printed list with additions, or that of its family, resolved."""

from __future__ import annotations

import json
from typing import Any

import pytest

from checkout import ROOT
from stagewire_generator import check, render

Json = dict[str, Any]
REGISTRY: Json = json.loads(
    render(check(ROOT / "spec" / "thorlabs_apt", base=True), ["registry"])[
        "registry/thorlabs_apt.json"
    ]
)
UNITS: dict[str, Json] = {unit["name"]: unit for unit in REGISTRY["units"]}
MESSAGES: dict[str, Json] = {message["name"]: message for message in REGISTRY["messages"]}

# Pages 27 and 93, in their order.
NAMES = """
    BSC001 BSC002 BMS001 BMS002 MST601 BSC101 BSC102 BSC103 BBD101 BBD102 BBD103 BBD201 BBD202 BBD203
    OST001 ODC001 TST001 TDC001 TSC001
    BPC001 BPC002 MPZ601 BPC101 BPC102 BPC103 BPC201 BPC202 BPC203 BPC301 TPZ001 TSG001
"""

# Number of rows in the lists on pages 131 to 138, and the messages that the registry adds.
ROWS = {
    "BPC201": (49, []),
    "BPC202": (49, []),
    "BPC203": (49, []),
    "BPC301": (52, ["PZ_GET_MAXTRAVEL"]),
    "TPZ001": (41, []),
    "TSG001": (26, []),
    "MPZ601": (48, []),
    "TDC001": (63, ["MOT_GET_DCSTATUSUPDATE"]),
    "TSC001": (34, []),
}

# Typed from the document: from the printed list of a unit, or else from the pages about the unit.
HAS = {
    # page 77: stepper controllers; page 80: any controller on USB requires keep-alive messages
    "BSC001": """
        MOD_IDENTIFY HW_DISCONNECT MOT_MOVE_HOME MOT_SET_LIMSWITCHPARAMS
        MOT_GET_STATUSUPDATE MOT_ACK_DCSTATUSUPDATE
    """,
    # pages 7, 25 and 26 name the BSC103
    "BSC103": """
        RACK_REQ_BAYUSED RACK_GET_STATUSBITS RACK_SET_DIGOUTPUTS MOT_REQ_STATUSUPDATE
        MOT_GET_STATUSUPDATE
    """,
    # page 17: a module with two channels; pages 25 and 26: the modular rack
    "MST601": "RACK_REQ_STATUSBITS RACK_GET_DIGOUTPUTS MOT_MOVE_JOG MOT_GET_STATUSUPDATE",
    # pages 61 to 76 and 79
    "BBD102": """
        MOT_SET_PMDPOSITIONLOOPPARAMS MOT_GET_PMDCURRENTLOOPPARAMS
        MOT_SET_PMDSTAGEAXISPARAMS MOT_GET_DCSTATUSUPDATE RACK_REQ_BAYUSED
        RACK_REQ_STATUSBITS MOT_SET_EEPROMPARAMS
    """,
    "BBD101": "MOT_SET_PMDPOSITIONLOOPPARAMS MOT_GET_DCSTATUSUPDATE RACK_REQ_BAYUSED",
    # page 24: T-Cubes; pages 53, 55 and 58: control keypad
    "TST001": """
        HUB_REQ_BAYUSED HUB_GET_BAYUSED MOT_SET_AVMODES MOT_GET_POTPARAMS
        MOT_SET_BUTTONPARAMS MOT_GET_STATUSUPDATE
    """,
    "ODC001": "MOT_SET_POTPARAMS MOT_GET_DCSTATUSUPDATE MOT_REQ_STATUSBITS",
    # page 136
    "TDC001": """
        MOT_SET_POSCOUNTER MOT_MOVE_STOP MOT_MOVE_STOPPED MOT_SET_DCPIDPARAMS
        MOT_GET_AVMODES MOT_GET_POTPARAMS MOT_GET_BUTTONPARAMS MOT_REQ_DCSTATUSUPDATE
        MOT_GET_DCSTATUSUPDATE MOT_ACK_DCSTATUSUPDATE MOT_RESUME_ENDOFMOVEMSGS
    """,
    # page 138
    "TSC001": """
        HUB_REQ_BAYUSED MOT_MOVE_ABSOLUTE MOT_MOVE_COMPLETED MOT_MOVE_STOP
        MOT_SET_EEPROMPARAMS MOT_GET_STATUSUPDATE MOT_SET_SOL_OPERATINGMODE
        MOT_GET_SOL_CYCLEPARAMS MOT_REQ_SOL_INTERLOCKMODE MOT_GET_SOL_STATE
    """,
    # page 131
    "BPC001": """
        HW_DISCONNECT PZ_SET_POSCONTROLMODE PZ_GET_PZSTATUSUPDATE PZ_SET_OUTPUTMAXVOLTS
        PZ_GET_MAXTRAVEL
    """,
    "BPC102": """
        RACK_GET_DIGOUTPUTS PZ_REQ_PZSTATUSBITS PZ_GET_PZSTATUSUPDATE PZ_SET_OUTPUTMAXVOLTS
        PZ_GET_MAXTRAVEL
    """,
    "BPC203": """
        RACK_REQ_BAYUSED PZ_SET_PICONSTS PZ_STOP_LUTOUTPUT PZ_SET_ZERO PZ_REQ_MAXTRAVEL
        PZ_GET_OUTPUTMAXVOLTS
    """,
    # page 132
    "BPC301": """
        RACK_GET_STATUSBITS PZ_ACK_PZSTATUSUPDATE PZ_SET_ZERO PZ_SET_OUTPUTMAXVOLTS
        PZ_SET_TPZ_SLEWRATES PZ_GET_TPZ_SLEWRATES MOT_SET_PZSTAGEPARAMDEFAULTS
    """,
    # page 133
    "TPZ001": """
        PZ_SET_OUTPUTVOLTS PZ_GET_OUTPUTLUTPARAMS PZ_START_LUTOUTPUT PZ_SET_EEPROMPARAMS
        PZ_SET_TPZ_DISPSETTINGS PZ_GET_TPZ_IOSETTINGS
    """,
    # page 134
    "TSG001": """
        HUB_GET_BAYUSED PZ_ACK_PZSTATUSUPDATE PZ_REQ_TPZ_DISPSETTINGS PZ_SET_ZERO
        PZ_GET_MAXTRAVEL PZ_SET_TSG_IOSETTINGS PZ_GET_TSG_READING
    """,
    # page 135
    "MPZ601": """
        RACK_REQ_DIGOUTPUTS PZ_ACK_PZSTATUSUPDATE PZ_REQ_MAXTRAVEL PZ_SET_IOSETTINGS
        PZ_SET_LUTVALUETYPE
    """,
}
LACKS = {
    "BSC001": """
        MOT_GET_DCSTATUSUPDATE MOT_SET_DCPIDPARAMS MOT_SET_PMDPOSITIONLOOPPARAMS
        RACK_REQ_BAYUSED HUB_REQ_BAYUSED
    """,
    "BSC103": "MOT_GET_DCSTATUSUPDATE MOT_SET_POTPARAMS MOT_SET_SOL_STATE HUB_REQ_BAYUSED",
    "MST601": "HW_DISCONNECT MOT_GET_DCSTATUSUPDATE",
    "BBD102": """
        MOT_SET_LIMSWITCHPARAMS MOT_SET_DCPIDPARAMS MOT_GET_STATUSUPDATE
        MOT_SET_BUTTONPARAMS
    """,
    "BBD101": "RACK_REQ_STATUSBITS RACK_SET_DIGOUTPUTS MOT_SET_LIMSWITCHPARAMS",
    "TST001": "MOT_SET_DCPIDPARAMS MOT_GET_DCSTATUSUPDATE RACK_REQ_BAYUSED",
    "ODC001": "MOT_SET_DCPIDPARAMS MOT_GET_STATUSUPDATE HUB_REQ_BAYUSED",
    "TDC001": """
        HW_DISCONNECT MOT_SET_EEPROMPARAMS MOT_GET_STATUSUPDATE MOT_SET_PMDPROFILEMODEPARAMS
        HUB_REQ_BAYUSED
    """,
    "TSC001": """
        HW_DISCONNECT MOT_MOVE_HOME MOT_MOVE_STOPPED MOT_ACK_DCSTATUSUPDATE
        MOT_REQ_STATUSUPDATE
    """,
    "BPC001": "RACK_REQ_BAYUSED RACK_SET_DIGOUTPUTS PZ_ACK_PZSTATUSUPDATE PZ_SET_TPZ_SLEWRATES",
    "BPC102": "PZ_ACK_PZSTATUSUPDATE PZ_SET_TPZ_IOSETTINGS",
    "BPC203": "PZ_ACK_PZSTATUSUPDATE PZ_SET_EEPROMPARAMS PZ_SET_TPZ_SLEWRATES",
    "BPC301": "PZ_REQ_MAXTRAVEL PZ_SET_IOSETTINGS PZ_SET_EEPROMPARAMS",
    "TPZ001": """
        PZ_ACK_PZSTATUSUPDATE PZ_REQ_PZSTATUSBITS PZ_SET_ZERO PZ_REQ_MAXTRAVEL
        HUB_REQ_BAYUSED PZ_SET_TPZ_SLEWRATES
    """,
    "TSG001": "PZ_SET_OUTPUTVOLTS PZ_REQ_PZSTATUSBITS PZ_SET_TPZ_IOSETTINGS",
    "MPZ601": "HW_DISCONNECT RACK_REQ_STATUSBITS PZ_SET_EEPROMPARAMS PZ_SET_OUTPUTMAXVOLTS",
}
STATUS = {
    "dc": "MOT_GET_DCSTATUSUPDATE",
    "stepper": "MOT_GET_STATUSUPDATE",
    "piezo": "PZ_GET_PZSTATUSUPDATE",
}

every_unit = pytest.mark.parametrize("name", UNITS)


def answers(message: Json) -> list[str]:
    """Return the replies to a message according to sets and exchanges."""
    found = list(message["exchange"].get("answered_by", ()))
    found += message["exchange"].get("announces", ())
    if message["set"] and message["set"]["role"] == "req":
        found.append(REGISTRY["sets"][message["set"]["name"]]["get"])
    return found


def test_the_registry_has_every_unit_of_the_document() -> None:
    assert sorted(UNITS) == sorted(NAMES.split())


@every_unit
def test_the_messages_of_a_unit_are_known_and_include_the_basic_ones(name: str) -> None:
    messages = UNITS[name]["messages"]
    assert messages == sorted(set(messages))
    assert set(messages) <= set(MESSAGES)
    basic = {"MOD_IDENTIFY", "HW_REQ_INFO", "HW_GET_INFO", "HW_RESPONSE", "HW_START_UPDATEMSGS"}
    assert basic < set(messages)


@every_unit
def test_a_unit_with_a_request_has_its_reply(name: str) -> None:
    messages = UNITS[name]["messages"]
    assert [(m, a) for m in messages for a in answers(MESSAGES[m]) if a not in messages] == []


@every_unit
def test_a_unit_has_its_keep_alive_message(name: str) -> None:
    unit = UNITS[name]
    keepers = [m for m in unit["messages"] if MESSAGES[m]["exchange"].get("keeps_alive")]
    assert [unit["keep_alive"]] == (keepers or ["none"])


@every_unit
def test_a_unit_has_one_form_of_status(name: str) -> None:
    unit = UNITS[name]
    assert [m for m in STATUS.values() if m in unit["messages"]] == [STATUS[unit["status"]]]


def test_every_motor_that_can_home_has_a_request_for_status_bits() -> None:
    """Page 81 lists no exceptions; the printed list of the solenoid driver lacks the message."""
    both = {"MOT_REQ_STATUSBITS", "MOT_GET_STATUSBITS"}
    motors = {name for name, unit in UNITS.items() if "MOT_MOVE_HOME" in unit["messages"]}
    assert motors == {name for name, unit in UNITS.items() if both & set(unit["messages"])}
    assert all(both <= set(UNITS[name]["messages"]) for name in motors)


def test_every_message_belongs_to_a_unit() -> None:
    """The exceptions are two messages that the document names without describing them."""
    known = {message for unit in UNITS.values() for message in unit["messages"]}
    assert set(MESSAGES) - known == {"HW_RICHRESPONSE", "MOT_SET_MOVEVELPARAMS"}


def test_the_typed_lists_cover_at_least_ten_families() -> None:
    assert HAS.keys() == LACKS.keys()
    assert len({UNITS[name]["family"] for name in HAS}) >= 10


@pytest.mark.parametrize("name", HAS)
def test_a_unit_has_the_messages_of_the_document_and_no_others(name: str) -> None:
    messages = set(UNITS[name]["messages"])
    has, lacks = set(HAS[name].split()), set(LACKS[name].split())
    assert has | lacks <= set(MESSAGES)  # no typing errors
    assert has - messages == set()
    assert lacks & messages == set()


@pytest.mark.parametrize("name", ROWS)
def test_a_printed_list_is_complete(name: str) -> None:
    rows, added = ROWS[name]
    unit = UNITS[name]
    printed = REGISTRY["lists"][unit["list"]]
    assert name in printed["units"]
    assert printed["completes"] == added
    assert len(printed["messages"]) == rows
    assert unit["messages"] == sorted([*printed["messages"], *added])


def test_units_without_a_list_have_the_list_of_their_family(files: dict[str, str]) -> None:
    units = {
        unit["name"]: unit
        for unit in json.loads(files["python/stagewire_tiny/registry.json"])["units"]
    }
    listed = ["POS_ALIVE", "POS_ECHO", "POS_MOVE", "POS_MOVED"]
    assert units["TP1"]["messages"] == listed  # its own, with additions
    assert units["TP2"]["messages"] == listed  # like TP1
    assert units["TP9"]["messages"] == ["POS_ALIVE", "POS_MOVE", "POS_MOVED"]  # from its family
