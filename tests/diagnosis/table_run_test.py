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


class Runs(unittest.TestCase):
    """Tests of one machine, whose runs are simulated together."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="vcnc-table-")
        cls.addClassCleanup(folder.cleanup)
        cls.home = pathlib.Path(folder.name)

    def diagnosed(self, test):
        command = [VCNC, "diagnose", f"{test}.csv", "--map", "map.toml", "--model", "machine.toml", "--reference", "healthy.csv",
                   "--out", f"why_{test}"]
        run = subprocess.run(command, cwd=self.home, capture_output=True, text=True, timeout=1500)
        self.assertEqual(run.returncode, 0, run.stderr)
        return json.loads((self.home / f"why_{test}" / "diagnosis.json").read_text(encoding="utf-8"))

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


class BallBar(Runs):
    """Two laps each way, against the same machine's bar test with the ball set anew."""

    GAP_UM = 6.0
    OUT_OF_SQUARE = {"xy_urad": 60.0}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        ball_bar.generate(cls.home, {"as_it_was": [], "play": [("backlash", "X", {"gap_um": cls.GAP_UM})],
                                     "out_of_square": [("squareness", "geometry", cls.OUT_OF_SQUARE)]}, seed=4, laps=2, radius=SMALL)

    def test_a_machine_as_it_was(self):
        self.check_as_it_was(self.diagnosed("as_it_was"))

    def test_play_is_named_with_its_size_though_friction_turns_over_by_another_law(self):
        report = self.diagnosed("play")
        self.assertEqual((report["verdict"], [(e["name"], e["axis"]) for e in report["effects"]]), ("EXPLAINED", [("backlash", "X")]))
        told = report["effects"][0]["parameters"][0]
        self.assertAlmostEqual(told["value"], self.GAP_UM, delta=0.05 * self.GAP_UM)
        self.assertTrue(told["low"] < self.GAP_UM < told["high"], told)

    def test_squareness_is_named_with_its_size(self):
        self.check_named(self.diagnosed("out_of_square"), "squareness", self.OUT_OF_SQUARE)


class RTest(Runs):
    """A ball held on the table while A and C turn, against the same machine's test with the sensor set anew."""

    OFFSET = {"x_um": 12.0, "y_um": -8.0}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        r_test.generate(cls.home, {"as_it_was": [], "off_centre": [("c_axis_offset", "geometry", cls.OFFSET)]}, seed=1)

    def test_a_machine_as_it_was(self):
        self.check_as_it_was(self.diagnosed("as_it_was"))

    def test_where_the_axis_of_rotation_is_is_named_with_its_size(self):
        self.check_named(self.diagnosed("off_centre"), "c_axis_offset", self.OFFSET)


if __name__ == "__main__":
    VCNC = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
