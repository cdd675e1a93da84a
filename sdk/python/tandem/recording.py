"""Reads recordings of `tandem record`, state by state."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, Optional, Union

import numpy as np

from tandem.bodies import Bodies
from tandem.errors import Error, Result
from tandem.session import BodyType, Scene, Solid

try:
    from tandem import _recording
except ImportError:  # the package was built without the services
    _recording = None


class State(Bodies):
    """The bodies at a frame, as server and clients agreed on them."""

    COLUMNS = tuple(name for name in Bodies.COLUMNS if name != "changes")

    def __init__(self, columns=None) -> None:
        super().__init__(columns)
        self.frame = 0
        self.time_s = 0.0  #: when it was recorded, seconds since the recording's first message
        self.state_hash = 0  #: checked against the state when it was read
        self.starts = False  #: there is no state of the frame before in this epoch


class Recording:
    """Reads a recording, from its first state on.

        with tandem.Recording("session.mcap") as recording:
            for state in recording:
                print(state.frame, state.positions[state.alive].mean(axis=0))

    Iterating continues from the current position and gives new arrays each time; read(out) reuses arrays. Every
    state's hash is checked. A file may come from anybody: the worst it can do is to raise `Error`: IO, MALFORMED,
    UNSUPPORTED (another version) or MISMATCH (a hash). A file that is cut short is read up to that place, and what is
    damaged is passed over; a UserWarning and `left_out` say so. Decoding releases the interpreter's lock. Only one thread at a time may use a recording.
    """

    def __init__(self, path: "str | os.PathLike[str]") -> None:
        if _recording is None:
            raise Error(Result.UNSUPPORTED, "this package was built without the reader of recordings")
        self._held: Optional[Any] = _recording.Reader(os.fspath(path))
        self._path = os.fspath(path)
        self._told = ""
        self._at = self._next()  # the place of the state that read() gives next
        if self._at is None:
            raise Error(Result.MALFORMED, f"{self._path}: {_recording.nothing_to_play}")

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file. All other methods raise INVALID_HANDLE afterwards."""
        self._held = None

    def __iter__(self) -> Iterator[State]:
        while (state := self.read()) is not None:
            yield state

    def read(self, out: Union[State, np.ndarray, Mapping[str, np.ndarray], None] = None) -> Optional[State]:
        """The next state; None behind the last one.

        out  a State, whose arrays are reused unless the session has another number of slots, or arrays of the caller
             as for State.into(); None: new arrays

        Also raises CAPACITY if the caller's arrays have fewer rows than the session has slots."""
        reader = self._reader
        if self._at is None:
            self._at = self._next()
        if self._at is None:
            return None
        state = State() if out is None else out if isinstance(out, State) else State.into(out)
        (state.starts, state.epoch, state.frame, state.state_hash, state.time_s) = self._at[:5]
        (state.capacity, state.has_orientations) = self._at[5:]
        state._fit(state.capacity)
        reader.write(state._columns)
        self._at = None
        return state

    def seek(self, frame: int, epoch: Optional[int] = None) -> None:
        """Goes to a frame, which read() returns next. `epoch` None stands for the current epoch. Also raises
        INVALID_ARGUMENT if that frame is missing; the position is then behind the place of the frame.

        Decoding begins at the snapshot before the frame; there is one for about every ten seconds."""
        wanted = (self.epoch if epoch is None else epoch, frame)
        found = self._reader.seek(*wanted)
        self._at = self._next()
        there = False  # in the epoch; which number comes first is the file's business, as clocks are set back
        while found and self._at is not None and self._at[1:3] != wanted:
            now_there = self._at[1] == wanted[0]
            if (there and not now_there) or (now_there and self._at[2] > frame):
                break
            there = now_there
            self._at = self._next()
        if self._at is None or self._at[1:3] != wanted:
            raise Error(Result.INVALID_ARGUMENT, f"the recording holds no frame {frame} of epoch {wanted[0]}")

    @property
    def epoch(self) -> int:
        """The epoch at the current position."""
        return self._reader.epoch()

    @property
    def length_s(self) -> float:
        """The time from the first message to the last one, seconds."""
        return self._reader.length_s

    @property
    def torn(self) -> Optional[int]:
        """The first byte that cannot be read, if the file is cut short; None if it is whole."""
        return self._reader.torn_at

    @property
    def left_out(self) -> str:
        """What of the file could not be read so far and was left out, in a few words; empty if nothing was."""
        return self._reader.left_out

    def scene(self) -> Scene:
        """The scene of the session. Like geometry() and types(), it belongs to the epoch at the current position. Also
        raises MALFORMED, like geometry(), if the server's description of its scene cannot be read."""
        return Scene._of(self._reader.scene())

    def geometry(self) -> list[Solid]:
        """The pieces of the scene that do not move."""
        return [Solid._of(solid) for solid in self._reader.geometry()]

    def types(self) -> list[BodyType]:
        """The types of bodies, as State.types counts them."""
        return [BodyType._of(kind) for kind in self._reader.types()]

    def _next(self) -> Any:
        at = self._reader.next()
        if (left_out := self._reader.left_out) != self._told:
            self._told = left_out
            warnings.warn(f"{self._path} {left_out}", stacklevel=3)
        return at

    @property
    def _reader(self) -> Any:
        if self._held is None:
            raise Error(Result.INVALID_HANDLE, "the recording is closed")
        return self._held
