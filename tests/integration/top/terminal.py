"""A terminal for tests: a pseudo-terminal with a program on it, and what an xterm would show.

It knows the sequences that terminfo has for xterm, and raises Unknown at any other: nothing that a stranger wrote may
reach a terminal as a command.
"""

import codecs
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
import unicodedata

KEYS = {
    "up": "\x1bOA", "down": "\x1bOB", "right": "\x1bOC", "left": "\x1bOD", "page up": "\x1b[5~", "page down": "\x1b[6~",
    "home": "\x1bOH", "end": "\x1bOF", "enter": "\r", "tab": "\t", "escape": "\x1b",
}  # fmt: skip


class Unknown(Exception):
    """A program sent what is no text and no sequence of xterm's terminfo."""


class Screen:
    """What a terminal of this size shows, and in which modes it is."""

    SEQUENCE = re.compile(r"\x1b(?:\[([?!>]?)([0-9;]*)([A-Za-z@`])|[()]([0AB])|([=>78M]))")

    def __init__(self, columns, lines):
        self.decoder = codecs.getincrementaldecoder("utf-8")("strict")
        self.rest = ""
        self.alternate = False  # the screen that programs use for themselves
        self.hidden_cursor = False
        self.resize(columns, lines)

    def resize(self, columns, lines):
        self.columns, self.lines = columns, lines
        self.top, self.bottom = 0, lines  # the scrolling region
        self.clear()
        self.x = self.y = 0
        self.wraps = False  # the next character goes to the next line

    def clear(self):
        self.cells = [[" "] * self.columns for _ in range(self.lines)]

    def text(self):
        return ["".join(row).rstrip() for row in self.cells]

    def feed(self, octets):
        text = self.rest + self.decoder.decode(octets)
        at = 0
        while at < len(text):
            if text[at] != "\x1b":
                self.character(text[at])
                at += 1
                continue
            found = self.SEQUENCE.match(text, at)
            if not found:
                if len(text) - at < 32 and re.fullmatch(r"\x1b(\[[?!>]?[0-9;]*|[()])?", text[at:]):
                    break
                raise Unknown(repr(text[at : at + 20]))
            self.obey(*found.groups())
            at = found.end()
        self.rest = text[at:]

    def character(self, character):
        if character == "\r":
            self.x, self.wraps = 0, False
        elif character == "\n":
            self.wraps = False
            if self.y == self.bottom - 1:
                self.shift(self.top, 1)
            elif self.y < self.lines - 1:
                self.y += 1
        elif character == "\b":
            self.x, self.wraps = max(0, self.x - 1), False
        elif character == "\t":
            self.x = min(self.columns - 1, self.x // 8 * 8 + 8)
        elif character in "\x0e\x0f":
            pass
        elif unicodedata.category(character) in ("Cc", "Cf", "Cs", "Cn", "Mn", "Me"):
            raise Unknown(repr(character))
        else:
            self.put(character)

    def shift(self, first, count):
        """Move the lines from `first` to the end of the scrolling region up by `count`, or down if it is negative."""
        part = self.cells[first : self.bottom]
        blank = [[" "] * self.columns for _ in range(min(abs(count), len(part)))]
        self.cells[first : self.bottom] = part[len(blank) :] + blank if count > 0 else (blank + part)[: len(part)]

    def put(self, character):
        width = 2 if unicodedata.east_asian_width(character) in "WF" else 1
        if self.wraps:
            self.wraps = False
            self.character("\r")
            self.character("\n")
        if self.x + width > self.columns:
            raise Unknown("a wide character across the edge")
        self.cells[self.y][self.x] = character
        if width == 2:
            self.cells[self.y][self.x + 1] = ""
        self.last = character
        self.x += width
        if self.x >= self.columns:
            self.x, self.wraps = self.columns - 1, True

    def obey(self, mark, numbers, final, charset, single):
        if charset or single in ("=", ">", "7", "8"):
            return
        if single == "M":
            if self.y == self.top:
                self.shift(self.top, -1)
            else:
                self.y = max(0, self.y - 1)
            return
        values = [int(number) if number else 0 for number in numbers.split(";")]
        count = max(1, values[0])
        row = self.cells[self.y]
        if final not in "mhlr":
            self.wraps = False
        if mark == "?" and final in "hl":
            for value in values:
                if value == 1049:
                    self.alternate = final == "h"
                elif value == 25:
                    self.hidden_cursor = final == "l"
                elif value not in (1, 7, 12, 3, 4):
                    raise Unknown(f"mode {value}")
        elif mark:
            if (mark, final) != ("!", "p"):
                raise Unknown(f"{mark}{numbers}{final}")
        elif final in "m" or (final in "hl" and values == [4]) or (final == "t" and values[0] in (22, 23)):
            pass
        elif final == "r":
            self.top = max(1, values[0]) - 1
            self.bottom = values[1] if len(values) > 1 and values[1] else self.lines
            self.x = self.y = 0
        elif final == "H":
            self.y = min(self.lines, count) - 1
            self.x = min(self.columns, max(1, values[1] if len(values) > 1 else 1)) - 1
        elif final in "ABCDGd":
            if final in "AB":
                self.y = max(0, min(self.lines - 1, self.y + (count if final == "B" else -count)))
            elif final in "CD":
                self.x = max(0, min(self.columns - 1, self.x + (count if final == "C" else -count)))
            elif final == "G":
                self.x = min(self.columns, count) - 1
            else:
                self.y = min(self.lines, count) - 1
        elif final == "J":
            for line in range(0 if values[0] == 2 else self.y, self.lines):
                from_x = self.x if line == self.y and values[0] == 0 else 0
                self.cells[line][from_x:] = [" "] * (self.columns - from_x)
        elif final == "K":
            begin, end = {0: (self.x, self.columns), 1: (0, self.x + 1), 2: (0, self.columns)}[values[0]]
            row[begin:end] = [" "] * (end - begin)
        elif final == "X":
            end = min(self.columns, self.x + count)
            row[self.x : end] = [" "] * (end - self.x)
        elif final == "P":
            row[self.x :] = (row[self.x + count :] + [" "] * self.columns)[: self.columns - self.x]
        elif final == "@":
            row[self.x :] = ([" "] * count + row[self.x :])[: self.columns - self.x]
        elif final == "b":
            for _ in range(count):
                self.put(self.last)
        elif final in "LM":
            self.shift(self.y, count if final == "M" else -count)
        elif final in "ST":
            self.shift(self.top, count if final == "S" else -count)
        else:
            raise Unknown(f"{numbers}{final}")


class Terminal:
    """A program on a terminal of its own, for a `with`."""

    def __init__(self, command, columns=100, lines=30, locale="C.UTF-8", term="xterm"):
        self.screen = Screen(columns, lines)
        self.master, slave = pty.openpty()
        self.slave = slave  # kept, so that its modes can be read when the program is gone
        self.set_size(columns, lines)
        self.before = termios.tcgetattr(slave)
        environment = {key: value for key, value in os.environ.items() if key not in ("LINES", "COLUMNS")}
        self.process = subprocess.Popen(
            [str(word) for word in command], stdin=slave, stdout=slave, stderr=subprocess.PIPE, start_new_session=True,
            env={**environment, "TERM": term, "LC_ALL": locale}, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )  # fmt: skip

    def set_size(self, columns, lines):
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

    def resize(self, columns, lines):
        self.run(0.2)
        self.screen.resize(columns, lines)
        self.set_size(columns, lines)  # the kernel sends SIGWINCH

    def run(self, seconds):
        """Take what the program writes for so long, or until it ends."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            ready, _, _ = select.select([self.master], [], [], min(left, 0.1))
            if ready:
                self.screen.feed(os.read(self.master, 65536))
            elif self.process.poll() is not None:
                return

    def press(self, key):
        os.write(self.master, KEYS.get(key, key).encode())

    def wait_for(self, wanted, seconds=20):
        """Wait until a line matches; return the screen's lines."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if any(re.search(wanted, line) for line in self.screen.text()):
                return self.screen.text()
            if self.process.poll() is not None:
                break
            self.run(0.1)
        raise AssertionError(f"waited for {wanted!r}; the screen:\n" + "\n".join(self.screen.text()))

    def end(self, how=signal.SIGTERM):
        """End it by a signal, or by a key; return its exit code and what it wrote to stderr."""
        if isinstance(how, str):
            self.press(how)
        else:
            self.process.send_signal(how)
        deadline = time.monotonic() + 20
        while self.process.poll() is None and time.monotonic() < deadline:
            self.run(0.1)
        self.run(0.2)
        code = self.process.poll()
        return code, self.process.stderr.read().decode()

    def restored(self):
        """True if the terminal is as it was before the program."""
        return (
            termios.tcgetattr(self.slave) == self.before and not self.screen.alternate and not self.screen.hidden_cursor
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stderr.close()
        os.close(self.slave)
        os.close(self.master)
