"""Reads every #include line of the sources and fails on an edge that the architecture forbids.

    python3 include_edges.py [ROOT]

Prints one line per forbidden edge: file:line: reason. Exit 0 none, 1 some, 2 usage. Which folder may include what
stands in the tables below; a folder without an entry is an error, so that a new one has to be thought about.
"""

import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SUFFIXES = {".cpp", ".hpp", ".c", ".h"}
SKIPPED = {"build", ".git"}

# Project folders that a folder may include, besides itself; the longest matching folder of a file decides.
# A name ending in .hpp is that header alone. "public" is sdk/include/tandem.
CORE = ["public/result.hpp", "sdk/core/lattice"]
LAYOUT = CORE + ["sdk/core/layout"]
PREDICT = ["sdk/core/predict", "sdk/core/predict/contact"]
CODEC = ["sdk/core/codec", "sdk/core/codec/paper", "sdk/core/codec/tracker"]
TABLES = LAYOUT + PREDICT + CODEC + ["sdk/core/tables"]
TIMELINE = TABLES + ["sdk/core/timeline"]
FIGURES = ["public/client_figures.hpp", "public/server_figures.hpp"]
CLIENT = ["sdk/client", "sdk/client/drawing", "sdk/client/following", "sdk/client/session"]
DOOR = ["services/engine/door"]
SIMULATION = ["services/host/include/tandem/simulation.hpp"]
HOST = ["services/host", "services/host/clients", "services/host/frames", "services/host/keeping", "services/host/outgoing"]
HOST += ["services/host/standbys", "services/host/streams"]
LAB = ["services/lab/bandwidth", "services/lab/framerate", "services/lab/measures", "services/lab/scale", "services/lab/trajectories"]
# Folders that all rooms of a target may include, besides one another.
OF_CLIENT = TIMELINE + ["public", "sdk/statistics", "sdk/transport"]
OF_HOST = SIMULATION + TIMELINE + FIGURES + ["sdk/statistics", "sdk/transport", "services/accounts", "services/checkpoint", "sdk/workers"]
OF_TANDEMD = (
    SIMULATION
    + TABLES
    + ["sdk/transport", "sdk/transport/dds", "services/commandline", "services/json", "services/metrics", "sdk/statistics"]
    + ["services/checkpoint", "services/planning", "services/process", "services/scenes", "services/sessions", "services/standby"]
    + ["services/logging", "sdk/workers", "sdk/transport/network", "sdk/transport/secure"]
    + ["services/engine/background", "public/body_shape.hpp", "services/host/include/tandem/scenery.hpp"]
    + DOOR
    + HOST
)
OF_LAB = (
    SIMULATION
    + TIMELINE
    + ["public", "sdk/client/api", "sdk/transport", "sdk/transport/dds", "sdk/transport/simulated", "sdk/statistics"]
    + CLIENT
    + HOST
    + ["services/audience", "services/commandline", "services/engine/background", "services/engine/common", "services/json", "services/recording", "services/scenes"]
    + ["services/planning", "services/sessions", "services/system", "services/tool", "sdk/workers"]
    + DOOR
)
EDGES = {
    "sdk/include": [],
    "sdk/core/lattice": ["public/result.hpp"],
    "sdk/core/layout": CORE,
    "sdk/core/predict": LAYOUT,
    "sdk/core/predict/ballistic": LAYOUT + ["sdk/core/predict"],
    "sdk/core/predict/contact": LAYOUT + ["sdk/core/predict"],
    "sdk/core/predict/hard": LAYOUT + ["sdk/core/predict", "sdk/core/predict/contact"],
    "sdk/core/predict/rigid": LAYOUT + ["sdk/core/predict", "sdk/core/predict/contact"],
    "sdk/core/codec": LAYOUT,
    "sdk/core/codec/paper": LAYOUT + ["sdk/core/codec"],
    "sdk/core/codec/tracker": LAYOUT + ["sdk/core/codec"],
    "sdk/core/tables": LAYOUT + PREDICT + CODEC + ["sdk/core/predict/ballistic", "sdk/core/predict/hard",
                                           "sdk/core/predict/rigid"],
    "sdk/core/timeline": TABLES,
    "sdk/transport": LAYOUT + FIGURES + ["public/body_shape.hpp"],
    "sdk/transport/simulated": LAYOUT + ["sdk/transport"],
    "sdk/transport/websocket": LAYOUT + ["sdk/transport"],
    "sdk/transport/nats": LAYOUT + ["sdk/transport"],
    "sdk/transport/network": ["public/result.hpp"],
    "sdk/transport/dds": LAYOUT + ["sdk/transport", "sdk/transport/network", "sdk/transport/secure"],
    "sdk/transport/secure": ["public/result.hpp"],
    "sdk/statistics": [],
    "sdk/workers": [],
    "sdk/client/drawing": OF_CLIENT,
    "sdk/client/following": OF_CLIENT + ["sdk/client/session/resync_reason.hpp"],
    "sdk/client/session": OF_CLIENT,
    "sdk/client": OF_CLIENT + CLIENT,
    "sdk/client/api": TIMELINE + ["public", "sdk/workers", "sdk/transport", "sdk/transport/dds", "sdk/transport/websocket"] + CLIENT,
    "sdk/client/api/browsing": TIMELINE + ["public", "sdk/transport", "sdk/transport/dds", "sdk/client/api"] + CLIENT,
    "sdk/web/module": OF_CLIENT + CLIENT + ["sdk/transport/websocket"],
    "sdk/python": ["public"],
    "sdk/examples": ["public", "services/host/include"],
    "services/system": [],
    "services/process": [],
    "services/commandline": [],
    "services/json": [],
    "services/tokens": ["public/result.hpp", "services/json"],
    "services/metrics": FIGURES + LAYOUT + ["public/client_types.hpp", "sdk/statistics", "sdk/transport", "services/accounts/token_bucket.hpp", "services/system"],
    "services/pki": ["public/result.hpp", "sdk/transport/secure", "services/json", "services/system"],
    "services/accounts": LAYOUT + ["sdk/transport"],
    "services/checkpoint": LAYOUT + ["sdk/transport", "services/system"] + SIMULATION,
    "services/host/include": ["public/result.hpp", "public/body_shape.hpp", "public/server_figures.hpp"],
    "services/planning": OF_HOST
    + ["public/body_shape.hpp", "services/host/include/tandem/scenery.hpp", "services/host/frames", "services/host/streams"]
    + ["sdk/core/predict/rigid"],
    "services/host/streams": OF_HOST,
    "services/host/outgoing": OF_HOST,
    "services/host/frames": OF_HOST + ["services/host/outgoing", "services/host/streams"],
    "services/host/clients": OF_HOST + ["services/host/frames", "services/host/outgoing"],
    "services/host/standbys": OF_HOST + ["services/host/clients", "services/host/frames", "services/host/outgoing"],
    "services/host/keeping": OF_HOST + ["services/host/frames", "services/host"],
    "services/logging": ["services/accounts", "services/json", "sdk/transport/units.hpp"],
    "services/standby": LAYOUT + ["sdk/transport", "services/checkpoint"] + SIMULATION,
    "services/host": OF_HOST + HOST,
    "services/host/api": TIMELINE + ["services/host/include", "sdk/transport", "sdk/transport/dds", "sdk/transport/network", "services/checkpoint", "services/planning"] + HOST,
    "services/engine/background": ["public/result.hpp"] + SIMULATION,
    "services/engine/common": ["public/result.hpp"] + SIMULATION,
    "services/engine/door": ["public/result.hpp", "public/body_shape.hpp", "services/host/include/tandem/scenery.hpp"] + SIMULATION,
    # A program of another licence: it includes one header, and no library of ours.
    "services/engine/lammps": ["public/engine.h"],
    "services/engine/particles": ["public/result.hpp", "services/engine/common", "sdk/workers"] + SIMULATION,
    "services/engine/bullet": ["public/result.hpp", "services/engine/common"] + SIMULATION,
    "services/imd": ["public/engine.h", "public/result.hpp", "services/commandline", "services/engine/lammps/radii.hpp"],
    "services/scenes": ["public/result.hpp", "services/engine/bullet", "services/engine/common", "services/engine/particles"]
    + ["services/planning/trained_table.hpp"]
    + SIMULATION,
    "services/sessions": ["public", "services/planning", "services/scenes"],
    "services/doctor": ["public/result.hpp", "sdk/transport", "sdk/transport/dds", "sdk/transport/nats", "sdk/transport/network", "sdk/transport/secure"]
    + ["services/system"],
    "services/recording": OF_CLIENT + CLIENT + ["services/system"],
    "services/recording/python": TIMELINE + ["public", "sdk/client/api", "sdk/python", "sdk/transport", "services/recording"] + CLIENT,
    "services/audience": OF_CLIENT + CLIENT + ["services/json", "services/system"],
    "services/tandemd/configuration": OF_TANDEMD,
    "services/tandemd": OF_TANDEMD + ["services/tandemd/configuration"],
    "services/following": OF_CLIENT + CLIENT + ["services/accounts"],
    "services/gateway/viewing": OF_CLIENT + CLIENT + ["services/accounts", "services/following", "services/gateway/refusal.hpp"],
    "services/gateway/doors": ["public/result.hpp", "sdk/transport/units.hpp", "services/accounts", "services/system", "services/tokens"],
    "services/gateway": OF_CLIENT
    + CLIENT
    + ["services/gateway/doors", "services/gateway/viewing"]
    + ["sdk/client/api", "sdk/transport/dds", "sdk/transport/nats", "services/accounts", "services/commandline", "services/json"]
    + ["services/following", "services/logging", "services/metrics", "services/process", "services/system", "services/tokens"],
    "services/relay": OF_CLIENT
    + CLIENT
    + HOST
    + SIMULATION
    + ["sdk/client/api", "sdk/transport/dds", "sdk/transport/nats", "sdk/transport/network", "sdk/transport/secure"]
    + ["services/accounts", "services/audience", "services/commandline", "services/following", "services/logging", "services/metrics", "services/process"],
    "services/top/model": LAYOUT + FIGURES + ["sdk/transport", "sdk/transport/dds", "services/json"],
    "services/top/screen": LAYOUT + FIGURES
    + ["sdk/transport", "sdk/transport/dds", "services/json", "services/system", "services/top/model"],
    "services/tool": OF_CLIENT
    + CLIENT
    + HOST
    + ["sdk/client/api", "sdk/transport/dds", "sdk/transport/nats", "services/accounts", "services/audience", "services/checkpoint", "services/commandline", "services/json"]
    + ["services/doctor", "services/imd", "services/logging", "services/metrics", "services/pki", "services/process", "services/recording", "services/scenes"]
    + ["services/system", "services/tokens", "services/top/model", "services/top/screen", "sdk/transport/network", "sdk/transport/secure"]
    + DOOR,
    "services/lab/measures": OF_LAB,
    "services/lab/trajectories": OF_LAB + ["services/lab/measures"],
    "services/lab/bandwidth": OF_LAB + ["services/lab/measures", "services/lab/trajectories"],
    "services/lab/framerate": OF_LAB + ["services/lab/measures"],
    "services/lab/scale": OF_LAB + ["services/lab/measures", "services/engine/bullet", "services/engine/particles", "sdk/client/api", "sdk/transport/dds"],
    "services/lab/commands": OF_LAB + LAB + ["services/process", "sdk/transport/dds"],
    "tests": ["*"],
}

# Headers from outside the project, and the only folders that may include them.
OWNERS = [
    (re.compile(r"^(dds/|dds\.h$|ddsc/|tandem\.h$|idl/tandem\.h$)"), "DDS", ["sdk/transport/dds", "tests/integration/transport"]),
    (re.compile(r"^(fastdds|fastrtps)/|^tandemPubSubTypes"), "Fast DDS", ["tests/integration/fastdds"]),
    (re.compile(r"^google/protobuf/|\.pb\.h$"), "protobuf", ["services/scenes", "services/tandemd", "tests/unit/tandemd"]),
    (re.compile(r"^Eigen/"), "Eigen", ["services/engine", "services/scenes", "sdk/include/tandem/eigen.hpp", "sdk/examples", "tests"]),
    (re.compile(r"^(btBullet|Bullet|LinearMath/)"), "Bullet", ["services/engine/bullet", "tests/bench/trajectories"]),
    (re.compile(r"^(lammps/|mpi\.h$)"), "LAMMPS and MPI", ["services/engine/lammps"]),
    (re.compile(r"^(spdlog|fmt)/"), "spdlog and fmt", ["services", "tests/unit/logging"]),
    (re.compile(r"^pybind11/"), "pybind11", ["sdk/python", "services/recording/python"]),
    (re.compile(r"^CLI/"), "CLI11", ["services/commandline"]),
    (re.compile(r"^libwebsockets\.h$"), "libwebsockets", ["sdk/transport/websocket/gateway_link.cpp", "services/gateway", "tests/integration/gateway", "tests/bench/gateway"]),
    (re.compile(r"^nats/"), "libnats", ["sdk/transport/nats/nats_bus.cpp"]),
    (re.compile(r"^systemd/"), "libsystemd", ["services/process"]),
    (re.compile(r"^prometheus/"), "prometheus-cpp", ["services/metrics"]),
    (re.compile(r"^openssl/"), "OpenSSL", ["sdk/transport/secure", "services/audience", "services/gateway", "services/pki", "services/tokens", "tests"]),
    (re.compile(r"^(curses|term)\.h$"), "ncurses", ["services/top/screen"]),
    (re.compile(r"^zlib\.h$"), "zlib", ["services/gateway", "services/imd", "tests/bench/audience", "tests/unit/imd"]),
    (re.compile(r"^nlohmann/"), "nlohmann-json", ["services/audience", "services/json", "services/lab", "tests"]),
    (re.compile(r"^(gtest|gmock|rapidcheck|benchmark)[/.]"), "test libraries", ["tests"]),
]

# The core is pure: its results depend only on its arguments.
IMPURE = re.compile(
    r"^(thread|mutex|shared_mutex|condition_variable|atomic|future|barrier|latch|semaphore|stop_token|chrono|ctime|"
    r"time\.h|fstream|iostream|ostream|istream|sstream|filesystem|cstdio|stdio\.h|random|cstdlib|unistd\.h|"
    r"pthread\.h|fcntl\.h|sys/.*)$"
)


# A failed assertion has to be reported.
IMPURE_FILES = {"sdk/core/lattice/assert.hpp"}


def within(path, folder):
    return path == folder or path.startswith(folder + "/")


def rule_of(path, table):
    """The longest folder of `table` that holds `path`, or None."""
    return max((folder for folder in table if within(path, folder)), key=len, default=None)


def allowed(target, edges):
    for edge in edges:
        edge = edge.replace("public", "sdk/include/tandem", 1) if within(edge, "public") else edge
        if edge == "*" or target == edge:
            return True
        # A folder's own files; a subfolder with rules of its own needs an entry of its own.
        if within(target, edge) and rule_of(target, EDGES) == rule_of(edge, EDGES):
            return True
    return False


def resolve(root, quoted):
    """The path from the root that a project include names, or None for a header from outside."""
    if (root / quoted).is_file():
        return quoted
    for public in ("sdk/include/", "services/host/include/"):
        if (root / public / quoted).is_file():
            return public + quoted
    return None


def check_include(root, path, style, name):
    """The reason why `path` may not include `name`, or None."""
    rule = rule_of(path, EDGES)
    target = resolve(root, name)
    if target is not None:
        if style == "<" and not within(path, "sdk/examples"):
            return f"<{name}> is ours: include it with quotes"
        if rule == rule_of(target, EDGES) or allowed(target, EDGES[rule]):
            return None
        return f"{rule} may not include {target}"
    for pattern, what, owners in OWNERS:
        if pattern.search(name):
            if any(within(path, owner) for owner in owners):
                return None
            return f'"{name}": {what} headers belong to {", ".join(owners)}'
    if style == '"' and within(path, "tests") and (root / path).parent.joinpath(name).is_file():
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
        if rule_of(path, EDGES) is None:
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
