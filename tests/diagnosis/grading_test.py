#!/usr/bin/env python3
"""The grader against reports whose grade is plain."""

import math
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import grading

TRUTH = {"kind": "single", "number": 3, "effects": [{"name": "backlash", "place": "X", "parameters": {"gap_um": 4.0}}],
         "values": {"effects.X.backlash.gap_um": 4.0}}


def report(*effects, verdict="EXPLAINED", left=(9.0, 1.0, 1.0), **more):
    return {"verdict": verdict, "effects": list(effects), "laws": [], "chi2_held_out": dict(zip(("before", "after", "noise"), left)), **more}


def found(name, axis, key="", value=0.0, low=0.0, high=0.0, **more):
    return {"name": name, "axis": axis, "parameters": [{"key": key, "value": value, "low": low, "high": high}] if key else [], **more}


class Grading(unittest.TestCase):
    def test_right_name_and_place(self):
        limit = [{"name": "X.backlash", "detection_limit": 0.5, "excited": True}]
        row = grading.grade(TRUTH, report(found("backlash", "X", "effects.X.backlash.gap_um", 4.1, 3.9, 4.2), excitation=limit), 1)
        self.assertTrue(row["top"] and row["exact"])
        self.assertEqual(row["strength"], 8)
        self.assertAlmostEqual(row["errors"][0], 0.025)
        self.assertEqual(row["covered"], [True])

    def test_wrong_axis_is_wrong(self):
        row = grading.grade(TRUTH, report(found("backlash", "Y")), 1)
        self.assertFalse(row["top"] or row["exact"])

    def test_a_second_claim_spoils_the_set_a_minor_one_as_well(self):
        two = grading.grade(TRUTH, report(found("backlash", "X"), found("kv_error", "X")), 1)
        self.assertTrue(two["top"] and not two["exact"])
        minor = grading.grade(TRUTH, report(found("backlash", "X"), found("kv_error", "X", minor=True)), 1)
        self.assertTrue(minor["top"] and not minor["exact"])

    def test_a_second_effect_is_weak_where_the_first_one_hides_it(self):
        truth = {"kind": "pair", "effects": [
            {"name": "backlash", "place": "X", "parameters": {"gap_um": 4.0}}, {"name": "scale_error", "place": "Y", "parameters": {"error_ppm": 9.0}}]}
        limits = [{"name": "X.backlash", "detection_limit": 0.5, "detection_limit_beside_found": 0.5},
                  {"name": "Y.scale_error", "detection_limit": 1.0, "detection_limit_beside_found": 5.0}]
        true, false = found("backlash", "X"), found("squareness", "geometry")
        hidden = grading.grade(truth, report(true, excitation=limits), 1)
        self.assertEqual((hidden["strength"], hidden["strength_beside"]), (8, 1.8))
        # What hides it must be there.
        self.assertEqual(grading.grade(truth, report(true, false, excitation=limits), 1)["strength_beside"], 8)
        of = grading.summary([hidden, hidden | {"strength_beside": 3.0, "exact": True}])
        self.assertEqual(of["pair: exact set, each effect strong"], "1/2 (50.0 %)")
        self.assertEqual(of["pair: exact set, each effect strong beside the others"], "1/1 (100.0 %)")

    def test_a_latency_of_the_bus_has_the_limit_of_a_delay(self):
        truth = {"kind": "single", "effects": [{"name": "bus_latency", "place": "X", "parameters": {"delay_ms": 1.0}}]}
        row = grading.grade(truth, report(excitation=[{"name": "X.command_delay", "detection_limit": 0.25}]), 1)
        self.assertEqual(row["strength"], 4)

    def test_another_piece_is_held_against_what_noise_leaves(self):
        limit = [{"name": "X.backlash", "detection_limit": 0.5, "excited": True}]
        right = report(found("backlash", "X", "effects.X.backlash.gap_um", 4.0, 3.9, 4.1), excitation=limit)
        single = [grading.grade(TRUTH, right, 1) | {"transfer_um": um} for um in ([2.0, 0.02], [0.1, 0.05])]
        clean = grading.grade({"kind": "clean", "effects": []}, report(verdict="NO DEVIATION"), 1) | {"transfer_um": [0.04, 0.02]}
        of = "circles to S piece"
        told = grading.summary([*single, clean])
        self.assertEqual(told[f"{of}, clean machines: left, median / most"], "20 / 20 nm (n = 1)")
        self.assertEqual(told[f"{of}: left, median / p95"], "35 / 50 nm (n = 2)")
        self.assertEqual(told[f"{of}: left of the declared model's, median / p95"], "25.5 % / 50 % (n = 2)")
        self.assertEqual(told[f"{of}: left of the declared model's, where that is over 200 nm, median / p95"], "1.0 % / 1 % (n = 1)")

    def test_what_is_left_is_held_against_who_knows_the_effects(self):
        def held_out(x, y):
            return [{"signal": s, "run": "held-out laps", "rms_after": rms, "rms_floor": 1.0} for s, rms in (("x", x), ("y", y))]

        limit = [{"name": "X.backlash", "detection_limit": 0.5, "excited": True}]
        told = found("backlash", "X", "effects.X.backlash.gap_um", 4.0, 3.9, 4.1)
        row = grading.grade(TRUTH, report(told, excitation=limit, left=(9e6, 1.21e6, 1e6), figures=held_out(1.1, 1.0)), 1)
        row["oracle"] = grading.left_of(report(left=(9e6, 1e6, 1e6), figures=held_out(1.0, 1.25)))
        of = "held-out RMS / oracle's"
        self.assertEqual(grading.summary([row])[f"{of}, all signals, median / p95"], "1.1000 / 1.1000 (n = 1)")
        self.assertEqual(grading.summary([row])[f"{of}, worst signal, median / p95"], "1.1000 / 1.1000 (n = 1)")

    def test_what_the_record_cannot_tell_apart_is_no_mistake(self):
        def left_out(verdict, after):
            answer = TRUTH | {"kind": "without", "without": "backlash", "law_axes": ["X"], "law_points": []}
            row = grading.grade(answer, report(found("kv_error", "X"), verdict=verdict, left=(9e6, after, 1e6)), 1)
            return row | {"oracle": grading.left_of(report(left=(9e6, 1e6, 1e6)))}

        rows = [left_out("PARTLY", 1.0e6), left_out("EXPLAINED", 1.0005e6), left_out("EXPLAINED", 1.002e6)]
        told = grading.summary(rows)
        self.assertEqual(told["left out of the library: not explained away"], "1/3 (33.3 %)")
        key = "left out of the library: not explained away, where the record tells it from what stands in"
        self.assertEqual(told[key], "1/2 (50.0 %)")

    def test_suspects_are_called_as_the_diagnosis_does(self):
        def of(name, place):
            return grading.suspect({"name": name, "place": place})

        self.assertEqual(of("backlash", "X"), "X.backlash")
        self.assertEqual(of("bus_latency", "C"), "C.command_delay")
        self.assertEqual((of("load_mass", "A"), of("load_mass", "Y")), ("axes.A.load_kgm2", "axes.Y.load_kg"))

    def test_a_wave_half_a_turn_on_is_the_same(self):
        key = "effects.probe.tip_lobing."
        truth = {"kind": "single", "effects": [{"name": "tip_lobing", "place": "probe", "parameters": {"amplitude_um": -2.0, "phase_deg": 10.0}}],
                 "values": {key + "amplitude_um": -2.0, key + "phase_deg": 10.0}}
        told = found("tip_lobing", "probe", key + "amplitude_um", 2.02, 1.9, 2.1)
        told["parameters"].append({"key": key + "phase_deg", "value": -170.0, "low": -172, "high": -168})
        row = grading.grade(truth, report(told), 1)
        self.assertAlmostEqual(row["errors"][0], 0.01)
        self.assertEqual(row["covered"], [True])

    def test_a_weight_on_the_other_side_that_pulls_the_other_way_is_the_same(self):
        key = "effects.A.weight_imbalance."
        truth = {"kind": "single", "effects": [{"name": "weight_imbalance", "place": "A", "parameters": {"torque_Nm": -20.0}}],
                 "values": {key + "torque_Nm": -20.0, key + "angle_deg": 0.0}}
        told = found("weight_imbalance", "A", key + "torque_Nm", 20.2, 19.9, 20.3)
        told["parameters"].append({"key": key + "angle_deg", "value": 180.0, "low": 179, "high": 181})
        row = grading.grade(truth, report(told), 1)
        self.assertAlmostEqual(row["errors"][0], 0.01)
        self.assertEqual(row["covered"], [True])

    def test_both_waves_of_a_straightness_turn_over_together(self):
        key = "effects.Z.straightness."
        values = {key + "first_wave_um": 2.0, key + "second_wave_um": -1.0, key + "phase_deg": 30.0}
        truth = {"kind": "single", "effects": [{"name": "straightness", "place": "Z", "parameters": values}], "values": values}
        told = found("straightness", "Z", key + "first_wave_um", -2.0, -2.1, -1.9)
        told["parameters"] += [{"key": key + "second_wave_um", "value": 1.0, "low": 0.9, "high": 1.1},
                               {"key": key + "phase_deg", "value": -150.0, "low": -152, "high": -148}]
        row = grading.grade(truth, report(told), 1)
        self.assertEqual((row["errors"], row["covered"]), ([0, 0], [True, True]))
        told["parameters"][2]["value"] = 30.0
        self.assertEqual(grading.grade(truth, report(told), 1)["covered"], [False, False])

    def test_a_true_value_of_nought_has_no_relative_error(self):
        truth = dict(TRUTH, values={"effects.X.backlash.gap_um": 0.0})
        row = grading.grade(truth, report(found("backlash", "X", "effects.X.backlash.gap_um", 4.1, 3.9, None)), 1)
        self.assertEqual((row["errors"], row["covered"]), ([], [False]))

    def test_strong_pairs_are_counted_by_themselves(self):
        rows = [{"kind": "pair", "exact": e, "strength": s, "strength_beside": s, "right": [e, e], "claims": 2, "seconds": 1, "after_over_floor": 1}
                for e, s in ((True, 5), (False, 1.5))]
        of = grading.summary(rows)
        self.assertEqual(of["pair: exact set"], "1/2 (50.0 %)")
        self.assertEqual(of["pair: exact set, each effect strong"], "1/1 (100.0 %)")

    def test_cogging_of_whole_waves_per_turn_is_a_torque_ripple(self):
        truth = {"kind": "single", "effects": [{"name": "torque_ripple", "place": "X", "parameters": {"amplitude_N": 20.0, "order": 6.0}}]}
        for pitch, right in ((2.0, True), (2.2, False)):
            told = found("cogging", "X", "effects.X.cogging.pole_pitch_mm", pitch)
            self.assertEqual(grading.grade(truth, report(told), 1)["exact"], right)

    def test_everything_is_possible_earns_nothing(self):
        row = grading.grade(TRUTH, report(found("backlash", "X", **{"class": ["X.windup"] * 9})), 1)
        self.assertAlmostEqual(row["class"], 0.1)

    def test_interval_that_misses(self):
        row = grading.grade(TRUTH, report(found("backlash", "X", "effects.X.backlash.gap_um", 5, 4.9, 5.1)), 1)
        self.assertEqual(row["covered"], [False])

    def test_declared_number_out_of_tolerance(self):
        truth = {"kind": "single", "effects": [{"name": "coulomb", "place": "Y", "parameters": {"share_percent": 30}}]}
        self.assertTrue(grading.grade(truth, report(found("deviation", "effects.Y.coulomb.level_N")), 1)["top"])
        self.assertFalse(grading.grade(truth, report(found("deviation", "effects.X.coulomb.level_N")), 1)["top"])

    def test_below_the_limit_silence_is_right(self):
        row = grading.grade(TRUTH, report(verdict="NO DEVIATION", excitation=[{"name": "X.backlash", "detection_limit": 9, "excited": True}]), 1)
        self.assertLess(row["strength"], 1)
        self.assertTrue(row["silent"])

    def test_unknown_must_not_be_explained(self):
        truth = {"kind": "unknown", "effects": [], "unknown": "hose", "law_axes": ["X"], "law_points": ["table_force"]}
        law = {"axis": "X", "point": "table_force", "behaves_like": ""}
        self.assertTrue(grading.grade(truth, report(verdict="UNEXPLAINED", laws=[law]), 1)["law_right"])
        self.assertFalse(grading.grade(truth, report(found("cable_chain", "X")), 1)["rejected"])

    def test_summary_counts(self):
        limit = {"excitation": [{"name": "X.backlash", "detection_limit": 1, "excited": True}]}
        rows = [grading.grade(TRUTH, report(found("backlash", "X"), **limit), 1), grading.grade(TRUTH, report(**limit), 1),
                grading.grade({"kind": "clean", "effects": []}, report(found("backlash", "X")), 1)]
        out = grading.summary(rows)
        self.assertEqual(grading.number_of(out["single: top-1, strong (from 3 L)"]), 0.5)
        self.assertEqual(grading.number_of(out["clean machines accused"]), 1)
        self.assertIsNone(grading.number_of(out["single: top-1, weak (1 to 3 L)"]))

    def test_no_limit_stated(self):
        self.assertTrue(math.isnan(grading.grade(TRUTH, report(), 1)["strength"]))


if __name__ == "__main__":
    unittest.main()
