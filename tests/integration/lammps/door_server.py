"""The server's side of idl/ENGINE.md with one process at the other end, for tests of engines."""

import mmap
import os
import signal
import socket
import struct
import subprocess
import tempfile

import numpy as np

HELLO, LAYOUT, START, INPUT, STEP, DONE, SAVE, SAVED, LOAD, LOADED, ERROR, BYE = range(1, 13)
GRAVITY, PUSH = 1, 2
LIMIT_S = 120  # a busy machine is slow


class Ended(Exception):
    """The engine said ERROR, or hung up."""


class DoorServer:
    """Starts an engine and plays until the block ends. `position`, `velocity` (3, n), `alive`, `type` are of the frame."""

    def __init__(self, command, environment=()):
        self.folder = tempfile.TemporaryDirectory()
        self.log = open(os.path.join(self.folder.name, "log"), "w+b")
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        path = os.path.join(self.folder.name, "door")
        self.listener.bind(path)
        self.listener.listen(1)
        self.listener.settimeout(0.2)
        self.frame = 0
        self.process = subprocess.Popen(
            list(map(str, command)),
            env={**os.environ, **dict(environment), "TANDEM_DOOR": path},
            stdout=self.log,
            stderr=self.log,
            start_new_session=True,
        )

    def __enter__(self):
        try:
            while True:
                try:
                    self.socket, _ = self.listener.accept()
                    break
                except TimeoutError:
                    if self.process.poll() is not None:
                        raise Ended(self.output()) from None
            self.socket.settimeout(LIMIT_S)
            self.hello = [line.split(" ") for line in self.expect(HELLO).decode().splitlines()]
            self.make_memory()
            self.expect(START)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if hasattr(self, "socket"):
            try:
                self.send(BYE)
            except OSError:
                pass
            self.socket.close()
        try:
            self.exit_code = self.process.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.exit_code = self.process.wait()
        self.listener.close()
        self.text = self.output()
        self.log.close()
        self.folder.cleanup()

    def output(self):
        self.log.flush()
        self.log.seek(0)
        return self.log.read().decode(errors="replace")

    def lines(self, key):
        """The values of all lines of HELLO with this key."""
        return [line[1:] for line in self.hello if line[0] == key]

    def send(self, kind, body=b""):
        self.socket.sendall(struct.pack("<II", kind, len(body)) + body)

    def receive(self, count):
        data = b""
        while len(data) < count:
            got = self.socket.recv(count - len(data))
            if not got:
                raise Ended(self.output())
            data += got
        return data

    def expect(self, kind):
        got, length = struct.unpack("<II", self.receive(8))
        body = self.receive(length)
        if got == ERROR:
            raise Ended(body.decode())
        assert got == kind, f"message {got}, not {kind}"
        return body

    def make_memory(self):
        capacity = int(self.lines("capacity")[0][0])
        padded = (capacity + 15) // 16 * 16
        lines = [f"layout 1.0\nmemory shared\ncapacity {capacity}\npadded {padded}\nslots 1\nfirst 4096\n"]
        offset, places = 64, {}
        for name, kind, axes, dtype in [("position", "f32", 3, "f4"), ("velocity", "f32", 3, "f4"), ("alive", "u8", 1, "u1"), ("type", "u16", 1, "u2")]:
            lines.append(f"column {name} {kind} {axes} {offset}\n")
            places[name] = (offset, axes, dtype)
            offset += -(-axes * padded * np.dtype(dtype).itemsize // 64) * 64
        slot_bytes = -(-offset // 4096) * 4096
        descriptor = os.memfd_create("door")
        os.ftruncate(descriptor, 4096 + slot_bytes)
        self.memory = mmap.mmap(descriptor, 4096 + slot_bytes)
        lines.append(f"bytes {4096 + slot_bytes}\nslot_bytes {slot_bytes}\n")
        for name, (at, axes, dtype) in places.items():
            column = np.frombuffer(self.memory, dtype, axes * padded, 4096 + at).reshape(axes, padded)[:, :capacity]
            setattr(self, name, column if axes > 1 else column[0])
        body = "".join(lines).encode()
        socket.send_fds(self.socket, [struct.pack("<II", LAYOUT, len(body)) + body], [descriptor])
        os.close(descriptor)

    def input(self, kind, *values):
        self.send(INPUT, struct.pack(f"<QII{len(values)}d", self.frame + 1, kind, len(values), *values))

    def step(self, count=1):
        for _ in range(count):
            self.frame += 1
            self.send(STEP, struct.pack("<QII", self.frame, 0, 0))
            frame, _, _, _ = struct.unpack("<QIIQ", self.expect(DONE))
            assert frame == self.frame
            assert struct.unpack_from("<QQQ", self.memory, 4096) == (frame, frame, frame)
        return self

    def save(self, path):
        self.send(SAVE, str(path).encode())
        (size,) = struct.unpack("<Q", self.expect(SAVED))
        return size

    def load(self, path, frame):
        self.send(LOAD, struct.pack("<Q", frame) + str(path).encode())
        loaded = struct.unpack("<QII", self.expect(LOADED))[1]
        if loaded:
            self.frame = frame
        return bool(loaded)

    def state(self):
        """Copies of position, velocity, alive and type, with zeros where nobody lives."""
        lives = self.alive != 0
        return self.position * lives, self.velocity * lives, self.alive.copy(), self.type * lives
