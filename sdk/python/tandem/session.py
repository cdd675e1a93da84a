"""The parts of a session, and the state of a client in it."""

from __future__ import annotations

import enum
from dataclasses import dataclass, fields
from typing import Any, Optional

import numpy as np

from .figures import ClientFigures

Vector = tuple[float, float, float]


class Role(enum.IntEnum):
    OBSERVER = 0  #: only watches; the server never waits for it
    PARTICIPANT = 1  #: may send input, and the server waits for it, within limits


class Phase(enum.IntEnum):
    SEARCHING = 0  #: no live server of that session seen
    REFUSED = 1  #: a session is there that this client cannot play; Status.reason says why
    JOINING = 2  #: waiting for a snapshot
    PLAYING = 3  #: holds the agreed state and follows it


class LogLevel(enum.IntEnum):
    INFO = 0
    WARNING = 1
    ERROR = 2


class SampleMode(enum.IntEnum):
    INTERPOLATE = 0  #: between the last two agreed frames: always true, a frame late
    EXTRAPOLATE = 1  #: at the server's time: predicted, with corrections blended in


class Change(enum.IntEnum):
    """How a body changed since the client's previous sample."""

    NONE = 0
    NEW = 1  #: was not there, or another body took its slot
    GONE = 2  #: was there in the previous sample
    JUMPED = 3  #: the same body at another place: teleported, or the client had to join again


class EventKind(enum.IntEnum):
    PLAYING = 1  #: first in this epoch: `frame` is held
    LOST = 2  #: plays no more and joins again; `text` says why
    REJOINED = 3  #: plays again, in the same epoch: `frame` is held
    REFUSED = 4  #: the session cannot be played; `text` says why
    DEMOTED = 5  #: a participant that became an observer; `text` says why
    PROMOTED = 6  #: is a participant now
    INPUT_ACTED = 7  #: input `number` acted on `frame`, which is held
    INPUT_REFUSED = 8  #: input `number`, by the server; `reason`, `text`
    INPUT_UNKNOWN = 9  #: nobody will know what became of input `number`
    SESSION_ENDED = 10  #: the server is gone; the last state stays
    NEW_EPOCH = 11  #: another run of a server: `epoch`. Nothing of the old one counts
    SESSION_BACK = 12  #: the server that was gone is there again, in the same epoch
    INPUT_LOST = 13  #: input `number` did not act: the server went on from a frame before it. Once, after NEW_EPOCH


class NewsKind(enum.IntEnum):
    EVENT = 1  #: event `number` happened on `frame`: `event`, `body`, `data`
    KEY = 2  #: from `frame` on `key` has another value, or is `gone`
    LOST = 3  #: `number` events up to `frame` are lost for this client; changes of keys may be missing, too
    TAKEN_BACK = 4  #: the last `number` events, of frames beyond `frame`, did not happen


class Shape(enum.IntEnum):
    """In the body's frame, scene units."""

    NONE = 0
    SPHERE = 1  #: no values: the radius
    BOX = 2  #: half sizes x, y, z
    CAPSULE = 3  #: radius, half of the length between the centres of the caps, along y
    CYLINDER = 4  #: radius, half of the height, along y
    HULL = 5  #: convex: points x, y, z, at least four
    PLANE = 6  #: of solids alone


class _FromNative:
    """Make one from a dict with the names of the fields; numbers become members of the field's enum, if it has one."""

    @classmethod
    def _of(cls, values: dict[str, Any]) -> Any:
        kinds = {"what": NewsKind, "phase": Phase, "role": Role, "kind": EventKind, "shape": Shape}
        for field in fields(cls):  # type: ignore[arg-type]
            kind = kinds.get(field.name)
            if kind is not None and values[field.name] in kind.__members__.values():
                values[field.name] = kind(values[field.name])
        return cls(**values)


@dataclass(frozen=True)
class Status(ClientFigures, _FromNative):
    """How a client stands, and its figures. Times in milliseconds, percentiles over all frames."""

    phase: Phase
    role: Role  #: as granted by the server
    lead: int  #: in force, frames; lower than asked for where the session allows less
    server_alive: bool
    client_id: int  #: random; kept for as long as the client lives
    epoch: int  #: of the server's run; 0 before the first
    frame: int  #: last frame agreed with the server
    state_hash: int  #: of that frame
    frame_rate_hz: float
    scene: str
    reason: str  #: why role or phase is not what was asked for; empty where it is
    stream: str  #: name of the stream that is played or joined; its number where it has no name
    stream_reason: str  #: why that one
    events_dropped: int  #: before they were taken


@dataclass(frozen=True)
class Event(_FromNative):
    """One event. What its kind does not name is 0."""

    kind: EventKind
    number: int  #: of the input, as its sender was told
    frame: int
    epoch: int
    at_ns: int  #: when the client noted it, by clock_ns()
    reason: int  #: the server's: "Reasons" in idl/PROTOCOL.md
    dropped: int  #: older events that there was no room for since the one taken before
    text: str  #: for a human; may be empty. Of a refused input: the simulation's own words, if it gave some


@dataclass(frozen=True)
class News(_FromNative):
    """What a session told beside bodies. What its kind does not name is 0, empty or None."""

    what: NewsKind
    epoch: int
    frame: int  #: it is in a sample whose `frame` is at least this
    number: int  #: of the event, from 1 on; or how many events
    event: int  #: its kind; what it means is the server's
    body: Optional[tuple[int, int]]  #: slot and reuse of the body that the event is about
    key: str
    gone: bool  #: there is no such key any more
    data: bytes  #: of the event


@dataclass(frozen=True)
class Scene(_FromNative):
    """The scene of a session."""

    name: str
    capacity: int  #: slots
    frame_rate_hz: float
    gravity: Vector  #: at the epoch's first frame; scene units / s^2
    max_gravity: float  #: beyond, the server refuses it; 0: not told
    max_push: float  #: scene units / s; beyond, the server refuses it; 0: not told
    bounds: Optional[tuple[Vector, Vector]]  #: bodies outside of low..high are removed; None: not told
    dt_s: float  #: seconds that one frame simulates
    up_axis: int  #: the axis that points up: 0 x, 1 y, 2 z
    continues_epoch: int  #: the epoch that this one continues; 0: none
    continues_frame: int  #: the frame of that epoch from which this one continues


@dataclass(frozen=True)
class Solid(_FromNative):
    """One piece of a scene that does not move: a plane, a box or a sphere. What its shape does not name is 0."""

    shape: Shape
    centre: Vector  #: of a plane: a point of it
    orientation: tuple[float, float, float, float]  #: of a box: quaternion x, y, z, w, from its frame to the world's
    half_size: Vector  #: of a box
    normal: Vector  #: of a plane: of norm 1; bodies are on the side that it points to
    radius: float  #: of a sphere


@dataclass(frozen=True, eq=False)
class BodyType(_FromNative):
    """The appearance of the bodies of a type."""

    name: str
    shape: Shape
    radius: float  #: of the sphere around the body; scene units
    colour_rgba: int  #: 0xRRGGBBAA
    values: np.ndarray  #: float32: the shape's, such as the points of a hull


@dataclass(frozen=True)
class SessionInfo(_FromNative):
    """A session on a domain. Unknown values are 0 or empty; status comes once a second."""

    name: str  #: for Client(session=...)
    scene: str
    codec: str
    predictor: str
    playable: bool  #: a Client can play it. If not: another version, or a codec unknown here
    epoch: int  #: of the server's run
    capacity: int  #: slots
    bodies: int  #: alive; from status, as are the next two
    participants: int
    observers: int
    frame_rate_hz: float
    client_ms: float  #: what a client computes in a frame, on the server's processor
    mbit_per_s: float  #: of payload, now; from status
    protocol_version: int
    dt_s: float  #: seconds that one frame simulates
    gravity: Vector  #: at the epoch's first frame; scene units / s^2
    up_axis: int  #: the axis that points up: 0 x, 1 y, 2 z
    continues_epoch: int  #: the epoch that this one continues; 0: none
    continues_frame: int  #: the frame of that epoch from which this one continues
