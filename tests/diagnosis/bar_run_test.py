#!/usr/bin/env python3
"""A ball bar's table on machines of the second generator, from the files that a user has to the verdict.

    bar_run_test.py VCNC
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent / "generator"))

import ball_bar

VCNC = ""
SQUARENESS_URAD = 60.0


class BarRun(unittest.TestCase):
    """Two laps each way, against the same machine's bar test with the ball set anew."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="vcnc-bar-")
        self.addCleanup(folder.cleanup)
        self.home = pathlib.Path(folder.name)

    def diagnosed(self, faults):
        ball_bar.generate(self.home, faults, seed=3, laps=2)
        command = [VCNC, "diagnose", "test.csv", "--map", "map.toml", "--model", "machine.toml", "--reference", "healthy.csv", "--out", "why"]
        run = subprocess.run(command, cwd=self.home, capture_output=True, text=True, timeout=1500)
        self.assertEqual(run.returncode, 0, run.stderr)
        return json.loads((self.home / "why" / "diagnosis.json").read_text(encoding="utf-8"))

    def test_a_machine_as_it_was(self):
        report = self.diagnosed([])
        self.assertEqual((report["verdict"], report["effects"]), ("NO DEVIATION", []))

    def test_squareness_is_named_with_its_size(self):
        report = self.diagnosed([("squareness", "geometry", {"xy_urad": SQUARENESS_URAD})])
        self.assertEqual(report["verdict"], "EXPLAINED")
        self.assertEqual([(e["name"], e["axis"]) for e in report["effects"]], [("squareness", "geometry")])
        xy = next(p for p in report["effects"][0]["parameters"] if p["key"].endswith("xy_urad"))
        self.assertAlmostEqual(xy["value"], SQUARENESS_URAD, delta=0.05 * SQUARENESS_URAD)
        self.assertLess(xy["low"], SQUARENESS_URAD)
        self.assertGreater(xy["high"], SQUARENESS_URAD)


if __name__ == "__main__":
    VCNC = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
