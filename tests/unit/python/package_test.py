#!/usr/bin/env python3
"""The Python package beside the header that it stands on.    package_test.py SOURCE_TREE"""

import dataclasses
import inspect
import pathlib
import re
import struct
import sys
import unittest

import tandem
from tandem import session

ROOT = pathlib.Path(sys.argv.pop(1))
HEADER = (ROOT / "sdk/include/tandem/tandem.h").read_text(encoding="utf-8")
HEADER_CODE = re.sub(r"/\*.*?\*/", "", HEADER, flags=re.DOTALL)


def constants(prefix):
    """{name: value} of the header's constants of that prefix, without it."""
    return {name: int(value) for name, value in re.findall(rf"\bTANDEM_{prefix}([A-Z_]+) = (\d+)", HEADER_CODE)}


def members(struct):
    """The members of a struct of the header."""
    body = re.search(rf"struct {struct} \{{(.*?)\}}", HEADER_CODE, re.DOTALL)[1]
    return {re.sub(r"\[.*", "", line.split()[-1]) for line in body.split(";") if line.strip()}


class Header(unittest.TestCase):
    def test_constants_are_those_of_the_header(self):
        for prefix, kind in (("EVENT_", tandem.EventKind), ("CHANGE_", tandem.Change), ("SHAPE_", tandem.Shape), ("LOG_", tandem.LogLevel)):
            self.assertEqual({member.name: member.value for member in kind}, constants(prefix), kind)
        everything = constants("")
        for kind in (tandem.Result, tandem.Role, tandem.Phase, tandem.SampleMode):
            for member in kind:
                self.assertEqual(everything.get(member.name), member.value, member)
        results = re.search(r"enum \{\s*TANDEM_OK.*?\}", HEADER_CODE, re.DOTALL)[0]
        self.assertEqual(results.count("="), len(tandem.Result), "the header has other results")

    def test_structs_have_the_members_of_the_header(self):
        for kind, struct, left_out, added in (
            (tandem.Status, "tandem_status", {"size"}, set()),
            (tandem.Event, "tandem_event", {"size"}, set()),
            (tandem.SessionInfo, "tandem_session_info", {"size", "reserved", "reserved2"}, set()),
            (tandem.Solid, "tandem_solid", {"size"}, set()),
            (tandem.BodyType, "tandem_body_type", {"size", "value_count"}, set()),
            (tandem.Scene, "tandem_scene", {"size", "type_count", "solid_count", "low", "high", "reserved"}, {"bounds"}),
        ):
            fields = {field.name for field in dataclasses.fields(kind)}
            self.assertEqual(fields, (members(struct) - left_out) | added, kind)

    def test_the_version_is_that_of_the_header(self):
        parts = (re.search(rf"TANDEM_VERSION_{part} (\d+)", HEADER)[1] for part in ("MAJOR", "MINOR", "PATCH"))
        self.assertEqual(tandem.__version__, ".".join(parts))


class Data(unittest.TestCase):
    def test_data_of_bodies_are_a_structured_array(self):
        class Connection:
            data_fields = staticmethod(lambda: [("health", 0), ("heat", 6), ("colour", 7), ("score", 3)])
            data = staticmethod(lambda: struct.pack("<Bf4Bh", 9, -1.5, 1, 2, 3, 4, -7) + bytes(11))

        client = tandem.Client.__new__(tandem.Client)
        client._connection = Connection()
        data = client.data()
        self.assertEqual((len(data), data["health"][0], data["heat"][0], data["score"][0]), (2, 9, -1.5, -7))
        self.assertEqual(data["colour"].tolist(), [[1, 2, 3, 4], [0, 0, 0, 0]])
        Connection.data = staticmethod(lambda: None)
        self.assertIsNone(client.data())


class Package(unittest.TestCase):
    def test_everything_public_has_a_text(self):
        for name in tandem.__all__:
            thing = getattr(tandem, name)
            if isinstance(thing, type) and issubclass(thing, session.enum.Enum) and name in ("Role", "Phase", "LogLevel"):
                continue  # their members say it
            self.assertTrue(inspect.getdoc(thing), name)
            if inspect.isclass(thing) and not issubclass(thing, session.enum.Enum):
                for attribute, what in vars(thing).items():
                    if inspect.isfunction(what) and not attribute.startswith("_"):
                        self.assertTrue(what.__doc__, f"{name}.{attribute}")

    def test_an_error_names_its_code(self):
        error = tandem.Error(7, "nobody came")
        self.assertEqual((error.code, str(error)), (tandem.Result.TIMEOUT, "nobody came (TIMEOUT)"))
        self.assertEqual(str(tandem.Error(1000)), "result 1000")

    def test_columns_that_do_not_exist_are_refused(self):
        with self.assertRaises(ValueError):
            tandem.Sample(["places"])
        with self.assertRaises(ValueError):
            tandem.State(["changes"])

    def test_what_would_be_taken_for_something_else_is_refused(self):
        for arrays in ([1], "positions", None, tandem.State()):
            with self.assertRaises(TypeError):
                tandem.Sample.into(arrays)
        with self.assertRaises(tandem.Error) as raised:
            tandem.Client("default\0x")
        self.assertEqual(raised.exception.code, tandem.Result.INVALID_ARGUMENT)


if __name__ == "__main__":
    unittest.main()
