"""Several machines on one: network namespaces of Linux, connected by a bridge in another one."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

_NETWORK = 0x40000000
"""CLONE_NEWNET"""


def reason_to_skip() -> str:
    """Return why this computer cannot have network namespaces; empty if it can."""
    if shutil.which("ip") is None:
        return "requires ip, of the package iproute2"
    probe = f"probe{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", probe], capture_output=True, text=True)
    with suppress(subprocess.CalledProcessError):
        _ip("netns", "delete", probe)
    return f"requires network namespaces: {made.stderr.strip()}" if made.returncode else ""


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


class Machine:
    """A machine.

    :param namespace: its network namespace.
    :param address: its address.
    :param network: namespace of the bridge.
    """

    def __init__(self, namespace: str, address: str, network: str) -> None:
        self.namespace = namespace
        self.address = address
        self._network = network
        self._port = "p" + address.rpartition(".")[2]
        _ip("netns", "add", namespace)
        _ip("-n", namespace, "link", "set", "lo", "up")
        card = ("peer", "name", "eth0", "netns", namespace)
        _ip("-n", network, "link", "add", self._port, "type", "veth", *card)
        _ip("-n", namespace, "address", "add", f"{address}/24", "broadcast", "+", "dev", "eth0")
        _ip("-n", namespace, "link", "set", "eth0", "up")
        _ip("-n", network, "link", "set", self._port, "up")
        self.plug()

    def plug(self) -> None:
        """Connect the machine to the network."""
        _ip("-n", self._network, "link", "set", self._port, "master", "bridge")

    def unplug(self) -> None:
        """Disconnect the machine from the network; its card does not notice."""
        _ip("-n", self._network, "link", "set", self._port, "nomaster")

    def command(self, words: Sequence[str]) -> list[str]:
        """Return a command that runs on the machine."""
        return ["ip", "netns", "exec", self.namespace, *words]

    @contextmanager
    def inside(self) -> Iterator[None]:
        """Open the sockets of this thread, and of threads that it starts, on the machine."""
        with (
            open("/proc/thread-self/ns/net") as home,
            open(f"/run/netns/{self.namespace}") as there,
        ):
            _enter(there.fileno())
            try:
                yield
            finally:
                _enter(home.fileno())


def _enter(namespace: int) -> None:
    if ctypes.CDLL(None, use_errno=True).setns(namespace, _NETWORK):
        raise OSError(ctypes.get_errno(), "cannot enter the network namespace")


@contextmanager
def machines(number: int) -> Iterator[list[Machine]]:
    """Make machines on one network, and delete them at the end."""
    network = f"stagewire{os.getpid()}"
    names = [f"{network}-{at}" for at in range(1, number + 1)]
    try:
        _ip("netns", "add", network)
        _ip("-n", network, "link", "add", "bridge", "type", "bridge")
        _ip("-n", network, "link", "set", "bridge", "up")
        yield [Machine(name, f"10.77.0.{at}", network) for at, name in enumerate(names, 1)]
    finally:
        for name in [*names, network]:
            with suppress(subprocess.CalledProcessError):
                _ip("netns", "delete", name)
