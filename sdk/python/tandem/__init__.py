"""Tandem: a physical simulation that runs on a server, held body by body and bit by bit, in numpy arrays.

    with tandem.Client() as client:
        client.wait_until_playing(10)
        bodies = client.sample()
        print(bodies.frame, bodies.positions[bodies.alive].mean(axis=0))

`Client` joins a session, `Server` streams a simulation of yours, `sessions()` finds those on a domain, `Recording` reads what `tandem record` wrote.
Whatever fails raises `Error`.
"""

from tandem.client import Client, Sample, clock_ns, sessions, version
from tandem.errors import Error, Result
from tandem.recording import Recording, State
from tandem.server import Frame, Input, Server, Type
from tandem.session import (
    BodyType,
    Change,
    Event,
    EventKind,
    LogLevel,
    News,
    NewsKind,
    Phase,
    Role,
    SampleMode,
    Scene,
    SessionInfo,
    Shape,
    Solid,
    Status,
)

__all__ = [
    "BodyType", "Change", "Client", "Error", "Event", "EventKind", "Frame", "Input", "LogLevel", "News", "NewsKind", "Phase", "Recording", "Result", "Role",
    "Sample", "SampleMode", "Scene", "Server", "SessionInfo", "Shape", "Solid", "State", "Status", "Type", "clock_ns", "sessions",
    "version",
]  # fmt: skip
__version__ = version()
