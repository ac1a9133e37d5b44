"""Parameters as records: units and limits, choices and bits, and what a put sends."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from epics_parameters import Z8, published, run

from stagewire.errors import BadValueError, LimitError, OutOfRangeError
from stagewire_apt import messages as m
from stagewire_apt.aio import BBD302, KDC101, KST101, TDC001, TPZ001
from stagewire_epics.parameter_fields import NO_YES
from stagewire_epics.parameters import ParameterRecords
from stagewire_epics.records import Kind, PutRefusedError, Severity

SHORT = m.MotGetKcubeMmiParamsShort


def test_a_number_has_the_unit_precision_and_limits_of_the_stage(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log", stage="Z8") as tdc:
            position = tdc["POS_COUNTER:POSITION"]
            assert (position.kind, position.unit, position.precision) == (Kind.FLOAT, "mm", 5)
            assert position.limits == pytest.approx((-(2**31) / 34304, (2**31 - 1) / 34304))
            assert tdc["VEL_PARAMS:MAX_VELOCITY"].unit == "mm/s"
            assert tdc["JOG_PARAMS:JOG_MODE"].choices == ("CONTINUOUS", "SINGLE_STEP")
        async with published(TDC001, "virtual://TDC001", tmp_path / "log2") as tdc:
            assert tdc["VEL_PARAMS:MAX_VELOCITY"].unit == "counts"
            assert tdc["VEL_PARAMS:MAX_VELOCITY"].limits == (0, 2**32 - 1)

    run(main)


def test_a_unit_follows_the_setting_that_it_depends_on(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TPZ001, "virtual://TPZ001", tmp_path / "log", max_volts=150) as tpz:
            volts, heard = tpz["OUTPUT_VOLTS:VOLTAGE"], []
            before = volts.limits

            async def listen(record: Any) -> None:
                heard.append(record.limits)

            volts.listen(listen)
            await tpz["TPZ_IO_SETTINGS:VOLTAGE_LIMIT"].put("VOLTAGELIMIT_150V")
            await tpz["REFRESH"].put(1)
            assert volts.limits == (2 * before[0], 2 * before[1])
            assert heard[-1] == volts.limits

    run(main)


def test_a_put_is_one_change_and_shows_what_the_controller_has_then(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log", stage="Z8") as tdc:
            velocity = tdc["VEL_PARAMS:MAX_VELOCITY"]
            acceleration = tdc["VEL_PARAMS:ACCELERATION"].value
            await velocity.put(1.23456789)
            assert tdc.line.sent() == [
                "MOT_REQ_VELPARAMS",
                "MOT_SET_VELPARAMS",
                "MOT_REQ_VELPARAMS",
            ]
            values = await tdc.part.get_vel_params()
            assert velocity.value == values.max_velocity_mm_per_s != 1.23456789
            assert tdc["VEL_PARAMS:ACCELERATION"].value == acceleration

    run(main)


def test_a_put_is_published_even_if_nothing_changes(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log") as tdc:
            velocity, heard = tdc["VEL_PARAMS:MAX_VELOCITY"], []

            async def listen(record: Any) -> None:
                heard.append(record.value)

            velocity.listen(listen)
            await tdc.parameters.refresh()
            assert heard == []
            await velocity.put(velocity.value)
            assert heard == [velocity.value]

    run(main)


def test_refused_values_send_nothing(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log", stage="Z8") as tdc:
            refused: list[tuple[str, Any, type[Exception]]] = [
                ("VEL_PARAMS:MAX_VELOCITY", 1000, LimitError),
                ("VEL_PARAMS:MAX_VELOCITY", -1, OutOfRangeError),
                ("DC_PID_PARAMS:PROPORTIONAL", 2**16, OutOfRangeError),
                ("DC_PID_PARAMS:PROPORTIONAL", 1.5, PutRefusedError),
                ("VEL_PARAMS:MAX_VELOCITY", "fast", PutRefusedError),
                ("JOG_PARAMS:JOG_MODE", "SOMETIMES", PutRefusedError),
                ("JOG_PARAMS:JOG_MODE", 2, PutRefusedError),
                ("LIM_SWITCH_PARAMS:CW_HARD_LIMIT", "SOMETIMES", BadValueError),
                ("INFO:MODEL_NUMBER", "TDC002", PutRefusedError),
            ]
            for name, value, error in refused:
                before = tdc[name].value
                with pytest.raises(error):
                    await tdc[name].put(value)
                assert tdc[name].value == before
            assert tdc.line.sent() == []

    run(main)


def test_an_integer_beyond_32_bits_is_a_float(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(KST101, "virtual://KST101", tmp_path / "log") as kst:
            number = kst["KCUBE_KST_LOOP_PARAMS:ENCODER_CONST"]
            assert (number.kind, number.limits) == (Kind.FLOAT, (0, 2**32 - 1))
            with pytest.raises(PutRefusedError, match="not a whole number"):
                await number.put(1.5)
            await number.put(float(2**32 - 1))
            assert number.value == 2**32 - 1
            assert (await kst.part.get_kcube_kst_loop_params()).encoder_const == 2**32 - 1

    run(main)


# Names of values, and bits


def test_choices_are_put_by_name_or_number(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log") as tdc:
            mode = tdc["JOG_PARAMS:JOG_MODE"]
            await mode.put("CONTINUOUS")
            assert mode.value == 0
            await mode.put(1)
            assert (await tdc.part.get_jog_params()).jog_mode.name == mode.choices[1]
            assert tdc.line.writes() == ["MOT_SET_JOGPARAMS"] * 2

    run(main)


def test_an_enumeration_with_modifiers_is_a_text(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log") as tdc:
            switch = tdc["LIM_SWITCH_PARAMS:CW_HARD_LIMIT"]
            await switch.put("BREAKS|SWAPPED")
            assert switch.value == "BREAKS|SWAPPED"
            assert (await tdc.part.get_lim_switch_params()).cw_hard_limit == 0x83
            await switch.put("2")
            assert switch.value == "MAKES"

    run(main)


def test_a_value_without_a_name_is_invalid(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log", sets=("jog_params",)) as tdc:
            part = SimpleNamespace(get_jog_params=tdc.part.get_jog_params)
            values = await tdc.part.get_jog_params()

            async def reported() -> Any:
                message = type(values.message).keep({**values.message.values(), "jog_mode": 9})
                return type(values)(message, values.scales)

            part.get_jog_params = reported
            tdc.parameters.bind(part)
            await tdc.parameters.refresh()
            mode = tdc["JOG_PARAMS:JOG_MODE"]
            assert mode.alarm.severity is Severity.INVALID
            assert mode.alarm.message == "the controller reports 9, which has no name"
            assert tdc["JOG_PARAMS:JOG_STOP_MODE"].alarm.severity is Severity.NO_ALARM

    run(main)


def test_a_bit_changes_alone_even_if_another_program_changed_the_others(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(KDC101, "virtual://KDC101", tmp_path / "log") as kdc:
            first, second, *others = kdc.of("AV_MODES")
            assert others
            assert all(bit.choices == NO_YES for bit in (first, second, *others))
            await kdc.part.change_av_modes(mode_bits=0)
            await kdc.parameters.refresh()
            names = (await kdc.part.get_av_modes()).mode_bits.bits
            await kdc.part.change_av_modes(mode_bits=next(iter(names)))  # another program
            kdc.line.sent()
            await second.put("Yes")
            assert kdc.line.writes() == ["MOT_SET_AVMODES"]
            assert (first.value, second.value) == (1, 1)
            assert (await kdc.part.get_av_modes()).mode_bits.names == tuple(names)[:2]
            await first.put(0)
            assert (await kdc.part.get_av_modes()).mode_bits.names == tuple(names)[1:2]

    run(main)


def test_bits_of_one_set_that_are_put_at_once_are_all_changed(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(KDC101, "virtual://KDC101", tmp_path / "log") as kdc:
            await kdc.part.change_av_modes(mode_bits=0)
            bits = kdc.of("AV_MODES")
            await asyncio.gather(*(bit.put(1) for bit in bits))
            assert all(bit.value == 1 for bit in bits)

    run(main)


def test_a_set_whose_request_requires_a_choice_has_records_for_each(tmp_path: Path) -> None:
    async def main() -> None:
        url, log = "virtual://BBD302?stage=MLS203", tmp_path / "log"
        async with published(BBD302, url, log, part=lambda rack: rack.bay(1)) as bay:
            before = [bay[f"IO_CONFIG:BNC{number}:MODE"].value for number in (1, 2, 3)]
            new = 1 - min(before[1], 1)
            await bay["IO_CONFIG:BNC2:MODE"].put(new)
            assert bay.line.writes() == ["MOT_SET_IOCONFIG"]
            await bay.parameters.refresh()
            after = [bay[f"IO_CONFIG:BNC{number}:MODE"].value for number in (1, 2, 3)]
            assert after == [before[0], new, before[2]]
            for number, value in enumerate(after, 1):
                mode = (await bay.part.get_io_config(io_port=number)).mode
                assert mode.name == bay["IO_CONFIG:BNC1:MODE"].choices[value]

    run(main)


def test_a_parameter_that_the_controller_does_not_send_is_invalid() -> None:
    async def main() -> None:
        async with KDC101.open("virtual://KDC101") as kdc:
            long = await kdc.get_kcube_mmi_params()
            message = SHORT.keep(
                {
                    name: value
                    for name, value in long.message.values().items()
                    if name in SHORT.layout.fields
                }
            )

            async def reported() -> Any:
                return type(long)(message, long.scales)

            records = ParameterRecords(KDC101, "LAB:x", ("kcube_mmi_params",))
            records.bind(SimpleNamespace(get_kcube_mmi_params=reported))
            await records.refresh()
            absent = {r.name for r in records.records if "shorter packet" in r.alarm.message}
            assert absent == {
                "LAB:x:KCUBE_MMI_PARAMS:PRESET_POS3",
                "LAB:x:KCUBE_MMI_PARAMS:JS_SENSITIVITY",
            }
            await records.lost("the test has ended")

    run(main)
