#!/usr/bin/env python3
"""The commands of deploy/SECURE.md and no others, on three machines: a server and two clients, on a bridge.

first_session.py --tandemd PATH --tandem PATH

Reads the commands from the page. Prints how many they were and how long they took. Exit 0 passed, 1 failed, 77 not run:
namespaces are not allowed here.
"""

import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "tests" / "fault"))
from stage import Failed, Namespace, arguments, run  # noqa: E402


def commands():
    """The lines of the page's blocks."""
    page = (ROOT / "deploy" / "SECURE.md").read_text()
    return [line for block in re.findall(r"```\n(.*?)```", page, re.S) for line in block.splitlines() if line]


def machine(number):
    """A network namespace with one interface on the bridge."""
    made = Namespace(f"eth{number}")
    ip = lambda *words: subprocess.run(["ip", *words], check=True)  # noqa: E731
    ip("link", "add", made.interface, "type", "veth", "peer", "name", f"port{number}")
    ip("link", "set", f"port{number}", "master", "bridge0", "up")
    # By descriptor, as the namespace has no name.
    keeper = None
    with made.entered():
        keeper = subprocess.Popen(["sleep", "120"])
    try:
        ip("link", "set", made.interface, "netns", str(keeper.pid))
        with made.entered():
            ip("addr", "add", f"10.7.0.{number}/24", "dev", made.interface)
            ip("link", "set", made.interface, "up")
            ip("link", "set", made.interface, "multicast", "on")
            ip("route", "add", "224.0.0.0/4", "dev", made.interface)
    finally:
        keeper.kill()
        keeper.wait()
    return made


def first_secure_session(stage):
    lines = commands()
    subprocess.run(["ip", "link", "add", "bridge0", "type", "bridge", "mcast_snooping", "0"], check=True)
    subprocess.run(["ip", "link", "set", "bridge0", "up"], check=True)
    server, *clients = [machine(number) for number in (1, 2, 3)]
    home = pathlib.Path(stage.folder)
    programs = {"tandem": str(stage.options.tandem.resolve()), "tandemd": str(stage.options.tandemd.resolve())}
    began = time.monotonic()

    def words(line):
        first, *rest = shlex.split(line)
        # The folders of the page are those that were copied.
        rest = [str(home / word) if before == "--secure" else word for before, word in zip([first, *rest], rest)]
        return [programs[first], *rest]

    for line in lines:
        if line.startswith("tandem pki"):
            done = subprocess.run(words(line), cwd=home, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise Failed(f"{line}: {done.stderr}")
        elif line.startswith("tandemd"):
            for name in ("alpha", "bob"):
                shutil.copytree(home / "tandem-pki" / name, home / name)
            started = stage.start(*words(line), namespace=server)
            started.wait_for("session 'default'", 60)
            if started.first("without --secure") is not None:
                raise Failed("the server is not secure")
        else:
            players = [stage.start(*words(line), "--seconds", 3, "--json", namespace=each) for each in clients]
            for player in players:
                player.wait_for("playing from frame", 30)
    took = time.monotonic() - began
    stranger = stage.start(stage.options.tandem, "join", "--timeout", 3, "--json", namespace=clients[0])
    reports = [player.output(30) for player in players]
    print(f"  {len(lines)} commands, {took:.1f} s to two clients that play")
    if any(not report.get("frames_applied") or report["hash_mismatches"] for report in reports):
        raise Failed(f"a client did not play: {reports}")
    stranger.wait_for("never played", 30)
    for each in (server, *clients):
        each.end()


def main():
    parser = arguments(__doc__)
    options = parser.parse_args()
    return run({"first_secure_session": first_secure_session}, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
