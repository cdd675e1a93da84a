"""Fails if a line of a table in SECURITY.md names no test, or one that does not exist.

    python3 security_tests.py [ROOT]

Of each table whose last column is "test", the names in that column are looked for: Suite.Name and Suite of GoogleTest,
functions of scripts, names and scenarios in CMake files, and files. Prints one line per finding. Exit 0 none, 1 some.
"""

import pathlib
import re
import sys

FILES = {".cpp", ".py", ".mjs", ".txt"}


def rows(page):
    """The first and the last cell of each row of a table whose last column is "test"."""
    tested = False
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            tested = False
        elif cells[-1] == "test":
            tested = True
        elif tested and set(cells[-1]) != {"-"}:
            yield cells[0], cells[-1]


def exists(name, texts, files):
    if name in files:
        return True
    suite, _, test = name.rpartition(".")
    patterns = (
        rf"TEST(_F|_P)?\(\s*{suite or '[A-Za-z0-9_]+'}\s*,\s*{test}\s*\)",
        rf"TEST(_F|_P)?\(\s*{name}\s*,",
        rf"^(def|const|async function) {name}\b",
        rf"add_test\(NAME [^)]*\b{name}\b|tandem_test\({name}\b|foreach\(\w+ [^)]*\b{name}\b",
    )
    return any(re.search(pattern, text, re.MULTILINE) for text in texts for pattern in patterns)


def findings(root):
    sources = [path for path in sorted((root / "tests").rglob("*")) if path.suffix in FILES]
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in sources]
    files = {path.name for path in sources} | {path.relative_to(root).as_posix() for path in root.glob("tests/*")}
    known = {}
    for what, cell in rows((root / "SECURITY.md").read_text(encoding="utf-8")):
        names = re.findall(r"`([\w./]+)`", cell)
        if not names:
            yield f"SECURITY.md: {what}: names no test"
        for name in names:
            if name not in known:
                known[name] = exists(name, texts, files)
            if not known[name]:
                yield f"SECURITY.md: {what}: there is no test {name}"


def main():
    found = list(findings(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
    print("\n".join(found) or "every line names a test that exists")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
