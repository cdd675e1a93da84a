"""Fails on a folder with more than 25 sources, and on folders whose includes run in a circle.

    python3 rooms.py [--count] [ROOT]

If a folder includes another one that includes it, directly or through others, the folders are not separate
parts. Prints one line per finding. Exit 0 none, 1 some.

--count prints instead how wide `services` is: its wings (the folders directly in it), arrows (one wing includes another), floors
(the longest chain of arrows), and the arrows that run up, because they are a part of a circle.
"""

import collections
import os
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*"((?:sdk|services)/[^"]+)"', re.MULTILINE)
SOURCES = {".cpp", ".hpp", ".c", ".h", ".py", ".ts"}
SKIPPED = {"build", ".git", "node_modules"}
MOST = 25


def sources(root):
    for place, folders, files in os.walk(root):
        # Not looked into: a build that runs meanwhile takes folders away.
        folders[:] = sorted(name for name in folders if name not in SKIPPED and not name.startswith("build-"))
        for name in sorted(files):
            file = pathlib.Path(place, name)
            if file.suffix in SOURCES:
                yield file, file.relative_to(root)


def full_folders(root):
    counts = collections.Counter(path.parent.as_posix() for _, path in sources(root) if path.name != "__init__.py")
    return [f"{folder}: {count} sources, at most {MOST}" for folder, count in sorted(counts.items()) if count > MOST]


def edges(root):
    """Folder to the folders that it includes, each with one line that does."""
    found = collections.defaultdict(dict)
    for file, path in sources(root):
        if path.parts[0] == "tests":
            continue
        folder = path.parent.as_posix()
        for target in INCLUDE.findall(file.read_text(encoding="utf-8", errors="replace")):
            to = pathlib.PurePosixPath(target).parent.as_posix()
            if to != folder:
                found[folder].setdefault(to, f"{path.as_posix()} includes {target}")
    return found


def count(root):
    """The wings of `services`, their arrows, floors and arrows that run up, in one line."""
    graph = collections.defaultdict(set)
    for folder, targets in edges(root).items():
        for to in targets:
            ends = [pathlib.PurePosixPath(place).parts[:2] for place in (folder, to)]
            if all(end[0] == "services" for end in ends) and ends[0] != ends[1]:
                graph[ends[0]].add(ends[1])
    rank = {}

    def floor(wing, above=()):
        if wing in above:
            return 0
        if wing not in rank:
            rank[wing] = 1 + max((floor(to, (*above, wing)) for to in sorted(graph[wing])), default=0)
        return rank[wing]

    wings = sorted({path.parts[:2] for _, path in sources(root) if path.parts[0] == "services" and len(path.parts) > 2})
    floors = max(map(floor, wings))
    up = sum(rank[to] >= rank[wing] for wing in wings for to in graph[wing])
    return f"wings of services: {len(wings)}, arrows: {sum(map(len, graph.values()))}, floors: {floors}, arrows up: {up}"


def circles(root):
    """One line for each include that leads back to where it came from."""
    graph = edges(root)
    reached = {}

    def below(folder):
        if folder not in reached:
            reached[folder] = set()  # while it is being filled
            pending = list(graph.get(folder, ()))
            while pending:
                to = pending.pop()
                if to not in reached[folder]:
                    reached[folder].add(to)
                    pending.extend(graph.get(to, ()))
        return reached[folder]

    return [
        f"{line}, and {to} includes {folder}"
        for folder in sorted(graph)
        for to, line in sorted(graph[folder].items())
        if folder in below(to)
    ]


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--count"]
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parents[2]
    if "--count" in sys.argv:
        print(count(root))
        return 0
    found = full_folders(root) + circles(root)
    print("\n".join(found) if found else "no folder is too full, no include runs up")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
