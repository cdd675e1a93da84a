"""Shows that include_edges.py sees wrong edges, each planted in a temporary tree."""

import pathlib
import tempfile
import unittest

import include_edges


class IncludeEdges(unittest.TestCase):
    def found(self, *files):
        """Violations of a tree that holds the given (path, text) files besides a few correct ones."""
        with tempfile.TemporaryDirectory() as root:
            base = {
                "sdk/include/tandem/result.hpp": "",
                "sdk/core/lattice/state.hpp": '#include <vector>\n#include "tandem/result.hpp"\n',
                "sdk/core/predict/predictor.hpp": '#include "sdk/core/lattice/state.hpp"\n',
                "sdk/wire/port.hpp": '#include "sdk/core/lattice/state.hpp"\n',
                "sdk/include/tandem/simulation.hpp": "#include <span>\n",
                "services/engines/particles/particles.cpp": '#include "tandem/simulation.hpp"\n',
            }
            for path, text in {**base, **dict(files)}.items():
                file = pathlib.Path(root) / path
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            return include_edges.violations(root)

    def assert_one(self, path, include, reason):
        found = self.found((path, f"// line 1\n#include {include}\n"))
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(f"{path}:2: "), found)
        self.assertIn(reason, found[0])

    def test_a_correct_tree_has_none(self):
        self.assertEqual(self.found(), [])

    def test_the_lattice_may_not_include_the_predictor(self):
        self.assert_one("sdk/core/lattice/a.cpp", '"sdk/core/predict/predictor.hpp"', "may not include")

    def test_the_codec_may_not_include_the_predictor(self):
        self.assert_one("sdk/core/codec/a.cpp", '"sdk/core/predict/predictor.hpp"', "may not include")

    def test_the_layout_stands_on_the_lattice_alone(self):
        codec = ("sdk/core/codec/codec.hpp", '#include "sdk/core/layout/layout.hpp"\n')
        layout = ("sdk/core/layout/layout.hpp", '#include "sdk/core/lattice/state.hpp"\n')
        self.assertEqual(self.found(codec, layout), [])
        found = self.found(codec, layout, ("sdk/core/layout/a.cpp", '#include "sdk/core/codec/codec.hpp"\n'))
        self.assertEqual(len(found), 1, found)
        self.assertIn("may not include", found[0])

    def test_the_host_sees_no_scene_and_no_engine(self):
        for header in ("services/engines/scenes/scene.hpp", "services/engines/common/world.hpp"):
            found = self.found((header, ""), ("services/host/a.cpp", f'#include "{header}"\n'))
            self.assertEqual(len(found), 1, found)
            self.assertIn("may not include", found[0])

    def test_the_core_may_not_include_the_transport(self):
        self.assert_one("sdk/core/timeline/a.hpp", '"sdk/wire/port.hpp"', "may not include")

    def test_the_core_may_not_know_clocks_threads_or_files(self):
        for header in ("<chrono>", "<thread>", "<fstream>", "<sys/stat.h>"):
            self.assert_one("sdk/core/codec/a.cpp", header, "the core knows no")

    def test_only_the_dds_room_sees_dds_headers(self):
        self.assert_one("sdk/wire/a.cpp", '"dds/dds.h"', "DDS headers belong to")
        self.assert_one("services/host/a.cpp", "<dds/dds.h>", "DDS headers belong to")
        self.assertEqual(self.found(("sdk/transport/dds/a.cpp", '#include "dds/dds.h"\n')), [])

    def test_the_sdk_may_not_see_protobuf(self):
        self.assert_one("sdk/client/a.cpp", '"scene.pb.h"', "protobuf headers belong to")
        self.assert_one("sdk/transport/dds/a.cpp", "<google/protobuf/message.h>", "protobuf headers belong to")

    def test_the_core_may_not_see_eigen(self):
        self.assert_one("sdk/core/lattice/a.cpp", "<Eigen/Core>", "Eigen headers belong to")

    def test_an_engine_sees_only_the_simulation_interface(self):
        self.assert_one("services/engines/particles/a.cpp", '"sdk/core/lattice/state.hpp"', "may not include")
        self.assert_one("services/engines/particles/a.cpp", '"services/host/host.hpp"', "neither a path")

    def test_public_headers_include_only_public_headers(self):
        self.assert_one("sdk/include/tandem/client.hpp", '"sdk/core/lattice/state.hpp"', "may not include")

    def test_an_example_sees_only_public_headers(self):
        self.assert_one("sdk/examples/hello/main.cpp", '"sdk/wire/port.hpp"', "may not include")

    def test_a_relative_include_is_refused(self):
        self.assert_one("sdk/core/lattice/a.cpp", '"state.hpp"', "neither a path from the root")

    def test_tests_may_include_their_neighbours(self):
        files = ("tests/unit/a/a.cpp", '#include "fake.hpp"\n'), ("tests/unit/a/fake.hpp", "")
        self.assertEqual(self.found(*files), [])

    def test_a_folder_without_a_rule_is_refused(self):
        found = self.found(("sdk/novelty/a.cpp", ""))
        self.assertEqual(len(found), 1)
        self.assertIn("no rule", found[0])


if __name__ == "__main__":
    unittest.main()
