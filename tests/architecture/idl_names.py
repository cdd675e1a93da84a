#!/usr/bin/env python3
"""Fails if two names in an IDL file differ in case only: usage idl_names.py FILE.

To IDL they are the same name. Cyclone's compiler takes them, but other vendors' refuse the file.
"""
import collections
import re
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    text = re.sub(r"//.*", "", file.read())
spellings = collections.defaultdict(set)
for name in re.findall(r"[A-Za-z_]\w*", text):
    spellings[name.lower()].add(name)
clashes = sorted(" and ".join(sorted(names)) for names in spellings.values() if len(names) > 1)
for clash in clashes:
    print(f"{sys.argv[1]}: {clash} differ in case only")
if not spellings:
    print(f"{sys.argv[1]}: no names found")
sys.exit(1 if clashes or not spellings else 0)
