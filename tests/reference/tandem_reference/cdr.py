"""XCDR version 1, little-endian, of the topic types of idl/tandem.idl."""

import struct

from .errors import Refused, require

# The last two bits of the options may tell how many bytes of padding end the sample.
ENCAPSULATION = bytes([0, 1, 0, 0])
SCALARS = {"octet": "B", "uint16": "H", "uint32": "I", "int32": "i", "uint64": "Q", "int64": "q", "float": "f", "double": "d"}

# Fields in the order of the IDL: (type, name); "[T]" is a sequence of T.
TYPES = {
    "BodyType": [
        ("float", "radius"), ("uint32", "colour_rgba"), ("uint32", "shape"), ("string", "name"),
        ("[float]", "shape_values"),
    ],
    "BodyName": [("uint32", "slot"), ("uint32", "reuse"), ("string", "name")],
    "DataField": [("uint32", "kind"), ("string", "name")],
    "Parameter": [("uint32", "id"), ("int32", "value")],
    "Stream": [
        ("uint32", "id"), ("uint32", "generation"), ("uint32", "client_cost_ns"),
        ("uint32", "max_delta_bytes"), ("uint32", "max_snapshot_bytes"), ("uint32", "delay_ms"),
        ("uint32", "carries"), ("uint32", "cap_kbit_s"), ("uint32", "world_slots"), ("uint64", "layout_hash"),
        ("string", "name"), ("string", "codec"), ("string", "predictor"), ("[string]", "groups"), ("[int32]", "radii"),
        ("[Parameter]", "parameters"), ("[int32]", "predictor_constants"), ("[octet]", "codec_tables"),
    ],
    "TandemSession": [
        ("uint64", "epoch"), ("uint32", "protocol_version"), ("uint32", "capacity"), ("double", "frame_rate_hz"),
        ("double", "dt_s"), ("double", "lattice_unit"), ("double", "gravity_x"), ("double", "gravity_y"),
        ("double", "gravity_z"), ("uint32", "up_axis"), ("uint32", "lead"), ("uint32", "window_ceiling"),
        ("uint32", "server_role"), ("uint32", "standby_rank"), ("uint64", "continues_epoch"),
        ("uint64", "continues_frame"), ("uint64", "topology_hash"), ("uint32", "topology_bytes"), ("string", "session"),
        ("string", "scene"), ("string", "scene_json"), ("[BodyType]", "types"), ("[Stream]", "streams"),
        ("[BodyName]", "names"), ("[string]", "features"), ("[DataField]", "data"),
    ],
    "TandemDelta": [
        ("uint64", "epoch"), ("uint64", "frame"), ("uint64", "last_input"), ("int64", "server_time_ns"),
        ("uint64", "hash"), ("uint16", "stream"), ("uint16", "generation"), ("uint16", "part"), ("uint16", "parts"),
        ("uint16", "earlier"), ("[octet]", "payload"),
    ],
    "TandemScheduledInput": [
        ("uint64", "epoch"), ("uint64", "number"), ("uint64", "frame"), ("uint64", "source_client"),
        ("uint64", "source_number"), ("uint32", "kind"), ("[int32]", "values"),
    ],
    "TandemSnapshot": [
        ("uint64", "epoch"), ("uint32", "stream"), ("uint32", "generation"), ("uint64", "frame"), ("uint32", "part"),
        ("uint32", "parts"), ("uint32", "total_bytes"), ("[octet]", "bytes"),
    ],
    "ReplyEntry": [("uint64", "number"), ("uint64", "frame"), ("uint32", "code")],
    "ReplyText": [("uint64", "number"), ("string", "text")],
    "TandemReply": [
        ("uint64", "client"), ("uint64", "epoch"), ("uint32", "role"), ("uint32", "phase"), ("uint32", "reason"),
        ("uint32", "needed_kbit_s"), ("uint64", "highest_input"), ("int64", "client_clock_ns"), ("int64", "server_time_ns"),
        ("[ReplyEntry]", "entries"), ("[ReplyText]", "texts"),
    ],
    "TandemInput": [
        ("uint64", "client"), ("uint64", "epoch"), ("uint64", "number"), ("uint64", "origin"), ("uint64", "client_frame"),
        ("uint32", "kind"), ("[double]", "values"), ("[octet]", "bytes"),
    ],
    "TandemAck": [
        ("uint64", "client"), ("uint64", "epoch"), ("uint32", "protocol_version"), ("uint32", "stream"),
        ("uint32", "generation"), ("uint32", "phase"), ("uint64", "applied"), ("uint64", "simulated"),
        ("uint32", "role_wanted"), ("uint32", "join_attempt"), ("int64", "clock_ns"), ("uint64", "snapshot_frame"),
        ("uint32", "snapshot_parts"), ("uint32", "max_delay_ms"), ("uint32", "cap_kbit_s"), ("uint32", "wants"),
        ("[uint32]", "missing"),
    ],
    "TandemServerStatus": [
        ("uint64", "epoch"), ("uint64", "frame"), ("uint64", "behind_frames"), ("uint32", "server_role"),
        ("double", "uptime_s"), ("double", "frame_rate_hz"),
        ("double", "mbit_per_s"), ("double", "wire_mbit_per_s"), ("double", "raw_mbit_per_s"), ("double", "frame_ms_p50"), ("double", "frame_ms_p99"),
        ("double", "corrected_per_frame"), ("double", "threshold"), ("uint32", "bodies"), ("uint32", "at_rest"),
        ("uint32", "participants"), ("uint32", "observers"), ("uint32", "window"), ("uint32", "queue_high_water"),
        ("uint64", "delta_bytes"), ("uint64", "reply_bytes"), ("uint64", "input_bytes"), ("uint64", "snapshot_bytes"),
        ("uint64", "stalls"), ("uint64", "suspended_ms"), ("uint64", "refused_inputs"), ("uint64", "refused_messages"),
        ("uint64", "snapshots"), ("uint32", "stream"), ("string", "session"), ("string", "codec"),
        ("string", "predictor"),
    ],
    "TandemClientStatus": [
        ("uint64", "client"), ("uint64", "epoch"), ("uint64", "applied"), ("uint32", "stream"),
        ("uint32", "generation"), ("uint32", "role"), ("uint32", "phase"), ("uint32", "too_slow"),
        ("uint32", "queue_high_water"), ("double", "lag_ms"), ("double", "client_ms_p50"), ("double", "mbit_per_s"), ("double", "wire_mbit_per_s"),
        ("uint64", "frames_applied"), ("uint64", "resyncs"), ("uint64", "hash_mismatches"), ("uint64", "inputs_sent"),
        ("uint64", "inputs_refused"), ("string", "session"), ("string", "stream_reason"),
    ],
    "InputDecision": [
        ("uint64", "client"), ("uint64", "number"), ("uint64", "origin"), ("uint64", "frame"), ("uint64", "scheduled"),
        ("uint32", "code"), ("uint32", "kind"), ("[octet]", "participant"), ("[double]", "values"), ("[octet]", "bytes"),
    ],
    "TandemJournal": [
        ("uint64", "epoch"), ("uint64", "number"), ("uint64", "frame"), ("uint64", "hash"), ("uint64", "successor"),
        ("uint32", "state"), ("[InputDecision]", "decisions"), ("[octet]", "news"),
    ],
    "TandemCheckpoint": [
        ("uint64", "epoch"), ("uint64", "frame"), ("uint64", "journal"), ("uint32", "part"), ("uint32", "parts"),
        ("uint32", "total_bytes"), ("[octet]", "bytes"),
    ],
    "TandemStandby": [
        ("uint64", "standby"), ("uint64", "epoch"), ("uint64", "holds_frame"), ("uint64", "journal"),
        ("uint64", "part_frame"), ("uint32", "part_count"), ("uint32", "protocol_version"), ("uint32", "rank"),
        ("[uint32]", "missing"),
    ],
    "TandemCommand": [("uint64", "epoch"), ("uint64", "request"), ("uint32", "kind"), ("string", "session")],
}  # fmt: skip
TOPICS = [name for name in TYPES if name.startswith("Tandem")]


class Message:
    """A decoded struct; its fields are attributes."""

    def __init__(self, type_name, fields):
        self.type_name = type_name
        self.__dict__.update(fields)


class Decoder:
    """Decodes what follows the encapsulation header; alignment counts from there."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, count):
        """The next bytes, none of them beyond the end."""
        require(self.at + count <= len(self.data), "sample", "a sample ends too soon")
        self.at += count
        return self.data[self.at - count : self.at]

    def scalars(self, kind, count):
        """`count` numbers of one kind, after the padding that the first needs."""
        code = SCALARS[kind]
        if count == 0:
            return []
        size = struct.calcsize("<" + code)
        self.take(-self.at % size)
        return list(struct.unpack(f"<{count}{code}", self.take(count * size)))

    def string(self):
        """A length that includes the closing zero, then the bytes."""
        size = self.scalars("uint32", 1)[0]
        require(size >= 1, "sample", "a string without its closing zero")
        text = self.take(size)
        require(text.find(0) == size - 1, "sample", "a string whose only zero is not its last byte")
        try:
            return text[:-1].decode("utf-8")
        except UnicodeDecodeError:
            raise Refused("sample", "a string that is not UTF-8") from None

    def value(self, kind):
        """One value of any kind."""
        if kind == "string":
            return self.string()
        if kind.startswith("["):
            return self.sequence(kind[1:-1])
        if kind in TYPES:
            return Message(kind, {name: self.value(field) for field, name in TYPES[kind]})
        return self.scalars(kind, 1)[0]

    def sequence(self, kind):
        """A count, then the elements."""
        count = self.scalars("uint32", 1)[0]
        require(count <= len(self.data) - self.at, "sample", "a sequence longer than its sample")
        if kind == "octet":
            return self.take(count)
        if kind in SCALARS:
            return self.scalars(kind, count)
        return [self.value(kind) for _ in range(count)]


def version_of(session):
    """The protocol version of a TandemSession of any version: behind the header, the epoch and the version stay first."""
    require(len(session) >= 16, "sample", "a sample ends too soon")
    return struct.unpack_from("<I", session, 12)[0]


def decode(kind, sample):
    """The message in a sample: encapsulation header, then the struct."""
    require(sample[:3] == ENCAPSULATION[:3], "sample", "not XCDR version 1, little-endian")
    require(len(sample) > 3 and sample[3] <= 3, "sample", "unknown options in the encapsulation header")
    decoder = Decoder(bytes(sample[4:]))
    message = decoder.value(kind)
    require(len(decoder.data) - decoder.at < 4, "sample", "bytes left over behind a sample")
    return message
