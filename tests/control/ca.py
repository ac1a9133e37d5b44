"""``stagewire ioc`` in another process, for clients of Channel Access in this one."""

from __future__ import annotations

import os
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lines import COMMAND


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


PORT = _free_port()
"""Port of all IOCs of this process, because libca reads its addresses once."""
PVA_PORT = _free_port()
os.environ.update(
    EPICS_PVA_NAME_SERVERS=f"127.0.0.1:{PVA_PORT}",
    EPICS_PVA_ADDR_LIST="127.0.0.1",
    EPICS_PVA_AUTO_ADDR_LIST="NO",
)
os.environ.update(EPICS_CA_ADDR_LIST=f"127.0.0.1:{PORT}", EPICS_CA_AUTO_ADDR_LIST="NO")

FOUND = 30.0
"""Seconds within which a client finds an IOC: after a lost connection, p4p tries again only every 10 s."""

PVA = ("--pva", "--pva-port", str(PVA_PORT))
"""Options of an IOC that also serves pvAccess."""


class IocProcess:
    """An IOC in another process.

    :param process: the process.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.log: list[str] = []
        self._told = threading.Condition()
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            with self._told:
                self.log.append(line)
                self._told.notify_all()

    def wait_for(self, text: str, timeout: float = 20) -> None:
        """Wait until a line of the log contains a text."""
        with self._told:
            found = self._told.wait_for(lambda: any(text in one for one in self.log), timeout)
        assert found, "".join(self.log)

    def end(self) -> int:
        """Terminate the IOC, and return its exit status."""
        self.process.terminate()
        status = self.process.wait(20)
        self.close()
        return status

    def close(self) -> None:
        """Kill the IOC, if it still runs."""
        self.process.kill()
        self.process.wait()
        self._thread.join()
        assert self.process.stderr is not None
        self.process.stderr.close()


@contextmanager
def ioc(folder: Path, bench: str, *options: str, opens: bool = True) -> Iterator[IocProcess]:
    """Run an IOC until the end of the block."""
    path = folder / "bench.toml"
    path.write_text(bench)
    words = [*COMMAND, "ioc", str(path), "--port", str(PORT), *options]
    one = IocProcess(subprocess.Popen(words, stderr=subprocess.PIPE, text=True))
    try:
        one.wait_for("by Channel Access on 127.0.0.1")
        if opens:
            one.wait_for("is open")
        yield one
    finally:
        one.close()
