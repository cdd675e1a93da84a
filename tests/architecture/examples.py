"""Makes the trees of the examples of CONTRIBUTING.md ("Where a new thing goes"), or checks them.

    python3 examples.py [ROOT]           check: each example's lines find their places, it touches no more sources than
                                         CONTRIBUTING.md says, and the figures agree (sdk/package/figures.py)
    python3 examples.py --make NAME DIR  write the files that the example touches into DIR, changed; they are compiled
                                         and run as tests (tests/architecture/examples/CMakeLists.txt)

An example is a folder: the files that it adds, by their paths, and lines.txt. There, a path begins a file of the
repository; `after TEXT`, `before TEXT` and `replace TEXT` find the only place that holds the text, and the lines
behind `| ` are put there. Exit 0 none, 1 some faults, 2 usage.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

# How many sources each may touch by hand.
EXAMPLES = {
    "new_client_figure": 3,
    "new_server_figure": 4,
    "new_predictor": 4,
    "new_stream_option": 3,
}
SOURCES = {".cpp", ".hpp", ".c", ".h", ".idl", ".py", ".ts", ".proto", ".txt"}
# Files that sdk/package/figures.py reads or writes.
FIGURES = (
    "idl/tandem.idl",
    "sdk/include/tandem/client_figures.hpp",
    "sdk/include/tandem/server_figures.hpp",
    "sdk/include/tandem/tandem.h",
    "sdk/python/tandem/figures.py",
    "sdk/web/tandem/figures.ts",
)
ROOT = pathlib.Path(__file__).resolve().parents[2]


class Fault(Exception):
    """What is wrong with an example, in a line."""


def edits(text):
    """(file, how, where, lines) of each entry of a lines.txt, in order."""
    file, entry, found = None, None, []
    for line in text.splitlines():
        if line.startswith("|"):
            entry[3].append(line[2:])
        elif match := re.match(r"(after|before|replace) (.+)", line):
            entry = (file, match[1], match[2], [])
            found.append(entry)
        elif line:
            file = line
    return found


def put(text, how, where, lines):
    """The text with the lines at the place."""
    if text.count(where) != 1:
        raise Fault(f"'{where}' is there {text.count(where)} times, once expected")
    if how == "replace":
        return text.replace(where, "\n".join(lines))
    start = text.rindex("\n", 0, text.index(where)) + 1
    at = start if how == "before" else text.index("\n", start) + 1
    return text[:at] + "".join(line + "\n" for line in lines) + text[at:]


def make(root, name, into):
    """Writes the example's files into a folder, and returns their paths."""
    example = root / "tests/architecture/examples" / name
    files = {}
    for file, how, where, lines in edits((example / "lines.txt").read_text(encoding="utf-8")):
        text = files.get(file) or (root / file).read_text(encoding="utf-8")
        try:
            files[file] = put(text, how, where, lines)
        except Fault as fault:
            raise Fault(f"{name}: {file}: {fault}") from None
    for path in example.rglob("*/*"):
        if path.is_file():
            files[str(path.relative_to(example))] = path.read_text(encoding="utf-8")
    for file, text in files.items():
        (into / file).parent.mkdir(parents=True, exist_ok=True)
        (into / file).write_text(text, encoding="utf-8")
    return files


def faults(root, name, most):
    """The faults of one example."""
    with tempfile.TemporaryDirectory() as directory:
        tree = pathlib.Path(directory)
        try:
            files = make(root, name, tree)
        except (Fault, OSError) as fault:
            yield str(fault)
            return
        sources = [file for file in files if pathlib.Path(file).suffix in SOURCES and not file.startswith("tests/")]
        if not 1 <= len(sources) <= most:
            yield f"{name}: touches {len(sources)} sources by hand, 1 to {most} expected: {' '.join(sources)}"
        for file in FIGURES:
            if file not in files:
                (tree / file).parent.mkdir(parents=True, exist_ok=True)
                (tree / file).write_bytes((root / file).read_bytes())
        agree = subprocess.run([sys.executable, "-B", root / "sdk/package/figures.py", tree], capture_output=True, text=True, check=False)
        if agree.returncode != 0:
            yield f"{name}: {agree.stdout.strip()}"


def main(arguments):
    if arguments[:1] == ["--make"] and len(arguments) == 3:
        make(ROOT, arguments[1], pathlib.Path(arguments[2]))
        return 0
    if len(arguments) > 1 or arguments[:1] and arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(arguments[0]) if arguments else ROOT
    found = [fault for name, most in EXAMPLES.items() for fault in faults(root, name, most)]
    print("\n".join(found) or f"{len(EXAMPLES)} examples")
    return 1 if found else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Fault as wrong:
        print(wrong)
        sys.exit(1)
