"""Sends many datagrams a second from one Python program: a hundred with each call of sendmmsg().

A datagram apart costs 50 us and more in Python, which keeps a busy machine from reaching the rate.
"""

import ctypes
import os
import socket
import struct
import time

AT_ONCE = 100


class _Iovec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("length", ctypes.c_size_t)]


class _Header(ctypes.Structure):  # struct msghdr
    _fields_ = [
        ("name", ctypes.c_void_p), ("name_length", ctypes.c_uint32), ("vectors", ctypes.c_void_p),
        ("vector_count", ctypes.c_size_t), ("control", ctypes.c_void_p), ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    ]  # fmt: skip


class _Message(ctypes.Structure):  # struct mmsghdr
    _fields_ = [("header", _Header), ("sent", ctypes.c_uint)]


_libc = ctypes.CDLL(None, use_errno=True)


class Cannon:
    """A stock of datagrams, each with its port, which is sent round and round."""

    def __init__(self, out, stock):
        """`out`: a UDP socket of IPv4. `stock`: (address, port, bytes) of each."""
        self.out = out
        self.stock = list(stock)
        self.at = 0
        self._messages = (_Message * len(self.stock))()
        self._vectors = (_Iovec * len(self.stock))()
        self._held = [None] * len(self.stock)  # the memory to which the above points
        for place, datagram in enumerate(self.stock):
            self.load(place, datagram)

    def load(self, place, datagram):
        """Puts another datagram in the place of one."""
        address, port, what = self.stock[place] = datagram
        name = ctypes.create_string_buffer(struct.pack("=H", socket.AF_INET) + struct.pack("!H", port) + socket.inet_aton(address) + bytes(8), 16)
        body = ctypes.create_string_buffer(what, max(len(what), 1))
        self._held[place] = name, body
        vector, message = self._vectors[place], self._messages[place].header
        vector.base, vector.length = ctypes.addressof(body), len(what)
        message.name, message.name_length = ctypes.addressof(name), 16
        message.vectors, message.vector_count = ctypes.addressof(vector), 1

    def fire(self, count):
        """Sends the next ones, at most AT_ONCE and to the end of the stock. Returns those that were sent, and how many the kernel did not take."""
        count = min(count, AT_ONCE, len(self.stock) - self.at)
        first = ctypes.addressof(self._messages) + self.at * ctypes.sizeof(_Message)
        done = _libc.sendmmsg(self.out.fileno(), ctypes.c_void_p(first), count, socket.MSG_DONTWAIT)
        lost = 0 if done > 0 else 1  # the first of them, so that the next call goes on behind it
        sent = self.stock[self.at : self.at + max(done, 0) + lost]
        self.at = (self.at + len(sent)) % len(self.stock)
        return sent, lost


def burn(cannon, rate, seconds, renew, remember):
    """Sends at this rate. `renew(cannon)` is called after each round of the stock, `remember(sent)` with what was sent. Returns
    the number, how many of these the kernel did not take, and the seconds that it took."""
    number, lost = 0, 0
    began = time.monotonic()
    while (passed := time.monotonic() - began) < seconds:
        # Falls behind by a tenth of a second at most, so that there is no burst behind a pause of this program.
        due = min(int(passed * rate) - number, rate // 10)
        while due > 0:
            sent, not_taken = cannon.fire(due)
            remember(sent)
            number += len(sent)
            lost += not_taken
            due -= len(sent)
            if cannon.at == 0:
                renew(cannon)
        time.sleep(0.001)
    return number, lost, time.monotonic() - began


if __name__ == "__main__":  # how fast it is here
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as nowhere:
        fast = Cannon(nowhere, [("127.0.0.1", 9, os.urandom(300)) for _ in range(20_000)])
        count, refused, took = burn(fast, 1_000_000, 3, lambda _: None, lambda _: None)
        print(f"{count / took:.0f} datagrams a second, {refused} not taken, {100 * time.process_time() / took:.0f} % of a core")
