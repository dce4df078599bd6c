# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A slow link between two ``hosts`` that loses packets, like a wireless link."""

import fcntl
import heapq
import itertools
import os
import random
import select
import struct
import threading
import time

from hosts import ip, LINK

# linux/if_tun.h
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
_LONGEST_PACKET = 65536


class PoorLink:
    """
    Forwards packets between two virtual ports in a thread, with a delay and losses.

    :ivar carries: whether it forwards packets at all.
    """

    def __init__(self, hosts, delay_s, loss):
        """
        Connect two hosts.

        :param delay_s: one way.
        :param loss: the fraction of lost packets.
        """
        self.carries = True
        self._delay_s, self._loss = delay_s, loss
        self._ports = [_port(host) for host in hosts]
        self._ended, self._end = os.pipe()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def close(self):
        os.close(self._end)
        self._thread.join()
        for port in (*self._ports, self._ended):
            os.close(port)

    def _carry(self):
        chance, order = random.Random(7), itertools.count()
        other = dict(zip(self._ports, reversed(self._ports), strict=True))
        under_way = []
        while True:
            rest_s = max(0.0, under_way[0][0] - time.monotonic()) if under_way else None
            ready, _, _ = select.select([*self._ports, self._ended], [], [], rest_s)
            if self._ended in ready:
                return
            for port in ready:
                packet = os.read(port, _LONGEST_PACKET)
                if self.carries and chance.random() >= self._loss:
                    heapq.heappush(under_way, (
                        time.monotonic() + self._delay_s, next(order), other[port], packet))
            while under_way and under_way[0][0] <= time.monotonic():
                _, _, port, packet = heapq.heappop(under_way)
                os.write(port, packet)


def _port(host):
    """Create a virtual port in a host; return the file to read and write its packets."""
    name = f'port{os.getpid() % 100_000}_{host.number}'
    port = os.open('/dev/net/tun', os.O_RDWR)
    fcntl.ioctl(port, _TUNSETIFF, struct.pack('16sH', name.encode(), _IFF_TUN | _IFF_NO_PI))
    ip('link', 'set', name, 'netns', host.name, 'name', LINK)
    host.raise_link()
    return port
