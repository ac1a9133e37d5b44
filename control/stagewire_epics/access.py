"""Access: which clients may put values.

Clients state their host and user themselves, so this protects against mistakes and not against attacks.
"""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_epics.records import Record


@dataclass(frozen=True, slots=True)
class Access:
    """The clients that may put values. Everyone may read and stop.

    :param read_only: whether all puts are refused.
    :param hosts: names or addresses of hosts; empty: every host.
    :param users: names of users; empty: every user.
    """

    read_only: bool = False
    hosts: frozenset[str] = frozenset()
    users: frozenset[str] = frozenset()

    def permits(self, record: Record, user: str, *hosts: str) -> bool:
        """Return whether a client may put a value into a record.

        :param user: the user that the client states.
        :param hosts: the host that it states, and the address from which it is connected.
        """
        if not record.writable:
            return False
        if record.stops:
            return True
        if self.read_only:
            return False
        host_fits = not self.hosts or not self.hosts.isdisjoint(hosts)
        return host_fits and (not self.users or user in self.users)
