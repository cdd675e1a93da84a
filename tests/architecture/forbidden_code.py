"""Fails on code that compiles here but must not be there.

    python3 forbidden_code.py [ROOT]

The core must not use floating point, because its results depend on compilers and machines. Files that are compiled into
the browser's module must not use std::ranges, because WebAssembly's libc++ 14 lacks its algorithms.
Prints one line per use: file:line: reason. Exit 0 none, 1 some, 2 usage.
"""

import pathlib
import re
import sys

# Folders or files, those of them that are exempt, what is refused, and why.
RULES = [
    (["sdk/core"], [], re.compile(r"\b(?:double|float|c?math\.h)\b|<cmath>"), "the core computes with integers"),
    (["sdk/include/tandem", "sdk/core", "sdk/wire", "sdk/statistics", "sdk/client", "sdk/web/module",
      "sdk/transport/websocket/web_port.cpp", "sdk/transport/websocket/web_port.hpp"],
     ["sdk/wire/session_book.cpp", "sdk/client/api"],
     re.compile(r"\bstd::(?:ranges|views)::|<ranges>"), "WebAssembly's libc++ lacks it"),
]
# Comments and strings may mention them.
IGNORED = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def within(path, folders):
    return any(path == folder or path.startswith(folder + "/") for folder in folders)


def violations(root):
    """Every use below `root`, as "file:line: reason", in path order."""
    found = []
    root = pathlib.Path(root)
    for file in sorted((root / "sdk").rglob("*")):
        path = file.relative_to(root).as_posix()
        rules = [rule for rule in RULES if within(path, rule[0]) and not within(path, rule[1])]
        if not rules or file.suffix not in {".cpp", ".hpp", ".c", ".h"}:
            continue
        code = IGNORED.sub(lambda match: "\n" * match[0].count("\n"), file.read_text(encoding="utf-8"))
        for number, line in enumerate(code.splitlines(), 1):
            for _, _, pattern, reason in rules:
                if use := pattern.search(line):
                    found.append(f"{path}:{number}: {use[0]}: {reason}")
    return found


def main():
    if len(sys.argv) > 2:
        print(__doc__, file=sys.stderr)
        return 2
    found = violations(sys.argv[1] if len(sys.argv) == 2 else pathlib.Path(__file__).resolve().parents[2])
    print("\n".join(found) if found else "no forbidden code")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
