#!/usr/bin/env python3
"""Writes what Python and TypeScript know of the figures in sdk/include/tandem/*_figures.hpp, or checks that all agree.

    python3 figures.py [--check] [ROOT]

Writes sdk/python/tandem/figures.py and sdk/web/tandem/figures.ts. With --check it writes nothing and prints one line
for each place that does not agree with the structs: the lists behind them, tandem_status in tandem.h, the status
messages in idl/tandem.idl, and these two files. Exit 0 all agree, 1 not, 2 usage. Standard library only.
"""

import pathlib
import re
import sys

HEADERS = ("sdk/include/tandem/client_figures.hpp", "sdk/include/tandem/server_figures.hpp")
# The struct whose figures a list visits.
LISTS = {
    "each_reported_figure": "ReportedFigures",
    "each_client_figure": "ClientFigures",
    "each_server_count": "ServerCounts",
    "each_server_figure": "ServerFigures",
}
# The figures of each IDL struct. They stand there in this order, without others in between.
MESSAGES = {"TandemClientStatus": "ReportedFigures", "TandemServerStatus": "ServerFigures"}
IDL_TYPES = {"double": "double", "std::uint32_t": "uint32", "std::uint64_t": "uint64"}
C_TYPES = {"double": "double", "std::uint32_t": "uint32_t", "std::uint64_t": "uint64_t"}
PYTHON_TYPES = {"double": "float", "std::uint32_t": "int", "std::uint64_t": "int"}
# The structs that the bindings have.
BOUND = ("ClientFigures", "ServerFigures")


class Figures:
    """The structs of the headers and the lists behind them."""

    def __init__(self, root):
        text = "".join((root / header).read_text(encoding="utf-8") for header in HEADERS)
        self.own, self.bases, self.texts = {}, {}, {}
        for name, base, body in re.findall(r"^struct (\w+)(?: : (\w+))? \{\n(.*?)^\};", text, re.MULTILINE | re.DOTALL):
            self.own[name] = re.findall(r"^  ([\w:]+) (\w+) = 0;(?: +///< (.*))?$", body, re.MULTILINE)
            self.bases[name] = base
            # A line of another form would be skipped silently.
            strange = [line for line in body.splitlines() if line and "operator" not in line and not re.match(r"  [\w:]+ \w+ = 0;(?: +///< |$)", line)]
            self.texts[name] = strange
        self.lists = {}
        for name, body in re.findall(r"constexpr void (\w+)\(.*?\) \{\n(.*?)^\}", text, re.MULTILINE | re.DOTALL):
            self.lists[name] = body

    def of(self, struct):
        """(type, name, text) of all figures of a struct, those of its base first."""
        base = self.bases[struct]
        return (self.of(base) if base else []) + self.own[struct]

    def listed(self, name):
        """The figures that a list visits, in order."""
        visited = []
        for said, visits, base in re.findall(r'visit\("(\w+)", of\.(\w+)\.\.\.\)|(each_\w+)\(visit, of\.\.\.\)', self.lists[name]):
            if base:
                visited += self.listed(base)
            else:
                visited.append(said if said == visits else f"{said} for {visits}")
        return visited


def differences(root, figures):
    """Yields one line for each place in the sources that does not agree with the structs."""
    for struct, lines in figures.texts.items():
        for line in lines:
            yield f"{struct}: a figure a line, `type name = 0;  ///< text`, instead of: {line.strip()}"
    for name, struct in LISTS.items():
        want, have = [figure for _, figure, _ in figures.of(struct)], figures.listed(name)
        for figure in want + have:
            if want.count(figure) != have.count(figure):
                yield f"{name}() and {struct} differ: {figure} needs a line in both"
    idl = (root / "idl/tandem.idl").read_text(encoding="utf-8")
    for message, struct in MESSAGES.items():
        types = {name: IDL_TYPES[kind] for kind, name, _ in figures.of(struct)}
        want = [(types.get(name), name) for name in figures.listed(next(key for key, value in LISTS.items() if value == struct))]
        body = re.search(rf"struct {message} \{{(.*?)\}}", idl, re.DOTALL)[1]
        have = re.findall(r"^\s*(\w+) (\w+);", body, re.MULTILINE)
        first = have.index(want[0]) if want[0] in have else 0
        for index, figure in enumerate(want):
            if have[first + index : first + index + 1] != [figure]:
                yield f"idl/tandem.idl: {message} has no `{figure[0]} {figure[1]};` where the list in {struct}'s header has it"
                break
    header = (root / "sdk/include/tandem/tandem.h").read_text(encoding="utf-8")
    body = re.search(r"typedef struct tandem_status \{(.*?)\} tandem_status;", header, re.DOTALL)[1]
    have = dict((name, kind) for kind, name in re.findall(r"^\s*(\w+) (\w+);", body, re.MULTILINE))
    for kind, name, _ in figures.of("ClientFigures"):
        if have.get(name) != C_TYPES[kind]:
            yield f"sdk/include/tandem/tandem.h: tandem_status has no `{C_TYPES[kind]} {name};`: add it at its end, and to its INIT"


def python(figures):
    lines = ['"""Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py."""', "", "from dataclasses import dataclass", ""]
    lines += ["", "@dataclass(frozen=True)", "class ClientFigures:", '    """The figures of a client since it was made. Times are in milliseconds. Percentiles are over all frames."""', ""]
    lines += [f"    {name}: {PYTHON_TYPES[kind]}" + (f"  #: {text}" if text else "") for kind, name, text in figures.of("ClientFigures")]
    return "\n".join(lines) + "\n"


def typescript(figures):
    lines = ["// Figures, as sdk/include/tandem/*_figures.hpp has them. Written by sdk/package/figures.py."]
    for struct, of in zip(BOUND, ("The figures of a client since it was made. Times are in milliseconds", "The figures of a server. Rates and durations are of the last second")):
        lines += ["", f"/** {of}. */", f"export interface {struct} {{"]
        for _, name, text in figures.of(struct):
            lines += [f"  /** {text[0].upper()}{text[1:]}. */"] if text else []
            lines.append("  " + re.sub(r"_(\w)", lambda match: match[1].upper(), name) + ": number;")
        lines.append("}")
    return "\n".join(lines) + "\n"


def main(arguments):
    check = arguments[:1] == ["--check"]
    rest = arguments[check:]
    if len(rest) > 1:
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(rest[0]) if rest else pathlib.Path(__file__).resolve().parents[2]
    figures = Figures(root)
    wrong = list(differences(root, figures))
    for path, text in (("sdk/python/tandem/figures.py", python(figures)), ("sdk/web/tandem/figures.ts", typescript(figures))):
        file = root / path
        if check and (not file.is_file() or file.read_text(encoding="utf-8") != text):
            wrong.append(f"{path} is not what the structs say: run sdk/package/figures.py")
        elif not check:
            file.write_text(text, encoding="utf-8")
    print("\n".join(wrong) if wrong else "the figures agree everywhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
