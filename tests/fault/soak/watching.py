"""What the cases watch: a server's page of metrics, memory, and who used the processor."""

import os
import pathlib
import re
import resource
import statistics
import threading
import time
import urllib.request

FRAME, PUBLISH = "tandem_frame_duration_seconds", "tandem_publish_duration_seconds"
LATE_S = 0.05
TICK = os.sysconf("SC_CLK_TCK")
OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))


def parse_page(text):
    """Return the values of a page by series, as it writes them: name{label="value"}."""
    values = {}
    for line in text.splitlines():
        if line and not line.startswith("#"):
            series, _, value = line.rpartition(" ")
            values[series] = float(value)
    return values


def read_page(port):
    with OPENER.open(f"http://127.0.0.1:{port}/metrics", timeout=20) as answer:
        return parse_page(answer.read().decode())


def total(page, name, text=""):
    """Return the sum of all series of that name whose labels contain a text."""
    return sum(value for series, value in page.items() if series.partition("{")[0] == name and text in series)


class Durations:
    """What a histogram without labels counted between two pages."""

    def __init__(self, before, after, name):
        prefix = f'{name}_bucket{{le="'
        self.below = sorted(
            (float(series[len(prefix) : -2]), value - before.get(series, 0))
            for series, value in after.items()
            if series.startswith(prefix)
        )
        self.count = after[f"{name}_count"] - before.get(f"{name}_count", 0)
        self.sum_s = after[f"{name}_sum"] - before.get(f"{name}_sum", 0)

    def quantile_ms(self, share):
        """Return the duration that this share does not exceed, interpolated within its bucket as Prometheus does."""
        wanted = share * self.count
        bound, below = 0.0, 0.0
        for next_bound, next_below in self.below:
            if next_below >= wanted and next_below > below:
                if next_bound == float("inf"):
                    return bound * 1000
                return (bound + (next_bound - bound) * (wanted - below) / (next_below - below)) * 1000
            bound, below = next_bound, next_below
        return bound * 1000

    def above(self, bound_s):
        return self.count - next(below for bound, below in self.below if bound >= bound_s)


def frame_and_publish_ms(before, after):
    """Return a lower and an upper bound of the 99th percentile of step + encode + publish.

    The two parts are measured apart. The sum is not below either of them. At most 1 % of the frames exceed the sum of what a
    share of that 1 % exceeds in the one part, and the rest of it in the other; the best split counts.
    """
    parts = [Durations(before, after, name) for name in (FRAME, PUBLISH)]
    splits = (tenths / 1000 for tenths in range(1, 10))
    upper = min(parts[0].quantile_ms(1 - split) + parts[1].quantile_ms(0.99 + split) for split in splits)
    return max(part.quantile_ms(0.99) for part in parts), upper


def blame(frames, usual_s, waited_s):
    """Return how many late frames were late by themselves: without the time in which their threads waited for a processor."""
    late = frames.above(LATE_S)
    late_s = frames.sum_s - (frames.count - late) * usual_s
    return late if late_s - waited_s > late * LATE_S else 0


def waits_s(pid):
    """Return for each thread how long it was ready to run and waited for a processor, since its start."""
    waits = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        try:
            waits[task.name] = int((task / "schedstat").read_text().split()[1]) / 1e9
        except OSError:
            continue  # it ended meanwhile
    return waits


def growth_percent(samples, from_s):
    """Compare the last part of (seconds, kB) with the first part from a time on: medians of a minute each at most."""
    kept = [sample for sample in samples if sample[0] >= from_s]
    if not kept:
        return 0.0
    window_s = min(60.0, max(kept[-1][0] - kept[0][0], 1) / 3)
    first = statistics.median(kb for at, kb in kept if at <= kept[0][0] + window_s)
    last = statistics.median(kb for at, kb in kept if at >= kept[-1][0] - window_s)
    return 100 * (last - first) / first


class Watch:
    """Reads a server's page twice a second and the memory of programs every five, in a thread, until stop()."""

    def __init__(self, server, port, programs):
        self.server, self.port, self.programs = server, port, programs
        self.late = self.own = 0  # frames above 50 ms, and those of them that the scheduler does not explain
        self.memory = {name: [] for name in programs}
        self.heap = []  # kB that the server has allocated, at these seconds
        self.fault = None
        self.first = self.last = read_page(port)
        self.began = time.monotonic()
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        try:
            self.watch()
        except (OSError, ValueError, KeyError, StopIteration) as error:
            self.fault = f"the server could not be watched any more: {error!r}"

    def watch(self):
        waits = [waits_s(self.server.process.pid)] * 2
        usual_s, next_memory = 0.0, 0.0
        while not self.ended.wait(0.5):
            page, now_waits = read_page(self.port), waits_s(self.server.process.pid)
            frames = Durations(self.last, page, FRAME)
            if frames.above(LATE_S):
                # A page may be a quarter of a second old, so its frames may be of the sample before.
                waited_s = max((wait - waits[0].get(thread, 0) for thread, wait in now_waits.items()), default=0)
                self.late += int(frames.above(LATE_S))
                self.own += int(blame(frames, usual_s, waited_s))
            elif frames.count:
                usual_s = frames.sum_s / frames.count
            self.last, waits = page, [waits[1], now_waits]
            since = time.monotonic() - self.began
            if since >= next_memory:
                next_memory = since + 5
                self.heap.append((since, total(page, "tandem_heap_bytes") / 1024))
                for name, program in self.programs.items():
                    self.memory[name].append((since, program.resident_kb()))

    def stop(self):
        """Return the first and the last page, and the seconds between them."""
        self.ended.set()
        self.thread.join()
        return self.first, self.last, time.monotonic() - self.began


class Machine:
    """The processor time that others used while a case ran."""

    def __init__(self):
        self.busy, self.all = self.jiffies()
        self.ours = self.own_s()

    @staticmethod
    def jiffies():
        fields = [int(word) for word in pathlib.Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
        return sum(fields) - fields[3] - fields[4], sum(fields)

    @staticmethod
    def own_s():
        """Return the time of this program and of those that it started and that have ended."""
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        return sum(each.ru_utime + each.ru_stime for each in used)

    def others_percent(self):
        """Return the others' share of all cores. Call it when all programs of the case have ended."""
        busy, every = self.jiffies()
        others = (busy - self.busy) / TICK - (self.own_s() - self.ours)
        return max(0.0, 100 * others / max((every - self.all) / TICK, 0.01))


def port_of(program, what):
    """Return the port in a program's line such as "metrics at http://127.0.0.1:9730/metrics"."""
    pattern = re.compile(what + r".*?http://127\.0\.0\.1:(\d+)")
    return next((int(found[1]) for _, line in list(program.lines) if (found := pattern.search(line))), None)
