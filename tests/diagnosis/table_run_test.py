#!/usr/bin/env python3
"""Tables of what measures between table and tool, on machines of the second generator, from the files that a user has to the verdict.

    table_run_test.py VCNC
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent / "generator"))

import ball_bar
import r_test

VCNC = ""
SMALL = 0.05  # circle [m]


class Run(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="vcnc-table-")
        self.addCleanup(folder.cleanup)
        self.home = pathlib.Path(folder.name)

    def diagnosed(self):
        command = [VCNC, "diagnose", "test.csv", "--map", "map.toml", "--model", "machine.toml", "--reference", "healthy.csv", "--out", "why"]
        run = subprocess.run(command, cwd=self.home, capture_output=True, text=True, timeout=1500)
        self.assertEqual(run.returncode, 0, run.stderr)
        return json.loads((self.home / "why" / "diagnosis.json").read_text(encoding="utf-8"))

    def check_as_it_was(self, report):
        self.assertEqual((report["verdict"], report["effects"]), ("NO DEVIATION", []))

    def check_named(self, report, name, truth):
        """The only effect, of geometry, its numbers within 5 % and their intervals."""
        self.assertEqual(report["verdict"], "EXPLAINED")
        self.assertEqual([(e["name"], e["axis"]) for e in report["effects"]], [(name, "geometry")])
        effect = report["effects"][0]
        self.assertEqual(effect["separating_program"], "")  # none has a ball on the table
        self.assertEqual(bool(effect["class"]), any("at another place of the table" in note for note in report["notes"]))
        told = {p["key"].rpartition(".")[2]: p for p in effect["parameters"]}
        for key, value in truth.items():
            self.assertAlmostEqual(told[key]["value"], value, delta=0.05 * abs(value))
            self.assertLess(told[key]["low"], value)
            self.assertGreater(told[key]["high"], value)


class BallBar(Run):
    """Two laps each way, against the same machine's bar test with the ball set anew."""

    def test_a_machine_as_it_was(self):
        ball_bar.generate(self.home, [], seed=3, laps=2, radius=SMALL)
        self.check_as_it_was(self.diagnosed())

    def test_play_is_named_with_its_size_though_friction_turns_over_by_another_law(self):
        gap = 6.0
        ball_bar.generate(self.home, [("backlash", "X", {"gap_um": gap})], seed=4, laps=2, radius=SMALL)
        report = self.diagnosed()
        self.assertEqual((report["verdict"], [(e["name"], e["axis"]) for e in report["effects"]]), ("EXPLAINED", [("backlash", "X")]))
        told = report["effects"][0]["parameters"][0]
        self.assertAlmostEqual(told["value"], gap, delta=0.05 * gap)
        self.assertTrue(told["low"] < gap < told["high"], told)

    def test_squareness_is_named_with_its_size(self):
        truth = {"xy_urad": 60.0}
        ball_bar.generate(self.home, [("squareness", "geometry", truth)], seed=3, laps=2)
        self.check_named(self.diagnosed(), "squareness", truth)


class RTest(Run):
    """A ball held on the table while A and C turn, against the same machine's test with the sensor set anew."""

    def test_a_machine_as_it_was(self):
        r_test.generate(self.home, [], seed=2)
        self.check_as_it_was(self.diagnosed())

    def test_where_the_axis_of_rotation_is_is_named_with_its_size(self):
        truth = {"x_um": 12.0, "y_um": -8.0}
        r_test.generate(self.home, [("c_axis_offset", "geometry", truth)], seed=1)
        self.check_named(self.diagnosed(), "c_axis_offset", truth)


if __name__ == "__main__":
    VCNC = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
