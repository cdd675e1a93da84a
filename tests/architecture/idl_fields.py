#!/usr/bin/env python3
"""Fails unless sdk/wire/fields.hpp visits each struct's fields by the names and in the order of idl/tandem.idl.

    python3 idl_fields.py [ROOT]

The structs that DDS sends are filled by that order alone. Two fields of one type that changed places in one of the files
would travel under each other's names, and no test of bytes could notice. Standard library only.
"""

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "sdk/package"))
import figures  # noqa: E402

AXES = {"[0]": "_x", "[1]": "_y", "[2]": "_z"}
OTHER_NAMES = {"StreamMessage": "SessionStream"}  # the IDL has one namespace, and Stream is taken


def idl_fields(text):
    """The names of the fields of each struct."""
    text = re.sub(r"//.*", "", text)
    return {name: re.findall(r"(\w+);", body) for name, body in re.findall(r"struct (\w+) \{(.*?)\}", text, re.DOTALL)}


def visited_fields(text, lists):
    """The same of what fields() visits."""
    structs = {}
    for message, body in re.findall(r"Is<(\w+)> M>\nvoid fields\(.*?\n(.*?)^\}", text, re.MULTILINE | re.DOTALL):
        names = structs[OTHER_NAMES.get(message, re.sub(r"(\w+)Message$", r"Tandem\1", message))] = []
        for path, axis, of in re.findall(r"\bm\.([\w.]+)(\[\d\])?|\b(each_\w+)\(", body):
            name = re.sub(r"(\w)\.id$", r"\1", path).rpartition(".")[2]  # stream.id is the stream's field
            names += lists.listed(of) if of else [name + AXES.get(axis, "")]
    return structs


def main(arguments):
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parents[2]
    idl = idl_fields((root / "idl/tandem.idl").read_text(encoding="utf-8"))
    visited = visited_fields((root / "sdk/wire/fields.hpp").read_text(encoding="utf-8"), figures.Figures(root))
    wrong = [name for name in sorted(idl.keys() | visited.keys()) if idl.get(name) != visited.get(name)]
    for name in wrong:
        print(f"{name}: idl/tandem.idl has {idl.get(name)}, fields.hpp visits {visited.get(name)}")
    return 1 if wrong or not idl else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
