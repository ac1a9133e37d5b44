"""The rule that a finding names: one for each field, each parameter set, and each kind of wrong bytes.

A check names its own rule with ``rule=``. This module has the rules of findings that many checks can make.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.checks.apt import later_rules

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

ANSWERED: Final = "request-answered"
ADDRESSES: Final = "reply-addresses-swapped"
LENGTH: Final = "data-length-bytes"
SIZES: Final = "format-sizes"
UNUSED: Final = "unused-parameters-zero"

_FIELDS: Final[Mapping[str, str]] = {
    "HW_GET_INFO.type": "info-type",
    "RACK_GET_BAYUSED.bay_ident": "bay-idents",
    "bay_state": "bay-states",
    "HUB_GET_BAYUSED.bay_ident": "hub-bay-values",
    "enable_state": "enable-states",
    "RACK_GET_STATUSBITS.status_bits": "rack-status-bits",
    "dig_op": "digital-outputs-bits",
    "min_velocity": "minimum-velocity-zero",
    "jog_mode": "jog-mode-values",
    "jog_min_velocity": "jog-minimum-velocity-zero",
    "jog_stop_mode": "jog-stop-mode-values",
    "cw_hard_limit": "limit-switch-values",
    "ccw_hard_limit": "limit-switch-values",
    "software_limit_mode": "soft-limit-modes",
    "MOT_GET_STATUSBITS.status_bits": "status-bits-alone",
    "MOT_GET_STATUSUPDATE.status_bits": "status-bits-meaning",
    "MOT_GET_DCSTATUSUPDATE.status_bits": "dc-status-bits",
    "PZ_GET_PZSTATUSBITS.status_bits": "piezo-status-bits-meaning",
    "PZ_GET_PZSTATUSUPDATE.status_bits": "piezo-status-bits-meaning",
    "mode_bits": "led-modes",
    "MOT_GET_BUTTONPARAMS.mode": "button-modes",
    "operating_mode": "solenoid-mode-values",
    "on_time": "solenoid-cycle-times",
    "off_time": "solenoid-cycle-times",
    "num_cycles": "solenoid-cycle-count",
    "interlock_mode": "interlock-mode-values",
    "state": "solenoid-state-values",
    "MOT_GET_PMDCURRENTLOOPPARAMS.phase": "current-loop-phase",
    "MOT_GET_PMDSETTLEDCURRENTLOOPPARAMS.phase": "settled-current-loop-phase",
    "motor_bias": "motor-bias-range",
    "MOT_GET_PMDPROFILEMODEPARAMS.mode": "profile-values",
    "jerk": "profile-jerk-range",
    "part_no_axis": "stage-part-number",
    "PZ_GET_POSCONTROLMODE.mode": "control-mode-values",
    "PZ_GET_OUTPUTVOLTS.voltage": "output-volts-range",
    "position_sw": "output-position-range",
    "travel": "max-travel-range",
    "volt_src": "volts-source-values",
    "op_voltage": "piezo-update-voltage",
    "PZ_GET_PZSTATUSUPDATE.position": "piezo-update-position",
    "amp_current_lim": "current-limits",
    "amp_lp_filter": "low-pass-filters",
    "bnc_trig_or_lv_out": "bnc-modes",
    "PZ_GET_OUTPUTMAXVOLTS.voltage": "max-voltage-range",
    "slew_open": "slew-rate-range",
    "slew_closed": "slew-rate-range",
    "PZ_GET_OUTPUTLUT.index": "lut-index-range",
    "PZ_GET_OUTPUTLUT.output": "lut-output-range",
    "PZ_GET_OUTPUTLUTPARAMS.mode": "lut-modes-combined",
    "cycle_length": "lut-cycle-length-range",
    "PZ_GET_OUTPUTLUTPARAMS.num_cycles": "lut-cycle-count-range",
    "delay_time": "lut-delay-range",
    "pre_cycle_rest": "lut-rest-ranges",
    "post_cycle_rest": "lut-rest-ranges",
    "op_trig_start": "lut-trigger-start-range",
    "trig_repeat_cycle": "lut-trigger-repeat-range",
    "disp_intensity": "display-intensity-range",
    "voltage_limit": "tpz-voltage-limits",
    "hub_analog_input": "tpz-feedback-inputs",
    "hub_analogue_output": "tsg-outputs",
    "display_mode": "tsg-display-modes",
    "force_calib": "tsg-force-range",
    "reading": "tsg-reading-range",
    "smoothed": "tsg-reading-range",
    **later_rules.FIELDS,
}
"""Field, or message and field -> the rule about its values."""

_MESSAGES: Final[Mapping[str, str]] = {
    "MOT_GET_DCPIDPARAMS": "dc-pid-ranges",
    "MOT_GET_POTPARAMS": "pot-deflection-range",
    "MOT_GET_PMDCURRENTLOOPPARAMS": "current-loop-ranges",
    "MOT_GET_PMDSETTLEDCURRENTLOOPPARAMS": "settled-current-loop-ranges",
    "MOT_GET_PMDPOSITIONLOOPPARAMS": "position-loop-ranges",
    "MOT_GET_PMDMOTOROUTPUTPARAMS": "motor-output-ranges",
    "MOT_GET_PMDTRACKSETTLEPARAMS": "settle-ranges",
    "MOT_GET_PMDSTAGEAXISPARAMS": "stage-axis-read",
    "PZ_GET_PICONSTS": "pi-constants-range",
    **later_rules.MESSAGES,
}
"""Message -> the rule about the values of all its other fields."""

_SETS: Final[Mapping[str, str]] = {
    "MOD_SET_CHANENABLESTATE": "channel-enable",
    "RACK_SET_DIGOUTPUTS": "digital-outputs",
    "MOT_SET_ENCCOUNTER": "encoder-counter-set",
    "MOT_SET_POSCOUNTER": "position-counter-set",
    "MOT_SET_VELPARAMS": "velocity-parameters",
    "MOT_SET_JOGPARAMS": "jog-parameters",
    "MOT_SET_LIMSWITCHPARAMS": "limit-switch-parameters",
    "MOT_SET_GENMOVEPARAMS": "backlash-parameters",
    "MOT_SET_HOMEPARAMS": "home-parameters",
    "MOT_SET_MOVERELPARAMS": "relative-parameter-alone",
    "MOT_SET_MOVEABSPARAMS": "absolute-parameter-alone",
    "MOT_SET_DCPIDPARAMS": "dc-pid-parameters",
    "MOT_SET_POTPARAMS": "pot-parameters",
    "MOT_SET_AVMODES": "led-modes",
    "MOT_SET_BUTTONPARAMS": "button-positions",
    "MOT_SET_SOL_OPERATINGMODE": "solenoid-mode",
    "MOT_SET_SOL_CYCLEPARAMS": "solenoid-cycle",
    "MOT_SET_SOL_INTERLOCKMODE": "interlock-mode",
    "MOT_SET_SOL_STATE": "solenoid-state",
    "MOT_SET_PMDCURRENTLOOPPARAMS": "current-loop-parameters",
    "MOT_SET_PMDPOSITIONLOOPPARAMS": "position-loop-parameters",
    "MOT_SET_PMDMOTOROUTPUTPARAMS": "motor-output-parameters",
    "MOT_SET_PMDTRACKSETTLEPARAMS": "settle-ranges",
    "MOT_SET_PMDPROFILEMODEPARAMS": "profile-mode",
    "MOT_SET_PMDSETTLEDCURRENTLOOPPARAMS": "settled-current-loop-parameters",
    "PZ_SET_POSCONTROLMODE": "control-mode",
    "PZ_SET_OUTPUTVOLTS": "output-volts",
    "PZ_SET_OUTPUTPOS": "output-position",
    "PZ_SET_INPUTVOLTSSRC": "volts-source",
    "PZ_SET_PICONSTS": "pi-constants",
    "PZ_SET_IOSETTINGS": "io-settings",
    "PZ_SET_OUTPUTMAXVOLTS": "max-voltage",
    "PZ_SET_TPZ_SLEWRATES": "slew-rates",
    "PZ_SET_OUTPUTLUT": "lut-waveform",
    "PZ_SET_OUTPUTLUTPARAMS": "lut-parameters",
    "PZ_SET_TPZ_DISPSETTINGS": "display-intensity",
    "PZ_SET_TPZ_IOSETTINGS": "tpz-io-settings",
    "PZ_SET_TSG_IOSETTINGS": "tsg-io-settings",
    **later_rules.SETS,
}
"""SET message -> the rule that it sets its parameters."""

_CHANNELS_OF: Final[Mapping[str, str]] = {
    "MOT_GET_STATUSUPDATE": "status-always-chan1",
    "MOT_GET_DCSTATUSUPDATE": "dc-status-always-chan1",
    "PZ_GET_PZSTATUSUPDATE": "piezo-update-always-chan1",
    "PZ_GET_IOSETTINGS": "io-channel",
    "PZ_GET_PPC_IOSETTINGS": "ppc-io-channel",
    "PZ_GET_TPZ_IOSETTINGS": "tpz-channel",
    "PZ_GET_TSG_IOSETTINGS": "tsg-channel",
    "PZ_GET_OUTPUTLUT": "lut-channel",
    "MOT_GET_SOL_CYCLEPARAMS": "example-channel-one-solenoid",
}
"""Message -> the rule about its channel."""
_CHANNELS: Final = (
    "single-channel-chan1",
    "motor-single-channel",
    "piezo-single-channel",
    "dual-channel-idents",
    "piezo-dual-channel-idents",
    "module-channels",
    "channel-idents",
    "bays-are-single-channel",
)
"""Rules about the channel of any message, the most specific first."""


_ENDS: Final[Mapping[str, str]] = {
    "MOT_MOVE_HOME": "home-completed",
    "MOT_MOVE_ABSOLUTE": "absolute-move-completed",
    "MOT_MOVE_RELATIVE": "relative-move-completed",
    "MOT_MOVE_JOG": "jog-move-completed",
    "MOT_MOVE_VELOCITY": "velocity-move-completed",
    "MOT_MOVE_STOP": "stop-completed",
}
"""Command -> the rule about the message at its end."""


_COMMANDS: Final[Mapping[str, str]] = {
    "MOT_MOVE_HOME": "home-starts",
    "MOT_MOVE_ABSOLUTE": "absolute-move",
    "MOT_MOVE_RELATIVE": "relative-move",
    "MOT_MOVE_JOG": "jog-move",
    "MOT_MOVE_VELOCITY": "velocity-move",
    "MOT_MOVE_STOP": "stop-any-move",
}
"""Command -> the rule about its effect."""


_WORD: Final = 0x1_0000
"""The number of values of two bytes."""


COMMON: Final = (
    ANSWERED,
    ADDRESSES,
    LENGTH,
    SIZES,
    UNUSED,
    "get-answers-request",
    "slot-source",
    "slot-addressed-by-destination",
    "bays-are-single-channel",
    "data-flag",
    "header-only-meaning",
    "never-set-or-request-to-host",
    "no-error-in-normal-operation",
    "unit-messages",
    "command-without-acknowledgement",
    "at-rest-unchanged",
    "status-bits-motion",
    "status-bits-same",
    "status-position",
    "dc-status-bits-motion",
    "dc-status-position",
    "dc-status-velocity",
    "move-completed-status",
    "move-stopped-status",
    "move-complete-when-settled",
    "settled-at-rest",
    "jog-single-step",
    "jog-direction-values",
    "absolute-move-long",
    "relative-move-long",
    "motor-single-channel",
    "command-without-acknowledgement",
    *_CHANNELS_OF.values(),
    *_SETS.values(),
    *_COMMANDS.values(),
    *_ENDS.values(),
)
"""Rules that any check may find broken.

Every check exchanges messages, many change a setting for a moment, and every check of motion moves and stops.
"""


def rule_of_command(told: str) -> str:
    """Return the rule about the effect of a command, from the description of a motion."""
    short = " without a " in told and command_in(told) in ("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE")
    rule = _COMMANDS.get(command_in(told), "absolute-move")
    return f"{rule}-short" if short else rule


def rule_of_distance(told: str) -> str:
    """Return the rule that a motion goes as far as commanded, from its description."""
    steps = command_in(told) == "MOT_MOVE_JOG" and " by a step " in told
    return "jog-single-step" if steps else rule_of_command(told)


def rule_of_miss(told: str, missed: int, way: int) -> str:
    """Return the rule that a target which was missed breaks.

    :param told: the description of the motion, which begins with the command.
    :param missed: the counts from the target to the final position.
    :param way: the commanded distance.
    """
    command = command_in(told)
    if command == "MOT_MOVE_JOG" and " by a step " in told and abs(missed) > abs(way) > 0:
        backwards = (missed + way) * way < 0  # it went the other way
        return "jog-direction-values" if backwards else rule_of_command(told)
    off = (missed + _WORD // 2) % _WORD - _WORD // 2
    is_long = " without a " not in told and command in ("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE")
    if is_long and abs(missed) >= _WORD // 2 and abs(off) <= _WORD // 100:
        return f"{rule_of_command(told)}-long"  # only two bytes of the number were used
    return rule_of_command(told)


def rule_of_status(place: Target, what: str) -> str:
    """Return a rule about the status of motors, such as ``position``, for the status of a target."""
    return f"{'dc-' if place.status == 'dc' else ''}status-{what}"


def command_in(told: str) -> str:
    """Return the command that a description of a motion begins with."""
    return told.partition(" ")[0]


def rule_of_end(told: str, wanted: str) -> str:
    """Return the rule about the message that ends a motion.

    :param told: the description of the motion, which begins with the command.
    :param wanted: the message.
    """
    if wanted == "MOT_MOVE_STOPPED":
        return "stop-completed"
    return _ENDS.get(command_in(told), "move-completed")


def rule_of_field(message: str, field: str, unit: str = "") -> str:
    """Return the rule about the values of a field; that about the sizes of fields if there is no other.

    :param unit: the unit that sent the message, which may have a rule of its own.
    """
    keys = (f"{unit}.{field}", f"{message}.{field}", field)
    found = next((_FIELDS[key] for key in keys if key in _FIELDS), _MESSAGES.get(message))
    return found or SIZES


def rule_of_set(message: str) -> str:
    """Return the rule that a SET message sets its parameters."""
    return _SETS.get(message, "get-answers-request")


def rule_of_channel(trial: Trial, message: str) -> str:
    """Return the rule about the channel of a message, or otherwise one of those of the check."""
    places = trial.declared.places
    if any(place.bay for place in places) and all(len(place.channels) < 2 for place in places):
        return _CHANNELS_OF.get(message, "bays-are-single-channel")
    channels = [channel for place in places for channel in place.channels]
    rules = [rule for rule in _CHANNELS if rule in trial.rules]
    if len(channels) == 1 and message.startswith("MOT_"):
        rules = [rule for rule in rules if rule == "single-channel-chan1"] or [
            "motor-single-channel"
        ]
    return _CHANNELS_OF.get(message, next(iter(rules), "get-answers-request"))


def rule_of_addresses(trial: Trial) -> str:
    """Return the rule about the addresses of a message to the host."""
    has_bays = sum(place.bay is not None for place in trial.declared.places) > 1
    return "slot-source" if has_bays else ADDRESSES


def is_whole(raw: bytes) -> bool:
    """Return whether bytes have the length that their header states, whatever their id."""
    length = int.from_bytes(raw[2:4], "little") if len(raw) > 4 and raw[4] & DATA_FLAG else 0
    return len(raw) == HEADER_SIZE + length


def rule_of_stray(trial: Trial, heard: Incoming) -> str:
    """Return the rule that received bytes break which are not a requested message."""
    raw, protocol, registry = heard.raw, trial.declared.framed, trial.declared.registry
    if heard.kind in ("message", "undocumented", "unknown"):
        exchange = registry.messages.get(heard.name, {}).get("exchange", {})
        if exchange.get("muted_by") and not exchange.get("counts_for_keep_alive"):
            return "no-error-in-normal-operation"
        return "get-answers-request"
    id = int.from_bytes(raw[:2], "little")
    entry = next((each for each in registry.messages.values() if each["id"] == id), None)
    if entry is None and is_whole(raw):
        return "get-answers-request"
    if entry is None or len(raw) < HEADER_SIZE:
        return LENGTH
    if entry["direction"] == "to_controller":
        return "never-set-or-request-to-host"
    if raw[4] & ~DATA_FLAG != protocol.host or raw[5] not in protocol.devices:
        return rule_of_addresses(trial)
    stated = int.from_bytes(raw[2:4], "little")
    lengths = {layout["length"] for layout in entry["layouts"]}
    if not raw[4] & DATA_FLAG and stated and stated in lengths and len(raw) > HEADER_SIZE:
        return "data-flag"
    if not raw[4] & DATA_FLAG:
        return LENGTH if lengths & {0, None} else "data-flag"
    return LENGTH if lengths - {0, None} else "header-only-meaning"
