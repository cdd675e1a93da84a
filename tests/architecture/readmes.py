"""Fails on a folder with sources that no README.md describes.

    python3 readmes.py [ROOT]

A folder with more than LARGE sources of its own needs a README.md. A smaller one may share that of a folder above it, up to its
wing (a folder two deep). Prints one line per folder. Exit 0 none, 1 some.
"""

import pathlib
import sys

SOURCES = {".cpp", ".hpp", ".c", ".h", ".py", ".proto", ".idl"}
SKIPPED = {"build", ".git", "node_modules"}
LARGE = 8
WING_DEPTH = 2


def described(root, folder, sources):
    """Whether a README.md says what `folder`, which has so many sources, is for."""
    here = [folder]
    if sources <= LARGE:
        here += [above for above in folder.parents if len(above.parts) >= WING_DEPTH]
    return any((root / place / "README.md").is_file() for place in here)


def folders_without(root):
    """Folders below `root` with sources of their own and no README.md that describes them, in path order."""
    root = pathlib.Path(root)
    sources = {}
    for file in root.rglob("*"):
        folder = file.parent.relative_to(root)
        if file.suffix in SOURCES and not SKIPPED & set(folder.parts):
            sources[folder] = sources.get(folder, 0) + 1
    return sorted(folder.as_posix() for folder, count in sources.items() if not described(root, folder, count))


def main():
    found = folders_without(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2])
    for folder in found:
        print(f"{folder}: no README.md here or in its wing says what it does and where to start")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
