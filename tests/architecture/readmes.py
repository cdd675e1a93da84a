"""Fails on a folder that holds sources and has no README.md.

    python3 readmes.py [ROOT]

Prints one line per folder. Exit 0 none, 1 some.
"""

import pathlib
import sys

SOURCES = {".cpp", ".hpp", ".c", ".h", ".py", ".proto", ".idl"}
SKIPPED = {"build", ".git", "node_modules"}


def folders_without(root):
    """Folders below `root` with sources of their own and no README.md, in path order."""
    root = pathlib.Path(root)
    files = (file for file in root.rglob("*") if file.suffix in SOURCES)
    folders = {file.parent.relative_to(root) for file in files}
    return sorted(
        folder.as_posix()
        for folder in folders
        if not SKIPPED & set(folder.parts) and not (root / folder / "README.md").is_file()
    )


def main():
    found = folders_without(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2])
    for folder in found:
        print(f"{folder}: no README.md says what it does, where to start and what it may include")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
