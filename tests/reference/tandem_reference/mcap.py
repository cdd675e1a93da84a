"""Reader of MCAP files whose chunks, if any, are not compressed (public specification: mcap.dev)."""

import struct
from dataclasses import dataclass

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F


class McapError(Exception):
    """Not an MCAP file, or one that this reader does not read."""


@dataclass
class Channel:
    """Where messages belong: topic, encoding and schema."""

    topic: str
    encoding: str
    schema: str


@dataclass
class Message:
    """One recorded message."""

    channel: Channel
    sequence: int
    log_time_ns: int
    data: bytes


class Fields:
    """The fields of a record, read from its front."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def number(self, code):
        """One number, little-endian."""
        size = struct.calcsize("<" + code)
        if self.at + size > len(self.data):
            raise McapError("a record is shorter than its fields")
        self.at += size
        return struct.unpack_from("<" + code, self.data, self.at - size)[0]

    def text(self):
        """A u32 length and so many bytes of text."""
        size = self.number("I")
        if self.at + size > len(self.data):
            raise McapError("a text is longer than its record")
        self.at += size
        return self.data[self.at - size : self.at].decode("utf-8", "replace")

    def rest(self):
        """The bytes behind the fields read."""
        return self.data[self.at :]


class McapFile:
    """Messages of a file, in its order; `problem` tells afterwards how its end is missing, if it is."""

    def __init__(self, data):
        if data[: len(MAGIC)] != MAGIC:
            raise McapError("this is not an MCAP file: its first eight bytes are others")
        self.data = data
        self.schemas = {0: ""}
        self.channels = {}
        self.problem = None

    def records(self, data, at, whole_file):
        """Opcode and content of the records from a place on."""
        while at < len(data):
            if whole_file and data[at:] == MAGIC:
                return
            if at + 9 > len(data):
                self.cut_short(at, whole_file)
                return
            opcode, size = struct.unpack_from("<BQ", data, at)
            if at + 9 + size > len(data):
                self.cut_short(at, whole_file)
                return
            yield opcode, data[at + 9 : at + 9 + size]
            at += 9 + size
        if whole_file:
            self.cut_short(at, whole_file)

    def cut_short(self, at, whole_file):
        """Remember that the file has no proper end."""
        where = f"byte {at}" if whole_file else "a chunk"
        self.problem = f"the file has no proper end: no footer and closing magic (cut short at {where})"

    def messages(self):
        """All messages; whatever follows the end of the data is not needed."""
        ended = False
        for opcode, content in self.records(self.data, len(MAGIC), True):
            if opcode == FOOTER:
                if not self.data.endswith(MAGIC):
                    self.cut_short(len(self.data), True)
                return
            if opcode == DATA_END:
                ended = True
            if not ended:
                yield from self.record(opcode, content)

    def record(self, opcode, content):
        """The messages of one record of the data section."""
        fields = Fields(content)
        if opcode == SCHEMA:
            schema = fields.number("H")
            self.schemas[schema] = fields.text()
        elif opcode == CHANNEL:
            channel, schema = fields.number("H"), fields.number("H")
            if schema not in self.schemas:
                raise McapError(f"channel {channel} names schema {schema}, which the file does not have")
            topic, encoding = fields.text(), fields.text()
            self.channels[channel] = Channel(topic, encoding, self.schemas[schema])
        elif opcode == MESSAGE:
            channel = fields.number("H")
            if channel not in self.channels:
                raise McapError(f"a message of channel {channel}, which the file does not have")
            sequence, log_time_ns, _ = fields.number("I"), fields.number("Q"), fields.number("Q")
            yield Message(self.channels[channel], sequence, log_time_ns, fields.rest())
        elif opcode == CHUNK:
            for _ in range(3):
                fields.number("Q")
            fields.number("I")
            compression = fields.text()
            if compression:
                raise McapError(f"a chunk is compressed ({compression}); write the file again without compression")
            size = fields.number("Q")
            for inner_opcode, inner in self.records(fields.rest()[:size], 0, False):
                if inner_opcode in (SCHEMA, CHANNEL, MESSAGE):
                    yield from self.record(inner_opcode, inner)
