#!/usr/bin/env python3
"""Ten clients on links of their own, four of which lag, each for another reason; `tandem top` has to name the reasons.

newcomer.py --tandemd PATH --tandem PATH [--seconds N] [--picture]

lossy     its link loses packets
thin      its link carries less than its stream takes
stopped   an observer whose process is stopped in turns, as when others take its processor
held      a participant whose process is stopped for longer: the server waits, and makes it an observer
The other six play. `tandem top` gets 60 s; then its screen must name each reason, and nothing about the others.
--picture prints the screen alone, for deploy/monitor/README.md. Exit 0 passed, 1 failed, 77 not run: namespaces or TAP
devices are not allowed here.
"""

import argparse
import contextlib
import os
import pathlib
import random
import re
import signal
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE.parents[1] / "fault"), str(HERE.parents[1] / "fault" / "links")]
from relay import Network  # noqa: E402
from stage import NOT_RUN, SEED, URI, Failed, Stage, enter_namespace  # noqa: E402
from terminal import Terminal  # noqa: E402

GOOD = [f"desk{number}" for number in range(1, 7)]
NAMES = [*GOOD, "lossy", "thin", "stopped", "held"]
REASONS = {
    "lossy": r"link (loses packets|slow or lossy)",
    "thin": r"link (too thin|slow or lossy)",
    "stopped": r"process held up",
    "held": r"(demoted|plays).*(process held up|held the server up)",
}


class Turns:
    """Stops a process and lets it go on, in turns of half to all of these times, until the end of the `with`."""

    def __init__(self, process, stopped_s, running_s):
        self.process, self.stopped_s, self.running_s = process, stopped_s, running_s
        self.random = random.Random(SEED)  # turns of one length would be in step with what the process does every second
        self.ends = threading.Event()
        self.thread = threading.Thread(target=self.run)

    def run(self):
        while not self.ends.is_set():
            self.process.send_signal(signal.SIGSTOP)
            self.ends.wait(self.stopped_s * self.random.uniform(0.5, 1))
            self.process.send_signal(signal.SIGCONT)
            self.ends.wait(self.running_s * self.random.uniform(0.5, 1))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ends.set()
        self.thread.join()
        self.process.send_signal(signal.SIGCONT)


def named(host, *command):
    """The command on a machine of this name."""
    return ("unshare", "--uts", "sh", "-c", 'hostname "$1" && shift && exec "$@"', "sh", host, *command)


def play(stage, network, seconds, picture):
    say = (lambda *_: None) if picture else print
    server = stage.start(*named("server1", stage.options.tandemd, "--scene", "half_pipe", "--bodies", 10_000, "--session", "arena",
                         "--scripted", "--predictor", "ballistic", "--json"), namespace=network.server)  # fmt: skip
    server.wait_for("scene half_pipe", 60)
    time.sleep(2)
    network.set("lossy", loss=0.08, delay_ms=20)
    clients = {}
    for name in NAMES:
        observes = ("--observe", "--max-delay", "0") if name == "stopped" else ()
        clients[name] = stage.start(*named(name, stage.options.tandem, "join", "--session", "arena", *observes),
                                    namespace=network.clients[name])  # fmt: skip
    for name in NAMES:
        clients[name].wait_for("playing from frame", 60)
    say(f"all play; the seed of the turns and links is {SEED}")
    network.set("thin", "down", rate_kbit=300)
    os.environ["CYCLONEDDS_URI"] = URI.format(network.server.interface)
    with contextlib.ExitStack() as stack:
        stack.enter_context(Turns(clients["stopped"].process, 0.4, 0.2))
        stack.enter_context(Turns(clients["held"].process, 1.0, 0.8))
        with network.server.entered():
            terminal = stack.enter_context(Terminal([stage.options.tandem, "top"], 100, 30))
        started = time.monotonic()
        found = {}
        while len(found) < len(REASONS) and time.monotonic() < started + seconds:
            terminal.run(0.5)
            for line in terminal.screen.text():
                for name, words in REASONS.items():
                    if name not in found and re.search(rf" {name} ", line) and re.search(words, line):
                        found[name] = time.monotonic() - started
                        say(f"{found[name]:5.1f} s: {line.strip()}")
        terminal.run(2 if not picture else max(0, started + 45 - time.monotonic()))
        screen = terminal.screen.text()
        print("\n".join(screen).rstrip())
        if picture:
            for _ in range(3):
                terminal.press("down")
            terminal.press("enter")
            terminal.run(1.5)
            print("\n" + "\n".join(terminal.screen.text()).rstrip())
        terminal.end("q")
    if missing := REASONS.keys() - found.keys():
        raise Failed(f"no reason was named within {seconds} s for {', '.join(sorted(missing))}")
    for line in screen:
        if any(f" {name} " in line for name in GOOD) and re.search("link|held|demoted", line):
            raise Failed(f"a reason for a client that plays: {line.strip()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", type=pathlib.Path, required=True)
    parser.add_argument("--tandem", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--picture", action="store_true")
    options = parser.parse_args()
    if not enter_namespace() or not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        print("not run: network namespaces or TAP devices are not allowed here")
        return NOT_RUN
    stage = Stage(options)
    try:
        with Network(*NAMES) as network:
            play(stage, network, options.seconds, options.picture)
    except Failed as failure:
        print(f"FAILED: {failure}")
        return 1
    finally:
        stage.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
