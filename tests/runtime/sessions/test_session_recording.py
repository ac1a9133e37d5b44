"""``log=path``: recording a session as a capture."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from scripted_links import USB, AsyncTestLink, TestLink, answer, velocity

from stagewire.capture import read_capture
from stagewire.errors import TransportError, TransportLostError
from stagewire.protocols import CommandFrame, Direction
from stagewire.sessions import AsyncFramedSession, FramedSession, Recording
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_cli.main import main
from stagewire_ms2000 import PROTOCOL as MS2000
from stagewire_ms2000 import messages as ms
from stagewire_virtual import stepped

REQUEST = m.MotReqVelParams(1).pack(USB, 1)
REPLY = velocity().pack(1, USB)


def check(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capture = read_capture(path)
    assert (capture.heading.protocol, capture.heading.unit) == ("thorlabs_apt", "TDC001")
    said = [(one.direction, one.data, one.comment) for one in capture.recorded]
    assert said == [
        (Direction.TO_CONTROLLER, REQUEST, "MOT_REQ_VELPARAMS"),
        (Direction.TO_HOST, REPLY, "MOT_GET_VELPARAMS"),
    ]
    assert main(["decode", str(path)]) == 0
    assert "MOT_GET_VELPARAMS" in capsys.readouterr().out


def test_both_directions_are_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "session.txt"
    with FramedSession(PROTOCOL, TestLink(answer), log=path, unit="TDC001") as session:
        session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)
        check(path, capsys)  # nothing is buffered
    check(path, capsys)


def test_both_directions_are_recorded_in_an_event_loop(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    async def talk() -> None:
        link = AsyncTestLink(answer)
        async with AsyncFramedSession(PROTOCOL, link, log=path, unit="TDC001") as session:
            await session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)

    path = tmp_path / "session.txt"
    stepped.run(talk())
    check(path, capsys)


def test_the_loss_of_the_link_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    link = TestLink()
    with FramedSession(PROTOCOL, link, log=path) as session:
        link.unplug()
        with pytest.raises(TransportLostError):
            session.pause(30)
    assert "the plug was pulled" in path.read_text()
    assert not read_capture(path).recorded


def test_pieces_get_the_names_of_the_frames_they_complete(tmp_path: Path) -> None:
    time = 5.0
    recording = Recording(tmp_path / "log", PROTOCOL, lambda: time)
    recording.received(REPLY[:7])
    time = 5.25
    recording.received(REPLY[7:] + REPLY + b"\xff" * 6)
    recording.close()
    recording.close()
    recording.received(REPLY)
    first, second = read_capture(tmp_path / "log").recorded
    assert (first.time, first.comment) == (0, "")
    assert second.time == 250_000_000
    assert second.comment == "MOT_GET_VELPARAMS, MOT_GET_VELPARAMS, no frame"


def test_replies_without_a_frame_have_the_name_of_their_request(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "log", MS2000, lambda: 0.0)
    recording.sent(CommandFrame(ms.SwitchToLowLevel()).encode())
    recording.sent(CommandFrame(ms.ReadMotorPosition(), 24).encode())
    recording.received(b"\x00\x01\x02")
    recording.close()
    comments = [one.comment for one in read_capture(tmp_path / "log").recorded]
    assert comments[1:] == ["READ_MOTOR_POSITION", "reply to READ_MOTOR_POSITION"]


def test_a_file_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TransportError, match="No such file or directory; give a file"):
        Recording(tmp_path / "nowhere" / "log", PROTOCOL, lambda: 0.0)


def test_a_full_disk_ends_only_the_recording(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    class Full:
        def write(self, *_: object) -> None:
            raise OSError(28, "No space left on device")

    with FramedSession(PROTOCOL, TestLink(answer), log=tmp_path / "log") as session:
        assert session._recording is not None
        session._recording._writer = Full()  # type: ignore[assignment]
        with caplog.at_level(logging.WARNING, "stagewire"):
            for _ in range(2):
                session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path / 'log'}: the recording ended: No space left on device"
    ]
