"""Crowds of hostile connections from one address, in a process of their own, and what a good viewer of another meets.

Loopback only: 127.0.0.2, 127.0.0.3 and so on are different addresses there.
"""

import contextlib
import multiprocessing
import os
import resource
import selectors
import socket
import time

UPGRADE = (
    b"GET /tandem HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: tandem.4\r\n%s\r\n"
)
BY_PORT = 24  # IP_BIND_ADDRESS_NO_PORT: the port is chosen when it connects, so there are enough of them

# What each connection says at first, and then once a second.
CROWDS = {
    "idle": (b"", b""),
    "slow": (b"GET / HTTP/1.1\r\nHost: x\r\n", b"X-More: of it\r\n"),
    "silent": (UPGRADE % b"", b""),
    "garbage": (bytes(range(256)) * 16, b"\x81\x85\x00\x00\x00\x00hello"),
}


def connect(port, source, timeout=2):
    connection = socket.socket()
    connection.setsockopt(socket.IPPROTO_IP, BY_PORT, 1)
    connection.settimeout(timeout)
    connection.bind((source, 0))
    try:
        connection.connect(("127.0.0.1", port))
    except OSError:
        connection.close()
        raise
    return connection


def _run(kind, port, source, count, per_second, end, held):
    first, then = CROWDS[kind]
    waiting, open_now, budget, at = selectors.EpollSelector(), {}, 200.0, time.monotonic()

    def drop(connection):
        with contextlib.suppress(KeyError):
            waiting.unregister(connection)
        open_now.pop(connection, None)
        connection.close()

    while not end.is_set():
        now = time.monotonic()
        budget = min(budget + (now - at) * per_second, 200.0)
        at = now
        while len(open_now) < count and budget >= 1:
            budget -= 1
            connection = socket.socket()
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_IP, BY_PORT, 1)
            connection.bind((source, 0))
            with contextlib.suppress(BlockingIOError):
                connection.connect(("127.0.0.1", port))
            open_now[connection] = now
            waiting.register(connection, selectors.EVENT_WRITE)
        for key, _ in waiting.select(0.02):
            connection = key.fileobj
            try:
                if key.events == selectors.EVENT_WRITE:
                    if first:
                        connection.send(first)
                    waiting.modify(connection, selectors.EVENT_READ)
                elif not connection.recv(65536):
                    drop(connection)
            except BlockingIOError:
                pass
            except OSError:
                drop(connection)
        for connection, said in list(open_now.items()) if then else ():
            if now - said < 1:
                continue
            open_now[connection] = now
            try:
                connection.send(then)
            except BlockingIOError:
                pass
            except OSError:
                drop(connection)
        held.value = len(open_now)


class Crowd:
    """`count` connections; one that ends is opened again, `per_second` in all."""

    def __init__(self, kind, port, source="127.0.0.2", count=5000, per_second=2000):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if soft < count + 100:
            resource.setrlimit(resource.RLIMIT_NOFILE, (min(count + 100, hard), hard))
        if hard < count + 100:
            count = hard - 100
            print(f"  only {count} connections: RLIMIT_NOFILE is {hard}")
        self.end, self.held = multiprocessing.Event(), multiprocessing.Value("i", 0)
        arguments = (kind, port, source, count, per_second, self.end, self.held)
        self.process = multiprocessing.Process(target=_run, args=arguments, daemon=True)

    def __enter__(self):
        self.process.start()
        return self

    def __exit__(self, *_):
        self.end.set()
        self.process.join(10)
        self.process.kill()


def read_frame(stream):
    """A short message of a gateway: kind of frame and bytes."""
    head = stream.read(2)
    if len(head) < 2:
        raise ConnectionError("it ended")
    size = head[1] & 127
    if size >= 126:
        size = int.from_bytes(stream.read(2 if size == 126 else 8), "big")
    return head[0] & 15, stream.read(size)


def open_viewer(port, source, headers=b""):
    """A WebSocket, and its first frame."""
    connection = connect(port, source)
    try:
        connection.sendall(UPGRADE % headers)
        stream = connection.makefile("rb")
        status = stream.readline()
        if b" 101 " not in status:
            raise ConnectionError(status.decode("latin-1").strip() or "it ended")
        while stream.readline().strip():
            pass
        return connection, read_frame(stream)
    except OSError:
        connection.close()
        raise


def attempts(port, count=14, source="127.0.0.9", apart_s=0.2):
    """Seconds until each of so many viewers was told of the session; None for one that was not."""
    taken = []
    for _ in range(count):
        began = time.monotonic()
        try:
            connection, (kind, _) = open_viewer(port, source)
            connection.close()
            taken.append(time.monotonic() - began if kind == 2 else None)
        except OSError:
            taken.append(None)
        time.sleep(apart_s)
    return taken


def cpu_s(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
