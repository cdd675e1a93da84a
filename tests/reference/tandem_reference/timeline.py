"""A stream frame by frame: the drive by scheduled inputs, predicted steps, deltas and their hashes."""

from . import payload, predict, snapshot
from .errors import Refused, require
from .xxh3 import text


class Timeline:
    """The world of one stream at one frame, and the scheduled inputs known."""

    def __init__(self, stream, world, frame, drive, last_input=0, inputs=None):
        self.stream = stream
        self.world = world
        self.frame = frame
        self.drive = drive
        self.last_input = last_input
        self.inputs = dict(inputs or {})

    @classmethod
    def of_snapshot(cls, stream, cut):
        """Start after the delta of a snapshot's frame."""
        return cls(stream, cut.world.copy(), cut.frame, cut.drive, cut.last_input, cut.inputs)

    def add_input(self, number, acts_on, drive):
        """Schedule an input; one that the snapshot counted already changes nothing."""
        if number > self.last_input:
            require(acts_on > self.frame, "input", f"scheduled input {number} acts on frame {acts_on}: too late")
            self.inputs[number] = acts_on, drive

    def predict(self):
        """The predicted step to the next frame; of inputs for one frame the highest number counts."""
        self.frame += 1
        before = self.drive
        for number in sorted(self.inputs):
            acts_on, drive = self.inputs[number]
            if acts_on == self.frame:
                self.drive = drive
        self.inputs = {number: entry for number, entry in self.inputs.items() if entry[0] > self.frame}
        predict.step(self.world.state, self.stream, self.world.parameters, self.drive, before)

    def apply(self, data):
        """The delta of the frame predicted last."""
        self.world = payload.apply_delta(self.world, self.stream, data, self.drive.gravity)


def check_hash(frame, world, announced):
    """Refuse a world with another hash than the server's."""
    computed = world.hash()
    if computed != announced:
        raise Refused("hash", f"frame {frame}: announced {text(announced)}, computed {text(computed)}")


def effective(inputs, last_input):
    """{frame: drive} of the inputs up to a number; of several for one frame the highest number counts."""
    return {inputs[number][0]: inputs[number][1] for number in sorted(inputs) if number <= last_input}


def compare_with_snapshot(timeline, cut):
    """A snapshot of a frame that deltas led to must hold the same."""
    world, other = timeline.world, cut.world
    where = f"snapshot of frame {cut.frame}"
    check_hash(cut.frame, world, cut.hash)
    require(world.news == other.news, "snapshot", f"{where}: other keys or events than the deltas left")
    require(world.data == other.data, "snapshot", f"{where}: other data of bodies than the deltas left")
    require(world.parameters == other.parameters, "snapshot", f"{where}: other parameters than the deltas left")
    require(timeline.drive == cut.drive, "snapshot", f"{where}: another drive than the inputs left")
    waiting = effective(timeline.inputs, cut.last_input)
    require(waiting == effective(cut.inputs, timeline.last_input), "snapshot", f"{where}: other inputs still to act")
    if world.models:
        same = (world.models.p == other.models.p).all() and (world.models.weight == other.models.weight).all()
        require(same, "snapshot", f"{where}: other models than the deltas left")


class Recording:
    """All that one stream of one session sent, as a capture holds it."""

    def __init__(self, stream, max_delta_bytes, max_snapshot_bytes):
        self.stream = stream
        self.max_delta_bytes = max_delta_bytes
        self.max_snapshot_bytes = max_snapshot_bytes
        self.snapshots = {}  # frame: Snapshot
        self.deltas = {}  # frame: (payload, last_input, hash)
        self.notes = []

    def add_delta(self, frame, data, last_input, state_hash):
        """A whole payload."""
        require(len(data) <= self.max_delta_bytes, "length", f"frame {frame}: a payload above the stream's maximum")
        entry = data, last_input, state_hash
        require(self.deltas.setdefault(frame, entry) == entry, "sample", f"frame {frame} came twice and differs")

    def add_snapshot(self, data, epoch, stream_id, generation, frame):
        """A whole snapshot; it must say what its samples said."""
        require(len(data) <= self.max_snapshot_bytes, "length", "a snapshot above the stream's maximum")
        cut = snapshot.read(data, self.stream)
        said = cut.epoch, cut.stream, cut.generation, cut.frame
        require(said == (epoch, stream_id, generation, frame), "snapshot", f"it says {said}, its samples other")
        self.snapshots[frame] = cut

    def check(self, inputs):
        """Check every frame that can be reached from a snapshot; how many frames were."""
        timeline, checked = None, 0
        frames = sorted(set(self.deltas) | set(self.snapshots))
        for frame in frames:
            if timeline and frame in self.deltas and frame == timeline.frame + 1:
                self.check_frame(timeline, frame, inputs)
                checked += 1
                if frame in self.snapshots:
                    compare_with_snapshot(timeline, self.snapshots[frame])
            elif frame in self.snapshots:
                if timeline:
                    self.notes.append(f"frames {timeline.frame + 1} to {frame} are not in the file")
                timeline = Timeline.of_snapshot(self.stream, self.snapshots[frame])
            elif timeline:
                self.notes.append(f"frame {timeline.frame + 1} is not in the file")
                timeline = None
        before_first = [frame for frame in self.deltas if not self.snapshots or frame < min(self.snapshots)]
        if before_first:
            self.notes.append(f"{len(before_first)} deltas lie before the first snapshot and were not checked")
        return checked

    def check_frame(self, timeline, frame, inputs):
        """One predicted step, its delta, and the hash."""
        data, last_input, state_hash = self.deltas[frame]
        try:
            require(last_input >= timeline.last_input, "input", "last_input goes back")
            for number in range(timeline.last_input + 1, last_input + 1):
                require(number in inputs, "input", f"scheduled input {number} is not in the file")
                timeline.add_input(number, *inputs[number])
            timeline.last_input = last_input
            timeline.predict()
            timeline.apply(data)
        except Refused as refusal:
            raise Refused(refusal.rule, f"frame {frame}: {refusal.text}") from None
        check_hash(frame, timeline.world, state_hash)
