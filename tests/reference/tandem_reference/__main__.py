"""Check a capture file, or test vectors: see tests/reference/README.md."""

import pathlib
import sys

from . import capture, mcap, vectors
from .errors import Refused

USAGE = """usage: python3 -m tandem_reference FILE.mcap     check every frame of a capture
       python3 -m tandem_reference --vectors DIR    check the test vectors of a folder
exit status: 0 all agree, 1 something differs or is refused, 2 usage or unreadable file"""


def check_file(path):
    """Check a capture; the exit status."""
    try:
        held = capture.read(pathlib.Path(path).read_bytes())
        recordings = held.recordings()
        checked = 0
        for key, recording in recordings.items():
            count = recording.check(held.inputs.get(key[0], {}))
            checked += count
            print(f"{capture.name(key)}: {count} frames agree")
            held.notes += [f"{capture.name(key)}: {note}" for note in recording.notes]
    except (OSError, mcap.McapError) as error:
        print(f"{path}: {error}", file=sys.stderr)
        return 2
    except Refused as refusal:
        print(f"{path}: {refusal}", file=sys.stderr)
        return 1
    for note in held.notes:
        print(f"{path}: note: {note}", file=sys.stderr)
    if checked == 0:
        print(f"{path}: no frame could be checked", file=sys.stderr)
        return 1
    print(f"{checked} frames checked")
    return 0


def main(arguments):
    """The exit status of a command line."""
    if len(arguments) == 2 and arguments[0] == "--vectors":
        if not pathlib.Path(arguments[1]).is_dir():
            print(f"{arguments[1]} is not a folder", file=sys.stderr)
            return 2
        return 0 if vectors.check_folder(arguments[1], print) else 1
    if arguments == ["--help"]:
        print(USAGE)
        return 0
    if len(arguments) == 1 and not arguments[0].startswith("-"):
        return check_file(arguments[0])
    print(USAGE, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
