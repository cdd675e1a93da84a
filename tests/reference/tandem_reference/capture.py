"""Reads a capture file and sorts its messages into the streams of its sessions."""

from . import cdr, mcap, reader, stream
from .errors import Refused, require
from .snapshot import check_drive
from .timeline import Recording

DRIVE = 1
MOST_PARTS = {"TandemDelta": 4096, "TandemSnapshot": 1 << 18}


def kind_of(channel):
    """The topic type of a channel, or None: a topic has the name of its type."""
    for name in (channel.topic.split("/")[-1], channel.schema.split("::")[-1]):
        if name in cdr.TOPICS:
            return name
    return None


class Parts:
    """Deltas or snapshots that come in parts, by key; `same` names the fields that all parts share."""

    def __init__(self, same):
        self.same = same
        self.held = {}

    def add(self, key, sample, data):
        """Take one part; a copy of one that is held changes nothing."""
        what = f"{sample.type_name} of frame {sample.frame}"
        most = MOST_PARTS[sample.type_name]
        require(1 <= sample.parts <= most and sample.part < sample.parts, "sample", f"{what}: parts out of range")
        require(data or sample.parts == 1, "sample", f"{what}: an empty part of several")
        parts = self.held.setdefault(key, {})
        shared = [getattr(sample, name) for name in self.same]
        for other, _ in parts.values():
            require(shared == [getattr(other, name) for name in self.same], "sample", f"{what}: parts that disagree")
        _, before = parts.setdefault(sample.part, (sample, data))
        require(before == data, "sample", f"{what}: a part came twice and differs")

    def whole(self):
        """(key, any part, all bytes) of what is complete."""
        for key, parts in self.held.items():
            first = next(iter(parts.values()))[0]
            if len(parts) == first.parts:
                yield key, first, b"".join(parts[i][1] for i in range(first.parts))

    def broken(self):
        """How many are not complete."""
        return len(self.held) - sum(1 for _ in self.whole())


class Capture:
    """Sessions, scheduled inputs, deltas and snapshots of a file."""

    def __init__(self):
        self.sessions = {}  # (epoch, stream, generation): (TandemSession, Stream of it)
        self.inputs = {}  # epoch: {number: (frame, Drive)}
        self.deltas = Parts(["parts", "last_input", "hash"])
        self.snapshots = Parts(["parts", "total_bytes"])
        self.notes = []

    def add(self, kind, data):
        """Take one sample; kinds that do not bear on the state are decoded and dropped."""
        if kind == "TandemSession":
            version = cdr.version_of(data)
            require(version == stream.VERSION, "session", f"protocol version {version}, this program reads {stream.VERSION}")
        sample = cdr.decode(kind, data)
        if kind == "TandemSession":
            for announced in sample.streams:
                announced = complete(announced, sample.streams)
                key = sample.epoch, announced.id, announced.generation
                self.sessions.setdefault(key, (sample, announced))
        elif kind == "TandemScheduledInput":
            self.add_input(sample)
        elif kind in ("TandemDelta", "TandemSnapshot"):
            key = sample.epoch, sample.stream, sample.generation, sample.frame
            if kind == "TandemDelta":
                self.deltas.add(key, sample, sample.payload)
            else:
                self.snapshots.add(key, sample, sample.bytes)

    def add_input(self, sample):
        """Take a scheduled input."""
        require(sample.kind == DRIVE, "input", f"scheduled input {sample.number}: unknown kind {sample.kind}")
        require(len(sample.values) == 4, "input", f"scheduled input {sample.number}: {len(sample.values)} values")
        entry = sample.frame, check_drive(sample.values[:3], sample.values[3], "input")
        inputs = self.inputs.setdefault(sample.epoch, {})
        require(inputs.setdefault(sample.number, entry) == entry, "sample", "a scheduled input came twice and differs")

    def recordings(self):
        """(epoch, stream id, generation): Recording of every stream that the file has deltas of."""
        result = {}
        for key in sorted({key[:3] for key in self.deltas.held}):
            require(key in self.sessions, "session", f"the file has deltas of {name(key)}, but not its session")
            session, announced = self.sessions[key]
            played = stream.of_session(session, announced)
            result[key] = Recording(played, announced.max_delta_bytes, announced.max_snapshot_bytes)
        for key, sample, data in self.snapshots.whole():
            if key[:3] in result:
                require(len(data) == sample.total_bytes, "sample", "a snapshot of another length than total_bytes")
                result[key[:3]].add_snapshot(data, key[0], key[1], key[2], key[3])
        for key, sample, data in self.deltas.whole():
            for frame, payload, state_hash in frames_of(sample, data):
                result[key[:3]].add_delta(frame, payload, sample.last_input, state_hash)
        broken = self.deltas.broken(), self.snapshots.broken()
        if any(broken):
            self.notes.append(f"{broken[0]} deltas and {broken[1]} snapshots lack parts")
        return result


def complete(announced, streams):
    """An entry of TandemSession.streams with what it leaves out because the one that it carries says it."""
    if announced.carries == announced.id or announced.groups:
        return announced
    encodes = [other for other in streams if other.id == announced.carries == other.carries]
    require(encodes, "session", f"stream {announced.id} carries another that does not encode")
    own = {name: getattr(announced, name) for name in ("id", "carries", "delay_ms", "cap_kbit_s")}
    return cdr.Message(announced.type_name, {**vars(encodes[0]), **own})


def frames_of(sample, data):
    """(frame, payload, hash) of all frames that a whole delta tells: PROTOCOL.md, "Several frames"."""
    require(sample.earlier < sample.frame, "sample", "a delta that tells frame 0")
    require(sample.earlier == 0 or sample.parts == 1, "sample", "several frames in parts")
    if sample.earlier == 0:
        return [(sample.frame, data, sample.hash)]
    if not data:
        return [(frame, b"", sample.hash) for frame in range(sample.frame - sample.earlier, sample.frame + 1)]
    bytes_in = reader.Reader(data, "several frames")
    frames = []
    last = sample.frame - sample.earlier - 1
    while last < sample.frame:
        head = bytes_in.leb128(5)
        count = head // 2 if head % 2 else 1
        require(head and 1 <= count <= sample.frame - last, "sample", "other frames than the delta says")
        payload = b"" if head % 2 else bytes(bytes_in.take(head // 2))
        last += count
        state_hash = sample.hash if last == sample.frame else bytes_in.u64()
        frames += [(frame, payload, state_hash) for frame in range(last - count + 1, last + 1)]
    bytes_in.end()
    return frames


def name(key):
    """An epoch, stream and generation for people."""
    return f"epoch {key[0]}, stream {key[1]}, generation {key[2]}"


def read(data):
    """The capture in the bytes of an MCAP file."""
    file = mcap.McapFile(data)
    capture = Capture()
    for count, message in enumerate(file.messages(), 1):
        kind = kind_of(message.channel)
        if kind:
            require(message.channel.encoding == "cdr", "sample", f"{kind} in the encoding {message.channel.encoding!r}")
            try:
                capture.add(kind, message.data)
            except Refused as refusal:
                raise Refused(refusal.rule, f"message {count} ({kind}): {refusal.text}") from None
    if file.problem:
        capture.notes.append(file.problem)
    return capture
