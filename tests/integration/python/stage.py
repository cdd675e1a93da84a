"""A tandemd on loopback, and what its clients hold, for the tests of Python clients.

Environment: TANDEMD, TANDEM (the programs).
"""

import contextlib
import os
import pathlib
import random
import signal
import subprocess

TAG = f"python-test-{os.getpid()}"
# Before the package is imported: its Cyclone DDS reads it once.
os.environ["CYCLONEDDS_URI"] = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>{TAG}</Tag></Discovery></Domain></CycloneDDS>"
)
DOMAIN = random.Random(os.getpid()).randrange(20, 90)
LIMIT_S = 60  # of any one wait; a busy machine is slow


def common(session, domain=DOMAIN):
    return ["--domain", domain, "--session", session]


@contextlib.contextmanager
def server(session, *arguments, scene="half_pipe", bodies=300, log=None, domain=DOMAIN):
    """Runs until the block ends; its hashes go to `log`."""
    hashes = ["--hash-log", log] if log else []
    # There is one stream, so that a frame has one hash.
    hashes += [] if {"--predictor", "--codec", "--stream"} & set(arguments) else ["--predictor", "field"]
    command = [os.environ["TANDEMD"], "--scene", scene, "--bodies", bodies, *common(session, domain), *hashes, *arguments]
    with subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGCONT)
            process.terminate()
            process.wait(LIMIT_S)


@contextlib.contextmanager
def refused(case, code):
    """Checks that the block raises tandem.Error with that code."""
    import tandem

    with case.assertRaises(tandem.Error) as raised:
        yield
    case.assertEqual(raised.exception.code, code)


def tool(*arguments):
    """Runs `tandem` to its end."""
    done = subprocess.run(
        [os.environ["TANDEM"], *map(str, arguments)], capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    assert done.returncode == 0, f"tandem {arguments[0]}: exit {done.returncode}: {done.stderr[-800:]}"
    return done.stdout


def hashes(log):
    """{(epoch, frame): hash}; a last line that was cut off does not count."""
    lines = pathlib.Path(log).read_text(encoding="ascii").split("\n")[:-1]
    return {(int(epoch), int(frame)): int(value, 16) for epoch, frame, value in (line.split(",") for line in lines)}
