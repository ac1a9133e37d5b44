"""When parameters and the status are read, and what their records show without a controller."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from epics_parameters import Z8, Line, published, run

import stagewire_virtual as virtual
from stagewire.errors import ReplyTimeoutError, TransportLostError
from stagewire_apt.aio import BPC203, TDC001
from stagewire_epics import parameters
from stagewire_epics.parameters import ParameterRecords, StatusRecords
from stagewire_epics.records import Kind, PutRefusedError, Severity, Status

# Polling, silence and losses


def test_sets_are_read_slowly_one_after_another(tmp_path: Path) -> None:
    async def main() -> None:
        async with published(TDC001, Z8, tmp_path / "log", stage="Z8") as tdc:
            await asyncio.sleep(0.5)
            tdc.line.sent()
            await asyncio.sleep(17 * parameters.POLL)
            sent = tdc.line.sent()
            assert len(sent) == 17
            assert len(set(sent)) == 17
            assert not any("SET" in name for name in sent)
            await tdc.part.change_vel_params(max_velocity_mm_per_s=0.5)  # another program
            assert tdc["VEL_PARAMS:MAX_VELOCITY"].value != pytest.approx(0.5, abs=1e-4)
            await asyncio.sleep(17 * parameters.POLL)
            assert tdc["VEL_PARAMS:MAX_VELOCITY"].value == pytest.approx(0.5, abs=1e-4)

    run(main)


def test_a_set_that_is_not_answered_is_invalid_alone(tmp_path: Path) -> None:
    async def main() -> None:
        url = f"{Z8}&faults=to_host drop frame message=MOT_GET_JOGPARAMS"
        async with published(TDC001, url, tmp_path / "log", stage="Z8") as tdc:
            for record in tdc.parameters.records:
                silent = record.name.startswith("LAB:x:JOG_PARAMS:")
                assert (record.alarm.status is Status.COMM) == silent, record.name
                assert (record.alarm.severity is Severity.INVALID) == silent
            with pytest.raises(ReplyTimeoutError):
                await tdc["JOG_PARAMS:JOG_MODE"].put(1)
            assert tdc.line.writes() == []

    run(main)


def test_records_are_invalid_and_refuse_values_until_there_is_a_controller() -> None:
    async def main() -> None:
        records = ParameterRecords(TDC001, "LAB:x")
        await records.lost("the controller has not been found yet")
        status = StatusRecords(TDC001, "LAB:x")
        await status.lost("the controller has not been found yet")
        for record in (*records.records[:-1], *status.records):
            assert record.alarm.severity is Severity.INVALID
            assert record.alarm.status is Status.COMM
            assert record.alarm.message == "the controller has not been found yet"
            if record.writable:
                value = "x" if record.kind is Kind.TEXT else 0
                with pytest.raises(PutRefusedError, match="is not connected; nothing was sent"):
                    await record.put(value)
        with pytest.raises(PutRefusedError, match="is not connected; nothing was sent"):
            await records.records[-1].put(1)

    run(main)


def test_a_lost_line_makes_all_records_invalid_until_it_is_back() -> None:
    async def main() -> None:
        with virtual.TDC001().tcp() as server:
            tdc = await TDC001.open(server.url, reconnect_pause=0)
            records = ParameterRecords(TDC001, "LAB:x")
            records.bind(tdc)
            await records.refresh()
            server.unplug()
            async with asyncio.timeout(10):
                while records.records[0].alarm.severity is not Severity.INVALID:
                    await asyncio.sleep(0.05)
            with pytest.raises(TransportLostError):
                await records.refresh()
            await records.lost("the line was lost")
            read = records.records[:-1]
            assert {record.alarm.status for record in read} == {Status.COMM}
            assert {record.alarm.message for record in read} == {"the line was lost"}
            await tdc.reconnect()
            records.bind(tdc)
            await records.refresh()
            assert {record.alarm.severity for record in read} == {Severity.NO_ALARM}
            await records.lost("the test has ended")
            await tdc.close()

    asyncio.run(main())


def test_a_reply_that_arrives_after_the_loss_is_not_published() -> None:
    async def main() -> None:
        async with TDC001.open(Z8) as tdc:
            values = await tdc.get_vel_params()
            arrived = asyncio.Event()
            arrived.set()

            async def late() -> Any:
                await arrived.wait()
                return values

            records = ParameterRecords(TDC001, "LAB:x", ("vel_params",))
            records.bind(SimpleNamespace(get_vel_params=late, scales=tdc.scales))
            await records.refresh()
            assert records.records[0].alarm.severity is Severity.NO_ALARM
            await asyncio.sleep(0.1)  # the first reading after bind() has ended
            arrived.clear()
            reading = asyncio.create_task(records.refresh())
            await asyncio.sleep(0.1)
            await records.lost("the line was lost")
            arrived.set()
            await reading
            assert records.records[0].alarm.status is Status.COMM

    run(main)


# Status


def test_the_status_that_a_motor_reads_anyway_is_published(tmp_path: Path) -> None:
    async def main() -> None:
        log = tmp_path / "log"
        async with TDC001.open(Z8, stage="Z8", log=log) as tdc:
            status = StatusRecords(TDC001, "LAB:x")
            found = {record.name: record for record in status.records}
            line = Line(log)
            await status.post(await tdc.get_dc_status_update())
            assert found["LAB:x:STATUS:HOMED"].value == 0
            await tdc.home()
            await tdc.move_absolute(mm=1)
            values = await tdc.get_dc_status_update()
            line.sent()
            await status.post(values)
            assert line.sent() == []
            assert found["LAB:x:STATUS:HOMED"].value == 1
            assert found["LAB:x:STATUS:MOVING_FORWARD"].value == 0
            assert found["LAB:x:STATUS:POSITION"].value == pytest.approx(1, abs=0.01)
            assert found["LAB:x:STATUS:POSITION"].unit == "mm"
            bits = await tdc.get_status_bits()  # another status with the same names
            await status.lost("silent")
            await status.post(bits)
            assert found["LAB:x:STATUS:HOMED"].alarm.severity is Severity.NO_ALARM
            assert found["LAB:x:STATUS:POSITION"].alarm.status is Status.COMM

    run(main)


def test_a_part_without_a_motor_is_asked_for_its_status() -> None:
    async def main() -> None:
        async with BPC203.open("virtual://BPC203") as rack:
            status = StatusRecords(BPC203.bay_class, "LAB:x")
            await status.request(rack.bay(1))
            found = {record.name: record for record in status.records}
            assert found["LAB:x:STATUS:CLOSED_LOOP"].value == 0
            await rack.bay(1).set_pos_control_mode(mode="CLOSED_LOOP")
            await status.request(rack.bay(1))
            assert found["LAB:x:STATUS:CLOSED_LOOP"].value == 1

    run(main)
