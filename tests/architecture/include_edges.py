"""Reads every #include line of the sources and fails on an edge that the architecture forbids.

    python3 include_edges.py [ROOT]

Prints one line per forbidden edge: file:line: reason. Exit 0 none, 1 some, 2 usage. Which wing may include what
stands in the tables below; a wing without a row is an error, so that a new one has to be thought about.
"""

import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SUFFIXES = {".cpp", ".hpp", ".c", ".h"}
SKIPPED = {"build", ".git"}

# What the files of a wing (a folder two deep) may include besides those of their own wing. A row below a wing is for a room that
# may include less or more than the rest of it; the longest matching row decides. A name may be a wing, a room or one header.
PUBLIC, WIRE = ["sdk/include"], ["sdk/include", "sdk/core", "sdk/wire"]
ASSERT = "sdk/core/lattice/assert.hpp"  # for wings that know nothing else of the core
SDK = [*WIRE, "sdk/client", "sdk/statistics", "sdk/transport", "sdk/workers"]
WINGS = {
    "sdk/include": [],
    "sdk/core": PUBLIC,
    "sdk/wire": ["sdk/include", "sdk/core"],
    "sdk/transport": [*WIRE, "sdk/workers/doorbell.hpp"],
    "sdk/statistics": [],
    "sdk/workers": [ASSERT, "sdk/core/lattice/run_blocks.hpp"],
    "sdk/client": [*WIRE, "sdk/statistics"],
    "sdk/client/api": SDK,  # what applications link chooses the transport; the client behind it knows none
    "sdk/web": [*WIRE, "sdk/client", "sdk/transport/websocket"],
    "sdk/python": [*PUBLIC, ASSERT],
    "sdk/examples": PUBLIC,
    "services/program": [*WIRE, "sdk/statistics"],
    "services/host": [*WIRE, "sdk/statistics", "sdk/workers", "services/program"],
    "services/host/api": [*SDK, "services/program"],  # what applications link chooses the transport
    "services/engines": ["sdk/include", "sdk/workers", ASSERT],
    "services/engines/door": ["sdk/include", "services/program/system/descriptor.hpp", ASSERT],
    # A scene has a trained table, and is protobuf's text.
    "services/engines/scenes": ["sdk/include", "services/host/planning", "services/program/protobuf_text", ASSERT],
    "services/engines/sessions": ["sdk/include", "services/host/planning"],  # a scene becomes a plan
    "services/follow": [*WIRE, "sdk/client", "sdk/statistics", "services/host/accounts", "services/program"],
    "services/follow/recording/python": [*WIRE, "sdk/client", "sdk/python"],
    "services/credentials": ["sdk/include", "sdk/transport/secure", "services/program"],
    "services/adapters/imd": ["sdk/include", "services/program", "services/adapters/lammps/radii.hpp"],  # both bin radii alike
    "services/adapters/lammps": ["sdk/include/tandem/engine.h"],  # a program of another licence
    "services/tandemd": [*SDK, "services/engines", "services/host", "services/program"],
    "services/gateway": [*SDK, "services/credentials", "services/follow", "services/host/accounts", "services/program"],
    "services/relay": [*SDK, "services/follow", "services/host", "services/program"],
    "services/tool": [*SDK, "services/credentials", "services/engines", "services/follow", "services/host", "services/program"],
    "services/lab": [*SDK, "services/engines", "services/follow", "services/host", "services/program", "services/tool"],
    "tests": ["sdk", "services", "tests"],
}
# Rooms of a wing in an order in which each may include itself and those of the steps before it.
ORDERED = {"sdk/core": [["lattice"], ["layout"], ["predict", "codec", "news"], ["tables", "data"], ["timeline"]]}

# Headers from outside the project, and the only folders that may include them.
OWNERS = [
    (re.compile(r"^(dds/|dds\.h$|ddsc/|tandem\.h$|idl/tandem\.h$)"), "DDS", ["sdk/transport/dds", "tests/integration/transport"]),
    (re.compile(r"^(fastdds|fastrtps)/|^tandemPubSubTypes"), "Fast DDS", ["tests/integration/fastdds"]),
    (re.compile(r"^google/protobuf/|\.pb\.h$"), "protobuf", ["services/engines/scenes", "services/gateway/command_line.cpp", "services/program/configuration", "services/program/protobuf_text", "services/relay/command_line.cpp", "services/tandemd", "tests/unit/configuration", "tests/unit/tandemd"]),
    (re.compile(r"^Eigen/"), "Eigen", ["services/engines", "sdk/include/tandem/eigen.hpp", "sdk/examples", "tests"]),
    (re.compile(r"^(btBullet|Bullet|LinearMath/)"), "Bullet", ["services/engines/bullet", "tests/bench/trajectories"]),
    (re.compile(r"^(lammps/|mpi\.h$)"), "LAMMPS and MPI", ["services/adapters/lammps"]),
    (re.compile(r"^(spdlog|fmt)/"), "spdlog and fmt", ["services", "tests/bench/lab", "tests/unit/logging"]),
    (re.compile(r"^pybind11/"), "pybind11", ["sdk/python", "services/follow/recording/python"]),
    (re.compile(r"^CLI/"), "CLI11", ["services/program/commandline"]),
    (re.compile(r"^libwebsockets\.h$"), "libwebsockets", ["sdk/transport/websocket/gateway_link.cpp", "services/gateway", "tests/integration/gateway", "tests/bench/gateway"]),
    (re.compile(r"^nats/"), "libnats", ["sdk/transport/nats/nats_bus.cpp"]),
    (re.compile(r"^systemd/"), "libsystemd", ["services/program/process"]),
    (re.compile(r"^prometheus/"), "prometheus-cpp", ["services/program/metrics"]),
    (re.compile(r"^openssl/"), "OpenSSL", ["sdk/transport/secure", "services/follow/audience", "services/gateway", "services/credentials/pki", "services/credentials/tokens", "services/lab/trajectories", "tests"]),
    (re.compile(r"^tinyxml2"), "tinyxml2", ["services/tool/doctor"]),
    (re.compile(r"^(curses|term)\.h$"), "ncurses", ["services/tool/top/screen"]),
    (re.compile(r"^zlib\.h$"), "zlib", ["services/gateway", "services/adapters/imd", "services/follow/recording/mcap_writer.cpp", "tests/bench/audience", "tests/unit/imd"]),
    (re.compile(r"^nlohmann/"), "nlohmann-json", ["services/follow/audience", "services/follow/recording/events.cpp", "services/program/json", "services/lab", "tests"]),
    (re.compile(r"^(gtest|gmock|rapidcheck|benchmark)[/.]"), "test libraries", ["tests"]),
]

# The core is pure: its results depend only on its arguments.
IMPURE = re.compile(
    r"^(thread|mutex|shared_mutex|condition_variable|atomic|future|barrier|latch|semaphore|stop_token|chrono|ctime|"
    r"time\.h|fstream|iostream|ostream|istream|sstream|filesystem|cstdio|stdio\.h|random|cstdlib|unistd\.h|"
    r"pthread\.h|fcntl\.h|sys/.*)$"
)


# A failed assertion has to be reported.
IMPURE_FILES = {ASSERT}


def within(path, folder):
    return path == folder or path.startswith(folder + "/")


def rule_of(path):
    """The longest row that holds `path`, or None."""
    return max((row for row in WINGS if within(path, row)), key=len, default=None)


def wing_of(path):
    return "/".join(path.split("/")[:2])


def step_of(path):
    """How far up in the order of its wing `path` is, or None where there is no order."""
    for wing, steps in ORDERED.items():
        for number, rooms in enumerate(steps):
            if any(within(path, f"{wing}/{room}") for room in rooms):
                return number
    return None


def allowed(path, rule, target):
    wing = wing_of(path)
    if wing in WINGS and wing == wing_of(target):
        return wing not in ORDERED or step_of(target) < step_of(path) or path.split("/")[2] == target.split("/")[2]
    return rule_of(target) == rule or any(within(target, row) for row in WINGS[rule])


def resolve(root, quoted):
    """The path from the root that a project include names, or None for a header from outside."""
    if (root / quoted).is_file():
        return quoted
    if (root / "sdk/include" / quoted).is_file():
        return "sdk/include/" + quoted
    return None


def check_include(root, path, style, name):
    """The reason why `path` may not include `name`, or None."""
    rule = rule_of(path)
    target = resolve(root, name)
    if target is not None:
        if style == "<" and not within(path, "sdk/examples"):
            return f"<{name}> is ours: include it with quotes"
        if allowed(path, rule, target):
            return None
        return f"{rule} may not include {target}"
    for pattern, what, owners in OWNERS:
        if pattern.search(name):
            if any(within(path, owner) for owner in owners):
                return None
            return f'"{name}": {what} headers belong to {", ".join(owners)}'
    if style == '"' and within(path, "tests") and (root / path).parent.joinpath(name).is_file():
        return None
    # An example of tests/architecture adds files to a tree of its own, by paths from that tree's root.
    if style == '"' and within(path, "tests/architecture/examples") and root.joinpath(*path.split("/")[:4], name).is_file():
        return None
    if style == '"':
        return f'"{name}" is neither a path from the root nor a public header'
    if within(path, "sdk/core") and path not in IMPURE_FILES and IMPURE.search(name):
        return f"<{name}>: the core knows no threads, clocks, files or randomness"
    return None


def violations(root):
    """Every forbidden edge below `root`, as "file:line: reason", in path order."""
    root = pathlib.Path(root)
    found = []
    for file in sorted(root.rglob("*")):
        path = file.relative_to(root).as_posix()
        if file.suffix not in SUFFIXES or path.split("/")[0] in SKIPPED or "/node_modules/" in path or path.startswith("build-"):
            continue
        if rule_of(path) is None:
            found.append(f"{path}:1: no rule says what this folder may include (tests/architecture)")
            continue
        for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
            match = INCLUDE.match(line)
            reason = check_include(root, path, *match.groups()) if match else None
            if reason:
                found.append(f"{path}:{number}: {reason}")
    return found


def main():
    if len(sys.argv) > 2:
        print(__doc__, file=sys.stderr)
        return 2
    root = sys.argv[1] if len(sys.argv) == 2 else pathlib.Path(__file__).resolve().parents[2]
    found = violations(root)
    print("\n".join(found) if found else "no forbidden include edge")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
