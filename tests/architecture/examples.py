"""Fails where an example patch of CONTRIBUTING.md does not apply any more, or touches more sources than it may.

    python3 examples.py [ROOT]

The patches are in tests/architecture/examples. Each is tried on a copy of the files that it touches, and the figures
(sdk/package/figures.py) have to agree there afterwards. Prints one line per fault. Exit 0 none, 1 some, 77 no git.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# How many sources each may touch by hand.
EXAMPLES = {
    "new_client_figure.patch": 3,
    "new_server_figure.patch": 4,
    "new_predictor.patch": 4,
    "new_stream_option.patch": 3,
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


def touched(patch):
    """The files that a patch changes or adds."""
    return re.findall(r"^\+\+\+ b/(\S+)", patch, re.MULTILINE)


def by_hand(root, path):
    """True for a source that people write: not a test, a text or a file that a script writes."""
    file = root / path
    if path.startswith("tests/") or file.suffix not in SOURCES:
        return False
    return not file.is_file() or "Written by sdk/package/figures.py" not in file.read_text(encoding="utf-8").split("\n", 1)[0]


def faults(root, name, most):
    """The faults of one example."""
    path = root / "tests/architecture/examples" / name
    if not path.is_file():
        yield f"{name}: missing; CONTRIBUTING.md names it"
        return
    files = touched(path.read_text(encoding="utf-8"))
    sources = [file for file in files if by_hand(root, file)]
    if not sources or len(sources) > most:
        yield f"{name}: touches {len(sources)} sources by hand, 1 to {most} expected: {' '.join(sources)}"
    with tempfile.TemporaryDirectory() as directory:
        tree = pathlib.Path(directory)
        for file in {*files, *FIGURES}:
            if (root / file).is_file():
                (tree / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(root / file, tree / file)
        applied = subprocess.run(["git", "apply", path.resolve()], cwd=tree, capture_output=True, text=True, check=False)
        if applied.returncode != 0:
            yield f"{name}: does not apply; make it anew on this tree: {applied.stderr.strip()}"
            return
        agree = subprocess.run(
            [sys.executable, "-B", root / "sdk/package/figures.py", "--check", tree], capture_output=True, text=True, check=False
        )
        if agree.returncode != 0:
            yield f"{name}: {agree.stdout.strip()}"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2])
    if shutil.which("git") is None:
        print("no git, which applies the patches")
        return 77
    found = [fault for name, most in EXAMPLES.items() for fault in faults(root, name, most)]
    stray = {file.name for file in (root / "tests/architecture/examples").glob("*.patch")} - set(EXAMPLES)
    found += [f"{name}: has no number of files in examples.py" for name in sorted(stray)]
    print("\n".join(found) if found else "the example patches apply")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
