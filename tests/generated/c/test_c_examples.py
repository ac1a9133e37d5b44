"""examples/c: built in a fresh folder and run with the commands of the README, over pseudo-terminals."""

from __future__ import annotations

import contextlib
import os
import re
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from toolchain import C_WARNINGS, CORTEX_M0, C, compiles, need, symbols

from checkout import ROOT
from markdown_blocks import blocks
from stagewire import End
from stagewire.framing import Received
from stagewire.protocols import CommandFrame, FramedMessage, Message
from stagewire_apt import KDC101, stages
from stagewire_apt import PROTOCOL as APT
from stagewire_apt import messages as m
from stagewire_ms2000 import PROTOCOL as MS2000
from stagewire_ms2000 import enumerations
from stagewire_ms2000 import messages as c

pty, tty = (pytest.importorskip(name, exc_type=ImportError) for name in ("pty", "tty"))

EXAMPLES = ROOT / "examples" / "c"
HOST, DEVICE = 0x01, 0x21
PATIENCE = 20  # timeout in seconds, far more than needed


def block(language: str) -> str:
    """Return the only block of the README in a language."""
    [found] = blocks(EXAMPLES / "README.md", language)
    return found.text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The examples in a separate folder, with the files that they are built from."""
    need("gcc")
    root = tmp_path_factory.mktemp("fresh")
    (root / "generated").mkdir()
    (root / "generated" / "c").symlink_to(C.resolve())
    shutil.copytree(EXAMPLES, root / "examples" / "c")
    return root / "examples" / "c"


@pytest.fixture(scope="module")
def built(folder: Path) -> Path:
    """The folder with the programs; compilers give no warnings."""
    warnings = " ".join(["-std=c99", "-O2", *C_WARNINGS])
    compiles("make", "--silent", f"CFLAGS={warnings}", cwd=folder)
    return folder


def test_the_commands_of_the_readme(folder: Path, tmp_path: Path) -> None:
    fresh = tmp_path / "examples" / "c"
    shutil.copytree(EXAMPLES, fresh)
    (tmp_path / "generated").symlink_to(folder.parents[1] / "generated")
    script = ["sh", "-e", "-c", block("sh")]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # As in a user's shell: within another make, make would print its directory.
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS"))}
    with subprocess.Popen(script, cwd=fresh, start_new_session=True, env=plain, **pipes) as shell:
        try:
            out, err = shell.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, signal.SIGKILL)  # the controller would keep the pipes open
            raise
    assert shell.returncode == 0, err
    assert out.endswith(block("text"))
    assert [line.split()[0] for line in out.removesuffix(block("text")).splitlines()] == ["cc"] * 4


class Port:
    """Our end of a line: bytes out, messages in."""

    def __init__(self, fd: int, end: End) -> None:
        self.fd = fd
        self.framer = APT.framer(end)
        self.addresses = (HOST, DEVICE) if end is End.HOST else (DEVICE, HOST)
        self.framer.tell(DEVICE, status="dc")
        self.came: list[Message] = []

    def send(self, data: bytes) -> None:
        """Send bytes at once."""
        assert os.write(self.fd, data) == len(data)

    def next(self, patience: float = PATIENCE) -> Message | None:
        """Return the next message, which must be addressed to us; None after a timeout."""
        deadline = time.monotonic() + patience
        while not self.came:
            remaining = max(0, deadline - time.monotonic())
            if not select.select([self.fd], [], [], remaining)[0]:
                return None
            for event in self.framer.feed(os.read(self.fd, 4096)):
                assert isinstance(event, Received)
                assert (event.frame.dest, event.frame.source) == self.addresses
                self.came.append(event.frame.message)
        return self.came.pop(0)


# The small controller


@contextlib.contextmanager
def running(*command: Path) -> Iterator[None]:
    """Run a controller until the end of the block; its first argument is its port."""
    link = command[1]
    process = subprocess.Popen(command)
    deadline = time.monotonic() + PATIENCE
    while not link.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    try:
        yield
    finally:
        process.terminate()
        assert process.wait(PATIENCE) == 0
    assert not link.is_symlink()


@pytest.fixture
def controller(built: Path, tmp_path: Path) -> Iterator[Port]:
    """The host's end of the line to the BBD101 of the example."""
    link = tmp_path / "port"
    with running(built / "bbd101", link):
        fd = os.open(link, os.O_RDWR | os.O_NOCTTY)
        yield Port(fd, End.HOST)
        os.close(fd)


def to_device(message: FramedMessage, dest: int = DEVICE) -> bytes:
    """Return the frame of a message from the host."""
    return message.pack(dest=dest, source=HOST)


PROFILE = m.MotSetVelParams(chan_ident=1, min_velocity=0, acceleration=5000, max_velocity=400 << 16)
ASK_PROFILE = m.MotReqVelParams(chan_ident=1)


def test_the_controller_identifies_itself_and_keeps_a_profile(controller: Port) -> None:
    controller.send(to_device(m.HwReqInfo()))
    info = controller.next()
    assert isinstance(info, m.HwGetInfo)
    assert (info.model_number, info.type, info.nchs) == ("ION001", 44, 1)
    controller.send(to_device(PROFILE) + to_device(ASK_PROFILE))
    kept = controller.next()
    assert isinstance(kept, m.MotGetVelParams)
    assert kept.values() == PROFILE.values()


def test_the_controller_moves_on_command(controller: Port) -> None:
    controller.send(to_device(PROFILE))
    for position in (5000, -100_000, -100_000, -1):
        move = m.MotMoveAbsolute(chan_ident=1, absolute_distance=position)
        controller.send(to_device(move))
        ended = controller.next()
        assert isinstance(ended, m.MotMoveCompletedDc)
        assert ended.position == position
        assert "settled" in ended.status_bits_flags.names
    assert controller.next(0.05) is None  # and reports it once


def test_the_controller_finds_frames_in_a_damaged_stream(controller: Port) -> None:
    elsewhere = to_device(m.MotMoveAbsolute(chan_ident=1, absolute_distance=7), dest=0x22)
    short = to_device(PROFILE)[:-1]  # of a wrong length
    short = short[:2] + (len(short) - 6).to_bytes(2, "little") + short[4:]
    controller.send(bytes(range(40)) + elsewhere + short)
    for byte in to_device(ASK_PROFILE):
        controller.send(bytes([byte]))
    kept = controller.next()
    assert isinstance(kept, m.MotGetVelParams)
    assert kept.max_velocity != PROFILE.max_velocity
    assert controller.next(0.05) is None


# The complete controller


def test_the_device_class_drives_the_complete_controller(built: Path, tmp_path: Path) -> None:
    link, eeprom = tmp_path / "port", tmp_path / "eeprom"
    faster = {"max_velocity_mm_per_s": 200, "max_acceleration_mm_per_s2": 2000}
    with (
        running(built / "kdc101", link, eeprom),
        KDC101.open(str(link), stage="MTS25-Z8", travel_mm=25, **faster) as kdc,
    ):
        assert (kdc.serial_number, kdc.info.model_number) == (27000001, "KDC101")
        fast = kdc.scales.of("velocity", "mm/s").to_counts(200)
        kdc.change_vel_params(acceleration=500_000, max_velocity=fast)
        kdc.change_home_params(home_velocity=fast)
        kdc.home()
        assert kdc.get_status_bits().status_bits.homed
        kdc.move_absolute(mm=20)
        assert kdc.get_pos_counter().position == stages.MTS25_Z8.scale(
            "position", "KDC101"
        ).to_counts(20)
        kdc.change_jog_params(jog_acceleration=500_000, jog_max_velocity=fast)
        kdc.set_eeprom_params(msg_id=m.MotSetJogParams.layout.id)
        kdc.get_info()  # and with its answer, the save is done
    with running(built / "kdc101", link, eeprom), KDC101.open(str(link)) as kdc:
        assert kdc.get_jog_params().jog_max_velocity == fast  # saved
        assert kdc.get_vel_params().max_velocity != fast


# Both


@pytest.mark.matrix
@pytest.mark.parametrize("unit", ["bbd101", "kdc101"])
def test_the_controllers_need_only_the_functions_of_a_platform(
    unit: str, built: Path, tmp_path: Path
) -> None:
    need("arm-none-eabi-gcc")
    made = tmp_path / "firmware.o"
    sources = [built / f"{name}.c" for name in (unit, "firmware", "settings", "motion", "motor")]
    compiles(
        "arm-none-eabi-gcc", "-std=c99", *CORTEX_M0, *C_WARNINGS, f"-I{C}", "-nostdlib", "-r",
        *sources, C / "stagewire_apt" / "stagewire_apt.c", "-o", made,
    )  # fmt: skip
    undefined = {name for name, kind, _ in symbols("arm-none-eabi-nm", made) if kind == "U"}
    arithmetic = {name for name in undefined if name.startswith("__aeabi_")}  # of the compiler
    declared = re.findall(r"(firmware_\w+)\(", (built / "firmware.h").read_text(encoding="utf-8"))
    assert undefined - arithmetic == set(declared) - {"firmware_init", "firmware_poll"}
    assert arithmetic.isdisjoint(
        name for name in arithmetic if re.search("[fd]2|[fd](add|mul|div)", name)
    )


@pytest.mark.matrix
def test_the_examples_pass_the_linters(folder: Path) -> None:
    need("clang-tidy", "clang-format")
    sources, headers = sorted(folder.glob("*.c")), sorted(folder.glob("*.h"))
    options = ["-std=c99", "-D_XOPEN_SOURCE=600", f"-I{C}"]
    compiles(
        "clang-tidy", "--quiet", f"--config-file={ROOT / '.clang-tidy'}", *sources, "--", *options
    )
    style = f"--style=file:{ROOT / '.clang-format'}"
    compiles("clang-format", style, "--dry-run", "-Werror", *sources, *headers)


# The hosts


class Host:
    """A host of the examples on a line whose other end is ours."""

    def __init__(self, program: Path, *arguments: str) -> None:
        fd, self._other = pty.openpty()
        tty.setraw(fd)
        self.port = Port(fd, End.DEVICE)
        self.process = subprocess.Popen(
            [program, os.ttyname(self._other), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def answer(self, *messages: FramedMessage) -> None:
        """Send messages to the host."""
        for message in messages:
            self.port.send(message.pack(dest=HOST, source=DEVICE))

    def close(self) -> None:
        """Stop the program if it is still running."""
        self.process.kill()
        self.process.communicate()
        os.close(self.port.fd)
        os.close(self._other)

    def end(self) -> tuple[int, str, str]:
        """Wait for the program; return its status and its output."""
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out, err


Start = Callable[..., Host]


@pytest.fixture
def start(built: Path) -> Iterator[Start]:
    """Start a host of the examples by the name of its program."""
    hosts: list[Host] = []

    def start(name: str, *arguments: str) -> Host:
        hosts.append(Host(built / name, *arguments))
        return hosts[-1]

    yield start
    for host in hosts:
        host.close()


INFO = m.HwGetInfo(
    serial_number=94000001,
    model_number="BBD102",
    type=44,
    software_version=bytes(4),
    notes="",
    hw_version=1,
    mod_state=0,
    nchs=1,
)


def test_the_host_only_reads_without_a_position(start: Start) -> None:
    host = start("host")
    assert isinstance(host.port.next(), m.HwReqInfo)
    host.answer(INFO)
    assert isinstance(host.port.next(), m.MotReqVelParams)
    host.answer(
        m.MotGetVelParams(chan_ident=1, min_velocity=0, acceleration=13744, max_velocity=13_421_773)
    )
    status, out, err = host.end()
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "BBD102, serial number 94000001",
        "velocity 100000 um/s, acceleration 1000008 um/s^2",
    ]
    assert host.port.next(0.05) is None


def test_the_host_converts_moves_and_waits_for_the_end_of_the_move(start: Start) -> None:
    host = start("host", "25000", "-1000")
    host.port.next()
    host.answer(INFO)
    host.port.next()
    host.answer(m.MotGetVelParams(chan_ident=1, min_velocity=0, acceleration=13744, max_velocity=1))
    velocity = stages.MLS203.scale("velocity", "BBD102")
    set_ = host.port.next()
    assert isinstance(set_, m.MotSetVelParams)
    assert (set_.acceleration, set_.max_velocity) == (13744, velocity.to_counts(25))
    assert isinstance(host.port.next(), m.MotReqVelParams)
    host.answer(
        m.MotGetVelParams(
            chan_ident=1, min_velocity=0, acceleration=13744, max_velocity=set_.max_velocity
        )
    )
    move = host.port.next()
    assert isinstance(move, m.MotMoveAbsolute)
    assert move.absolute_distance == -20_000
    # Other messages, and messages of other devices, do not end the wait.
    status = m.MotGetDcStatusUpdate(chan_ident=1, position=5, velocity=0, status_bits=0)
    ended = m.MotMoveCompletedDc(chan_ident=1, position=-20_000, velocity=0, status_bits=0)
    host.answer(status)
    host.port.send(b"\xff\xff" + ended.replace(position=3).pack(dest=HOST, source=0x22))
    assert host.process.poll() is None
    host.answer(ended)
    status_, out, err = host.end()
    assert (status_, err) == (0, "")
    assert out.splitlines()[-1] == "moved to -1000 um"


def test_the_host_stops_if_the_controller_is_silent(start: Start) -> None:
    host = start("host", "25000", "1000")
    assert isinstance(host.port.next(), m.HwReqInfo)
    status, out, err = host.end()
    assert (status, out, err) == (1, "", "timeout: no reply\n")
    assert host.port.next(0.05) is None


@pytest.mark.parametrize(
    "arguments", [(), ("p", "1"), ("p", "1", "x"), ("p", "", "1"), ("p", "1", "9" * 30)]
)
def test_the_host_prints_its_usage(built: Path, arguments: tuple[str, ...]) -> None:
    done = subprocess.run([built / "host", *arguments], capture_output=True, text=True)
    assert done.returncode == 2
    assert "PORT [VELOCITY POSITION]" in done.stderr


def test_the_host_of_an_ms2000_reads_a_position(start: Start) -> None:
    host = start("position", "Y")
    framer = MS2000.framer()
    asked: list[object] = []
    while not asked:
        asked = [event.frame for event in framer.feed(os.read(host.port.fd, 100))]
    assert asked == [CommandFrame(c.ReadMotorPosition(), enumerations.Axis.Y)]
    for byte in c.ReadMotorPositionReply(position=-123_456).pack():
        host.port.send(bytes([byte]))
    assert host.end() == (0, "Y is at -12345600 nm\n", "")
