"""The result of a call."""

import enum


class Result(enum.IntEnum):
    """The codes of `tandem.h`; their values never change."""

    OK = 0
    INVALID_ARGUMENT = 1  #: the caller passed something out of range
    MALFORMED = 2  #: received bytes, or those of a file, do not parse or break a rule of the format
    UNSUPPORTED = 3  #: of a version, or with a value, that this library does not know
    MISMATCH = 4  #: applied, but the state hash differs from the sender's
    OUT_OF_ORDER = 5  #: not possible in this role or at this moment
    CAPACITY = 6  #: an array is too short, or a limit would be exceeded
    TIMEOUT = 7  #: it did not come about in time
    CONFLICT = 8  #: somebody else owns the name
    TRANSPORT = 9  #: DDS reported an error
    IO = 10  #: a file could not be read or written
    INVALID_HANDLE = 11  #: the client is closed
    NOT_READY = 12  #: nothing to draw, not playing, or not known, yet
    IN_CALLBACK = 13  #: called from a log function
    WRONG_THREAD = 14  #: another thread does this already
    OUT_OF_MEMORY = 15
    INTERNAL = 16  #: a fault of this library: please report its text


class Error(Exception):
    """A call failed: `code` says how, `str()` has a line for a human."""

    #: A code that a newer library added is a plain int.
    code: "Result | int"

    def __init__(self, code: int, message: str = "") -> None:
        try:
            self.code = Result(code)
        except ValueError:
            self.code = code
        super().__init__(code, message)

    def __str__(self) -> str:
        name = self.code.name if isinstance(self.code, Result) else f"result {self.code}"
        return f"{self.args[1]} ({name})" if self.args[1] else name
