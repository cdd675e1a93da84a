"""Fails where the core computes with floating point, whose results depend on compilers and machines.

    python3 no_floating_point.py [ROOT]

Prints one line per use of double, float or <cmath> below sdk/core: file:line: reason. Exit 0 none, 1 some, 2 usage.
"""

import pathlib
import re
import sys

FOLDER = "sdk/core"
FLOATING = re.compile(r"\b(?:double|float|c?math\.h)\b|<cmath>")
# Comments and strings may mention them.
IGNORED = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def violations(root):
    """Every use below `root`, as "file:line: reason", in path order."""
    found = []
    root = pathlib.Path(root)
    for file in sorted((root / FOLDER).rglob("*")):
        if file.suffix not in {".cpp", ".hpp", ".c", ".h"}:
            continue
        code = IGNORED.sub(lambda match: "\n" * match[0].count("\n"), file.read_text(encoding="utf-8"))
        for number, line in enumerate(code.splitlines(), 1):
            if use := FLOATING.search(line):
                found.append(f"{file.relative_to(root).as_posix()}:{number}: {use[0]}: the core computes with integers")
    return found


def main():
    if len(sys.argv) > 2:
        print(__doc__, file=sys.stderr)
        return 2
    found = violations(sys.argv[1] if len(sys.argv) == 2 else pathlib.Path(__file__).resolve().parents[2])
    print("\n".join(found) if found else "no floating point in the core")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
