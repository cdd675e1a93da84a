"""idl_fields.py finds fields that changed places or are missing."""

import pathlib
import unittest

import idl_fields

ROOT = pathlib.Path(__file__).resolve().parents[2]
IDL = (ROOT / "idl/tandem.idl").read_text(encoding="utf-8")
VISITS = (ROOT / "sdk/wire/fields.hpp").read_text(encoding="utf-8")
LISTS = idl_fields.figures.Figures(ROOT)


class IdlFields(unittest.TestCase):
    def found(self, was, now):
        """The structs that differ once fields.hpp has `now` in place of `was`."""
        self.assertIn(was, VISITS)
        idl, visited = idl_fields.idl_fields(IDL), idl_fields.visited_fields(VISITS.replace(was, now), LISTS)
        return [name for name in idl if idl[name] != visited[name]]

    def test_fields_that_changed_places_are_found(self):
        self.assertEqual(self.found("m.slot, m.reuse", "m.reuse, m.slot"), ["BodyName"])

    def test_a_missing_field_is_found(self):
        self.assertEqual(self.found("  visit.text(m.codec);\n", ""), ["TandemServerStatus"])

    def test_missing_figures_are_found(self):
        self.assertEqual(self.found("  each_reported_figure(figure(visit), m);\n", ""), ["TandemClientStatus"])

    def test_the_files_as_they_are_agree(self):
        self.assertEqual(self.found("m.slot", "m.slot"), [])


if __name__ == "__main__":
    unittest.main()
