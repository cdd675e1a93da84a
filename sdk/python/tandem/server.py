"""A simulation in numpy, streamed by a server: the door of `idl/ENGINE.md`."""

import ctypes
import dataclasses
import operator
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
import warnings
import weakref

import mmap
import numpy as np

from tandem.errors import Error, Result

_HELLO, _LAYOUT, _START, _INPUT, _STEP, _DONE, _SAVE, _SAVED, _LOAD, _LOADED, _ERROR, _BYE, _NEWS = range(1, 14)
_EVENT, _KEY, _NO_KEY = range(1, 4)  # entries of NEWS
_MOST_NEWS, _MOST_MESSAGE = 2 << 20, 1 << 16  # bytes of NEWS that one frame tells, and of a message
_KINDS = {1: "gravity", 2: "push", 16: "application"}
_ARGUMENTS = {"input gravity": "gravity_limit", "input push": "push_limit", "input application": "application_limit", "save": "save",
              **{key: key for key in ("capacity", "dt", "name", "up", "gravity", "damping", "threshold", "extent", "step_limit")}}  # fmt: skip
_FLOATS = {"position": 3, "velocity": 3, "orientation": 4, "angular_velocity": 3}


@dataclasses.dataclass(frozen=True)
class Type:
    """What clients draw for a type of bodies. `values`: those of the shape, see BodyShape in `tandem/body_shape.hpp`."""

    name: str = "body"
    radius: float = 0.5  #: of the sphere around a body
    colour: str = "#C0C0C0"
    mass: float = 1.0
    shape: str = "sphere"
    values: tuple = ()

    def __post_init__(self):
        if len(str(self.name).split()) != 1:
            raise ValueError(f"Type: a name has no blanks, and is not empty: {self.name!r}")
        if not re.fullmatch("#?([0-9A-Fa-f]{6}|[0-9A-Fa-f]{8})", str(self.colour)):
            raise ValueError(f"Type {self.name!r}: a colour is '#RRGGBB' or '#RRGGBBAA', not {self.colour!r}")

    def _line(self):
        colour = f"{self.colour.lstrip('#').upper():F<8}"
        return " ".join(map(str, ("type", self.name, self.radius, colour, self.mass, self.shape, *self.values)))


@dataclasses.dataclass(frozen=True)
class Input:
    """What a user did. It acts in the frame that has it."""

    kind: str  #: gravity, push or application
    values: np.ndarray  #: of gravity: x, y, z; of a push: centre, radius, change of velocity
    bytes: bytes = b""  #: of an application

    @property
    def centre(self):
        return self.values[:3]

    @property
    def radius(self):
        return self.values[3]

    @property
    def velocity(self):
        return self.values[4:7]


class Frame:
    """The frame to compute; valid in its turn of the loop only. The columns are the server's memory: write all of each."""

    def __init__(self, server, number, inputs):
        self._server, self.number, self.inputs = server, number, inputs

    position = property(lambda self: self._server._columns["position"], doc="(capacity, 3)")
    velocity = property(lambda self: self._server._columns["velocity"], doc="(capacity, 3)")
    orientation = property(lambda self: self._server._columns["orientation"], doc="(capacity, 4): x, y, z, w")
    angular_velocity = property(lambda self: self._server._columns["angular_velocity"], doc="(capacity, 3), rad/s")
    alive = property(lambda self: self._server._columns["alive"], doc="(capacity,), 0: dead; another value: another body")
    type = property(lambda self: self._server._columns["type"], doc="(capacity,)")
    colliding = 0  #: bodies in contact, for statistics

    def write(self, *, alive=None, reborn=(), **columns):
        """Copies columns of the first n slots; the other slots keep what they have. `alive`: truths; a slot that comes alive has a new
        body. `reborn`: slots that have a new body, though they lived before; also where a body left a periodic box and is back at its
        other side, which clients otherwise draw in flight across the box: `reborn=np.nonzero(wrapped)[0]`."""
        self._server._write(columns, alive, reborn)


class Server:
    """Streams a simulation that runs here. Starts `tandemd`, unless `tandemd --engine` started this program, or `door` is the path of
    its `--engine-socket`, or `tcp:HOST:PORT` of its `--engine-listen` on another machine, with the `token` of its `--engine-token`.

    `dt`: seconds of a step. `turns`: bodies have orientations. `gravity_limit`, `push_limit`: the largest input of a user, None: refused;
    `application_limit`: bytes. `save()` returns bytes and `load(bytes)` the columns for `Frame.write()`, or None if they are of another
    world; with both the server can keep checkpoints. `keys`, `events`: what `set_key()` and `broadcast()` may tell.
    `hello`: further lines of idl/ENGINE.md, such as "plane 0 1 0 0".
    `options`: further flags of tandemd. `view`: also starts `tandem-gateway` for browsers of this machine; `url` is where they look.
    Errors: `tandem.Error`.
    """

    url = None  #: of the viewer, with `view`
    _open = weakref.WeakSet()

    def __init__(self, capacity, dt, *, session="default", domain=0, types=(), name="python", dtype=np.float32, turns=False,
                 gravity=(0, 0, 0), damping=0, up="y", threshold=None, extent=None, gravity_limit=1000, push_limit=1000,
                 application_limit=None, step_limit=30, save=None, load=None, keys=False, events=False, hello=(), door=None, token=None, options=(), tandemd=None, view=False):  # fmt: skip
        self._process, self._viewer, self._socket, self._columns, self._slot = None, None, None, {}, b""
        self._save, self._load, self._births, self._place = save, load, None, None
        self._news, self._news_bytes, self._tells = [], 0, []
        wanted = {"threshold": threshold, "extent": extent, "input gravity": gravity_limit, "input push": push_limit, "input application": application_limit}
        asked = [word for word, wish in (("keys", keys), ("events", events)) if wish]
        lines = ["engine 1.2", f"name {name}", f"capacity {int(capacity)}", f"dt {float(dt)!r}", f"up {up}", f"turns {int(turns)}",
                 f"float {np.dtype(dtype).itemsize * 8}", f"gravity {' '.join(str(float(v)) for v in gravity)}", f"damping {damping}",
                 f"save {int(save is not None and load is not None)}", f"step_limit {step_limit}",
                 *(f"{key} {value}" for key, value in wanted.items() if value is not None),
                 *([" ".join(["news", *asked])] if asked else []), *(each._line() for each in types), *hello]  # fmt: skip
        door = door or os.environ.get("TANDEM_DOOR")
        self._remote = door is not None and door.startswith("tcp:")
        if self._remote:
            lines += ["memory inline", f"token {token or os.environ.get('TANDEM_DOOR_TOKEN', '-')}"]
        self._connect(door, session, domain, options, tandemd)
        try:
            self._send(_HELLO, "\n".join(lines).encode() + b"\n")
            self._take_layout()
            if missing := [word for word in asked if word not in self._tells]:
                raise Error(Result.UNSUPPORTED, f"this tandemd has no {' or '.join(missing)}: a later one is needed")
            if view:
                self._start_viewer(session, domain, [str(word) for word in options])
        except BaseException:
            self.close()
            raise

    def _connect(self, door, session, domain, options, tandemd):
        if door is not None and door.startswith("fd:"):
            self._socket = socket.socket(fileno=int(door[3:]))
            return
        if self._remote:
            host, _, port = door[4:].rpartition(":")
            self._socket = socket.create_connection((host.strip("[]"), int(port)), 10)
            self._socket.settimeout(None)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            return
        if door is not None:
            self._socket = socket.socket(socket.AF_UNIX)
            self._socket.connect(door)
            return
        program = tandemd or os.environ.get("TANDEMD") or shutil.which("tandemd")
        if program is None:
            raise Error(Result.IO, "tandemd is not in the PATH: install tandem-server, or give its path as tandemd=")
        self._socket, theirs = socket.socketpair()
        with theirs:
            defaults = {"--session": session, "--domain": domain}  # a flag may be given once only
            flags = [word for flag, value in defaults.items() if flag not in options for word in (flag, value)]
            command = [program, "--engine-fd", theirs.fileno(), *flags, *options]
            self._process = subprocess.Popen(list(map(str, command)), pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL)
        self._place = (session, domain)
        Server._open.add(self)

    def _start_viewer(self, session, domain, options):
        program = os.environ.get("TANDEM_GATEWAY") or shutil.which("tandem-gateway")
        if program is None:
            raise Error(Result.IO, "tandem-gateway is not in the PATH: install it, or leave out view=True")
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        flags = {"--session": session, "--domain": domain, "--port": port}
        shared = ("--session", "--domain", "--secure", "--profile")  # with tandemd
        flags.update((flag, value) for flag, value in zip(options, options[1:]) if flag in shared)
        with_this = lambda: ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG: it ends with this process
        self._viewer = subprocess.Popen([program, *(str(word) for flag in flags.items() for word in flag)],
                                        stdin=subprocess.DEVNULL, preexec_fn=with_this)  # fmt: skip
        self.url = f"http://127.0.0.1:{port}/"

    def _watch_viewer(self):
        code = None if self._viewer is None else self._viewer.poll()
        if code is not None:
            warnings.warn(f"tandem-gateway ended with exit code {code}, so nothing is at {self.url}; what it wrote says why")
            self._viewer = None

    def _take_layout(self):
        try:
            head, fds, _, _ = socket.recv_fds(self._socket, 8, 1)
        except ConnectionError:
            head, fds = b"", []
        head += self._receive(8 - len(head))
        kind, length = struct.unpack("<II", head)
        body = self._receive(length)
        if kind != _LAYOUT:
            self._fail(kind, body)
        numbers, columns, inline = {}, [], False
        for line in body.decode().splitlines():
            key, *values = line.split()
            if key == "column":
                columns.append((values[0], values[1], int(values[2]), int(values[3])))
            elif key == "news":
                self._tells = values
            elif values and values[0].isdigit():
                numbers[key] = int(values[0])
            inline = inline or (key == "memory" and values == ["inline"])
        if inline:
            memory = self._slot = bytearray(numbers["slot_bytes"])
        else:
            memory = mmap.mmap(fds[0], numbers["bytes"])  # lives as long as an array on it
            os.close(fds[0])
        self.capacity, padded = numbers["capacity"], numbers["padded"]
        self._head = np.frombuffer(memory, np.uint64, 3, numbers["first"])
        dtypes = {"f32": np.float32, "f64": np.float64, "u8": np.uint8, "u16": np.uint16}
        for name, element, axes, offset in columns:
            flat = np.frombuffer(memory, dtypes[element], axes * padded, numbers["first"] + offset).reshape(axes, padded)
            self._columns[name] = flat[:, : self.capacity].T if axes > 1 else flat[0, : self.capacity]
        if "orientation" in self._columns:
            self._columns["orientation"][:, 3] = 1
        self._births = np.zeros(self.capacity, np.uint8)

    def start(self, *, alive=True, **columns):
        """The start frame: columns as in `Frame.write()`. The server announces the session then."""
        self._write(columns, alive, ())
        self._answer(_START, b"", 0)

    def frames(self):
        """Yields a `Frame` at a time, at the server's pace, until the server ends as planned: its time is over, or it was stopped.
        Otherwise `tandem.Error` says why it ended."""
        inputs = []
        while True:
            kind, body = self._message()
            if kind == _BYE:
                return self._check_exit()
            if kind == _INPUT:
                _, number, count = struct.unpack_from("<QII", body)
                values = np.frombuffer(body, np.float64, count, 16) if number < 16 else np.empty(0)
                inputs.append(Input(_KINDS.get(number, str(number)), values, body[16:] if number >= 16 else b""))
            elif kind == _STEP:
                number, slot, _ = struct.unpack("<QII", body)
                frame, inputs = Frame(self, number, inputs), []
                self._watch_viewer()
                began_ns = time.monotonic_ns()
                yield frame
                self._send_news(number)
                self._answer(_DONE, struct.pack("<QIIQ", number, slot, int(frame.colliding), time.monotonic_ns() - began_ns), number)
            elif kind == _SAVE:
                data = bytes(self._save())
                if not self._remote:
                    pathlib.Path(body.decode()).write_bytes(data)
                self._send(_SAVED, struct.pack("<Q", len(data)), data if self._remote else b"")
            elif kind == _LOAD:
                number = struct.unpack_from("<Q", body)[0]
                columns = self._load(body[8:] if self._remote else pathlib.Path(body[8:].decode()).read_bytes())
                if columns is not None:
                    self._write(dict(columns), columns.get("alive"), ())
                self._answer(_LOADED, struct.pack("<QII", number, columns is not None, 0), number)
            else:
                self._fail(kind, body)

    def set_key(self, name, value):
        """Gives a key of the session, 1 to 64 characters of ASCII, the value of these bytes: clients have the latest one from the frame
        on that is computed now, or else the next one, also those that join later. At most 256 keys, with their values 64 KiB.
        What is beyond that the server refuses, and its log says so. Errors: `tandem.Error` with UNSUPPORTED without `keys=True`,
        INVALID_ARGUMENT, CAPACITY (more than a frame can tell)."""
        key, value = self._key(name), memoryview(value).tobytes()
        if len(key) + len(value) > _MOST_MESSAGE - 24:
            raise Error(Result.INVALID_ARGUMENT, f"key {name!r}: with its value it has at most {_MOST_MESSAGE - 24} bytes")
        self._tell(_KEY, len(key), 0, key + value)

    def remove_key(self, name):
        """Removes a key, if it is there. Errors: as `set_key()`."""
        self._tell(_NO_KEY, 0, 0, self._key(name))

    def broadcast(self, kind, data=b"", body=None):
        """Tells every client that plays, once, that something happened in the frame that is computed now, or else the next one. `kind`:
        below 2^31, what it means is the application's; `data`: at most 1,024 bytes; `body`: the slot of the body that it is about. A
        frame tells 64 events, up to 1,024 wait, and more the server refuses; its log says so. Errors: as `set_key()`, with `events=True`."""
        if "events" not in self._tells:
            raise Error(Result.UNSUPPORTED, "the session has no events: ask for them with events=True")
        kind, data = operator.index(kind), memoryview(data).tobytes()
        slot = 0xFFFFFFFF if body is None else operator.index(body)
        if not 0 <= kind < 1 << 31:
            raise Error(Result.INVALID_ARGUMENT, f"an event's kind is a number below 2^31, not {kind}")
        if len(data) > 1024:
            raise Error(Result.INVALID_ARGUMENT, f"an event has at most 1,024 bytes, not {len(data)}")
        if body is not None and not 0 <= slot < self.capacity:
            raise Error(Result.INVALID_ARGUMENT, f"there is no slot {slot}")
        self._tell(_EVENT, kind, slot, data)

    def _key(self, name):
        if "keys" not in self._tells:
            raise Error(Result.UNSUPPORTED, "the session has no keys: ask for them with keys=True")
        if not re.fullmatch("[ -~]{1,64}", name):
            raise Error(Result.INVALID_ARGUMENT, f"a key has 1 to 64 characters of ASCII without control characters: {name!r}")
        return name.encode()

    def _tell(self, what, first, slot, content):
        entry = struct.pack("<IIII", what, first, slot, len(content)) + content
        if self._news_bytes + len(entry) > _MOST_NEWS:
            raise Error(Result.CAPACITY, f"the keys and events of a frame have at most {_MOST_NEWS} bytes")
        self._news.append(entry)
        self._news_bytes += len(entry)

    def _send_news(self, number):
        entries, self._news, self._news_bytes = self._news, [], 0
        body = b""
        for entry in [*entries, b""]:
            if body and (not entry or 8 + len(body) + len(entry) > _MOST_MESSAGE):
                self._send(_NEWS, struct.pack("<Q", number) + body)
                body = b""
            body += entry

    def _write(self, columns, alive, reborn):
        columns.pop("alive", None)
        for name, values in columns.items():
            if name not in self._columns:
                raise TypeError(f"there is no column {name!r}; there are {', '.join(self._columns)}")
            self._columns[name][: len(values)] = values
        marks = self._columns["alive"]
        if alive is not None:
            lives = np.broadcast_to(np.asarray(alive, bool), self.capacity) if np.ndim(alive) == 0 else np.asarray(alive, bool)
            now = marks[: len(lives)]
            born = lives & (now == 0)
            self._births[: len(lives)][born] = self._births[: len(lives)][born] % 255 + 1
            now[~lives] = 0
            now[born] = self._births[: len(lives)][born]
        reborn = np.asarray(reborn, np.intp)
        if reborn.size:
            self._births[reborn] = self._births[reborn] % 255 + 1
            marks[reborn] = self._births[reborn]

    def _answer(self, kind, body, number):
        self._head[:] = number
        self._send(kind, body, self._slot)

    def _send(self, kind, body, tail=b""):
        try:
            self._socket.sendall(struct.pack("<II", kind, len(body) + len(tail)) + body)
            if tail:
                self._socket.sendall(tail)
        except OSError:
            pass  # the server hung up: it may have said why, which the next message tells

    def _receive(self, count):
        held = bytearray()
        while len(held) < count:
            try:
                got = self._socket.recv(count - len(held))
            except ConnectionError:
                got = b""
            if not got:
                self._check_exit()
                raise Error(Result.IO, "the server is gone, and did not say why")
            held += got
        return bytes(held)

    def _message(self):
        kind, length = struct.unpack("<II", self._receive(8))
        return kind, self._receive(length)

    def _check_exit(self):
        """The server said no more: it may have failed."""
        try:
            code = self._process.wait(5) if self._process is not None else 0
        except subprocess.TimeoutExpired:
            return
        if code != 0:
            how = f"exit code {code}" if code > 0 else signal.Signals(-code).name
            raise Error(Result.IO, f"tandemd ended with {how}; what it wrote says why")

    def _fail(self, kind, body):
        if kind != _ERROR:
            raise Error(Result.UNSUPPORTED, f"the server sent a message of type {kind}")
        why = body.decode("utf-8", "replace")
        for line, argument in _ARGUMENTS.items():
            why = why.replace(f"the engine's line `{line} ", f"`{argument}=").replace(f"the engine's line `{line}", f"`{argument}")
        taken = "already has a server" in why
        if taken and any(other is not self and other._place == self._place for other in Server._open):
            why += "; an earlier tandem.Server of this process has it: close() that one, or use `with`"
        begun = "the server ended" if self._columns else "the server refuses this engine"
        raise Error(Result.CONFLICT if taken else Result.INVALID_ARGUMENT, f"{begun}: {why}")

    def close(self):
        """Ends the session, and waits for the programs that this started."""
        Server._open.discard(self)
        if self._socket is not None:
            self._socket.close()
        if self._viewer is not None:
            self._viewer.terminate()
        for process in filter(None, (self._process, self._viewer)):
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._socket, self._process, self._viewer = None, None, None

    def __enter__(self):
        return self

    def __exit__(self, kind, value, traceback):
        if self._socket is not None:
            last = f"{kind.__name__}: {value}" if kind is not None and not issubclass(kind, KeyboardInterrupt) else ""
            try:
                message = (_ERROR, last.encode()[:500]) if last else (_BYE, b"")
                self._socket.sendall(struct.pack("<II", message[0], len(message[1])) + message[1])
            except OSError:
                pass
        if self._process is not None and kind is None and sys.exc_info()[0] is None:
            self._process.terminate()
        self.close()
