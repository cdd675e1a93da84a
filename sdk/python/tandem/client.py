"""A client of a session, and the sessions on a domain."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Optional, Union

import numpy as np

from tandem import _client
from tandem.bodies import Bodies, data_type
from tandem.errors import Error, Result
from tandem.session import (
    BodyType,
    Event,
    LogLevel,
    News,
    Phase,
    Role,
    SampleMode,
    Scene,
    SessionInfo,
    Solid,
    Status,
)


def version() -> str:
    """The version of the library at run time: "MAJOR.MINOR.PATCH"."""
    return _client.version()


def clock_ns() -> int:
    """The clock of samples and events: the system's monotonic one, nanoseconds."""
    return _client.clock_ns()


def _no_nul(text: str, what: str) -> str:
    if "\0" in text:  # C would read it only up to there
        raise Error(Result.INVALID_ARGUMENT, f"{what} has no NUL")
    return text


def sessions(domain: int = 0, wait: float = 2.0, profile: str = "", secure: str = "") -> list[SessionInfo]:
    """Listens for `wait` seconds without taking part. Returns the sessions on a DDS domain (0..230), by name.

    profile     the kind of network, as of a Client
    secure      folder of this program's identity for DDS Security; empty: none
    """
    browser = _client.Browser(domain, _no_nul(profile, "a profile"), _no_nul(secure, "a folder"))
    time.sleep(wait)
    return [SessionInfo._of(session) for session in browser.list()]


class Sample(Bodies):
    """Bodies as they should be drawn at a moment.

    `velocities`, like `positions`, contain a correction that is being blended in; with smoothing 0 they are those of
    the server. `angular_velocities` contain no correction.
    """

    changes: Optional[np.ndarray]  #: (n,) uint8: a Change, against the client's previous sample

    def __init__(self, columns=None) -> None:
        super().__init__(columns)
        self.frame = 0.0  #: the moment that is drawn, in frames
        self.seconds_since_delta = 0.0  #: time without a message from the server, while bodies are extrapolated
        self.alive_count = 0  #: slots that hold a body
        self.mode = SampleMode.EXTRAPOLATE  #: in force
        self.phase = Phase.SEARCHING  #: JOINING: the last bodies known, while the client joins again


class Client:
    """Holds a session's bodies as its server has them, bit by bit, to draw them and to act on them.

        with tandem.Client() as client:           # session "default" on DDS domain 0
            client.wait_until_playing(10)
            client.send_gravity((3, -9, 0))
            bodies = client.sample()
            print(bodies.frame, bodies.positions[bodies.alive].mean(axis=0))

    Every method raises `Error`; its `code` is INVALID_HANDLE after close().

    Threads: all methods may be called from any thread, also at the same time, with two exceptions: only one thread
    at a time may be in update(), and only one sample() at a time may write to a Sample. Methods that wait release
    the interpreter's lock. `log` is called with that lock, from the thread that does the client's work, while the
    client is locked: return soon, and do not wait for a thread that may be in a call with this client. Methods
    called from `log` raise `Error` IN_CALLBACK; an exception in `log` is reported on stderr and ends there. After
    os.fork() the child has no clients.
    """

    def __init__(
        self,
        session: Optional[str] = None,
        domain: int = 0,
        *,
        observe: bool = False,
        lead: int = 1,
        background: bool = True,
        echo: bool = False,
        prefer: str = "auto",
        profile: str = "",
        secure: str = "",
        url: str = "",
        token: str = "",
        tls_ca: str = "",
        threads: int = 1,
        max_delay: Optional[float] = None,
        max_kbit_s: int = 0,
        log: Optional[Callable[[LogLevel, str], object]] = None,
    ) -> None:
        """Starts looking for a session; returns at once, whether a server is there or not.

        session     1..64 characters of [A-Za-z0-9._-]; None: "default", or with `url` the gateway's session
        domain      DDS domain, 0..230
        observe     only watch: the server never waits for this client, and refuses its input
        lead        frames to simulate beyond the last delta, 0 or 1; the session may allow less
        background  the client has a thread of its own for its work. If False, the application must call update() at
                    least once a frame, which does all the work
        echo        EXPERIMENTAL: sample() shows the application's own gravity at once
        prefer      which stream to play: "auto", "bandwidth", "computing", "error", or a stream's name
        profile     the kind of network: "loopback", "lan", "wifi", "wan:server=ADDRESS" or
                    "multihomed:interface=NAME,interface=NAME"; the same for all clients of a process on a domain. With
                    one, the variable CYCLONEDDS_URI is not used
        secure      folder of this program's identity for DDS Security, made by `tandem pki issue`; empty: none
        url         join over a gateway instead of DDS: "wss://HOST[:PORT]/" or "ws://HOST[:PORT]/", also the address of the
                    viewer's page; the connection is made, and made again, in the background
        token       for a gateway that asks for one; empty: what stands behind "#" in the url
        tls_ca      PEM file that a gateway's certificate is checked by; empty: the system's
        threads     threads, 1..64, that share the work on many bodies: applying frames and sample(). Fewer than 16,384
                    bodies are worked on by one. Results are the same to the bit
        max_delay   seconds, 0..1: how long a frame may be held back until the next ones come, so that they share a message; far
                    fewer bytes, and a picture that much later. A gateway does so for each client; over DDS the client plays
                    the offer of its stream with the greatest delay not above it. None: 0.2 as an observer, else 0
        max_kbit_s  what this client may take on the network, with all headers; 16..10,000,000 kbit/s, 0: no cap. It plays
                    the stream of the smallest error within it; without one it is refused, and `status.reason` has
                    both numbers
        log         gets a LogLevel and a line for a human

        Also raises TRANSPORT (DDS could not start), IO (`tls_ca`) and UNSUPPORTED (built without libwebsockets).
        """
        role = Role.OBSERVER if observe else Role.PARTICIPANT
        if log is not None and not callable(log):
            raise TypeError("log must be a function of a level and a line")
        if session is not None:
            _no_nul(session, "a session's name")
        told = None if log is None else lambda level, line: log(LogLevel(level), line)
        self._connection = _client.Connection(
            domain, session, role, lead, background, echo, prefer, _no_nul(profile, "a profile"), _no_nul(secure, "a folder"),
            _no_nul(url, "a url"), _no_nul(token, "a token"), _no_nul(tls_ca, "a file"), threads, max_delay, max_kbit_s, told,
        )
        # Also leaves at the end of the program, before the interpreter is gone that the log function needs.
        self._leave = weakref.finalize(self, _client.Connection.leave, self._connection)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leaves the session. Calls of other threads with this client soon end with INVALID_HANDLE. Further calls of
        close() do nothing."""
        if not self._leave.alive:
            return
        try:
            self._connection.leave()
        except Error as error:
            if error.code != Result.INVALID_HANDLE:  # which means that another thread was faster
                raise
        self._leave.detach()

    def update(self, wait: float = 0.0) -> None:
        """For a client without a thread: takes what arrived, follows the session, and waits for the next thing
        to do for a maximum of `wait` seconds. Also raises WRONG_THREAD if the client has a thread of its own, or if
        another thread is in update()."""
        self._connection.update(wait)

    def wait_until_playing(self, timeout: float) -> None:
        """Blocks until the client plays, for a maximum of `timeout` seconds. Updates a client that has no thread. Also
        raises TIMEOUT, and for a client without a thread the errors of update()."""
        self._connection.wait_until_playing(timeout)

    def prefer(self, preference: str) -> None:
        """Changes the preference for a stream; see the argument `prefer` of the constructor."""
        self._connection.prefer(preference)

    def status(self) -> Status:
        """The state of the client and its figures."""
        return Status._of(self._connection.status())

    def sample(
        self,
        mode: SampleMode = SampleMode.EXTRAPOLATE,
        at_ns: int = 0,
        smoothing: Optional[float] = None,
        out: Union[Sample, np.ndarray, Mapping[str, np.ndarray], None] = None,
    ) -> Sample:
        """The bodies as they should be drawn at a moment. Never changes the client's state.

        mode       which moment is drawn
        at_ns      time by clock_ns(), such as when the picture will be on the screen; 0: now. For a time far in the
                   past or future, the sample is of the nearest moment that the client holds; see Sample.frame
        smoothing  time constant for blending in corrections, seconds; 0: no blending; None: the default, 0.05
        out        a Sample, whose arrays are reused unless the session has another number of slots, or arrays of
                   the caller as for Sample.into(); None: new arrays

        May be called at any rate and from any thread; waits neither for the network nor for decoding. Also raises NOT_READY
        (nothing to draw yet) and CAPACITY (the caller's arrays have fewer rows than the session has slots; those
        of `out.capacity` do).
        """
        sample = Sample() if out is None else out if isinstance(out, Sample) else Sample.into(out)
        smoothing_s = -1.0 if smoothing is None else smoothing
        while True:
            sampled = self._connection.sample(mode, at_ns, smoothing_s, sample._columns)
            (result, sample.capacity, sample.epoch, sample.frame, sample.seconds_since_delta) = sampled[:5]
            (sample.alive_count, sample.has_orientations, mode_in_force, phase) = sampled[5:]
            if not sample._fit(sample.capacity):
                break
        if result != Result.OK:
            raise Error(result, f"the session has {sample.capacity} slots, more than the arrays have rows")
        sample.mode, sample.phase = SampleMode(mode_in_force), Phase(phase)
        return sample

    def next_event(self) -> Optional[Event]:
        """Takes the oldest event; None if there is none. The client keeps 256 events and drops the oldest ones."""
        event = self._connection.next_event()
        return None if event is None else Event._of(event)

    def events(self) -> Iterator[Event]:
        """Takes all events that are there, oldest first; does not wait for more."""
        while (event := self.next_event()) is not None:
            yield event

    def next_news(self) -> Optional[News]:
        """Takes the oldest news of the session's keys and events; None if there are none. The client keeps 4,096 of them
        with 1 MiB of bytes; NewsKind.LOST tells what it dropped."""
        news = self._connection.next_news()
        return None if news is None else News._of(news)

    def news(self) -> Iterator[News]:
        """Takes all news that are there, oldest first; does not wait for more."""
        while (news := self.next_news()) is not None:
            yield news

    def key(self, name: str) -> Optional[bytes]:
        """The value that a key of the session has at the last frame applied; None if there is no such key."""
        return self._connection.key(name)

    def keys(self) -> list[str]:
        """The keys that the session has, ascending."""
        return self._connection.keys()

    def data(self) -> Optional[np.ndarray]:
        """The data that each body has beside its motion, at the last frame applied: a structured array with a record
        for each slot, zeros for slots without a body, its fields called as the server calls them; a field of kind rgba
        is four bytes: red, green, blue, opacity. None if the client does not play a stream with data."""
        records = self._connection.data()
        return None if records is None else np.frombuffer(records, data_type(self._connection.data_fields()))

    def send_gravity(self, gravity: Sequence[float]) -> int:
        """Changes gravity: x, y, z, scene units / s^2. Returns the input's number. An event reports the frame on which
        it acted, the same one everywhere, or the reason why it was refused.

        Like the other send_ methods, it also raises NOT_READY (not playing), OUT_OF_ORDER (joined as an observer)
        and TRANSPORT; values that are not finite are INVALID_ARGUMENT."""
        return self._connection.send_gravity(gravity)

    def send_push(self, centre: Sequence[float], radius: float, velocity: Sequence[float]) -> int:
        """Adds a velocity (x, y, z; scene units / s) to the bodies around a point (x, y, z; scene units). Returns
        the input's number."""
        return self._connection.send_push(centre, radius, velocity)

    def send_seek(self, seconds: float) -> int:
        """EXPERIMENTAL. Makes a session that replays a recording continue at `seconds` after its first message (0 up to
        its length), for all clients and in another epoch; EventKind.NEW_EPOCH reports it. The server refuses a time
        beyond the recording, a session that is no replay, and a seek within a second of another. Returns the input's
        number."""
        return self._connection.send_seek(seconds)

    def send_bytes(self, data: Union[bytes, bytearray, memoryview]) -> int:
        """Sends up to 1,024 bytes to the server's simulation, which knows their meaning. Returns the input's
        number."""
        return self._connection.send_bytes(bytes(memoryview(data)))

    def scene(self) -> Scene:
        """The scene of the session. Like geometry() and types(), it also raises NOT_READY before a session is known,
        and MALFORMED if the server's description of its scene cannot be read. Everything may change with a new epoch
        (EventKind.NEW_EPOCH)."""
        return Scene._of(self._connection.scene())

    def body_name(self, slot: int) -> str:
        """The name of the body that is in a slot now; empty if it has none. Raises NOT_READY while not playing."""
        return self._connection.body_name(slot)

    def geometry(self) -> list[Solid]:
        """The pieces of the scene that do not move."""
        return [Solid._of(solid) for solid in self._connection.geometry()]

    def types(self) -> list[BodyType]:
        """The types of bodies, as Sample.types counts them."""
        return [BodyType._of(kind) for kind in self._connection.types()]
