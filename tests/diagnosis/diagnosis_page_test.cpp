#include "diagnosis/report/diagnosis_page.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/report/diagnosis_figures.hpp"
#include "diagnosis/report/diagnosis_json.hpp"
#include "diagnosis/report/diagnosis_text.hpp"
#include "diagnosis/report/shown_law.hpp"

namespace vcnc::diagnosis_page_test {
namespace {

FoundEffect backlash() {
  FoundEffect e;
  e.name = "backlash";
  e.place = "X";
  e.numbers = {{"effects.X.backlash.gap_um", 5.0321, 4.91, 5.15}};
  e.gain = 812;
  e.contour_error_um = 1.4;
  e.class_with = {"X.windup"};
  e.separating_program = "reversals";
  return e;
}

Diagnosis found_backlash() {
  Diagnosis d;
  d.verdict = DiagnosisVerdict::partly;
  d.differential = true;
  d.explained_share = 0.87;
  d.effects = {backlash()};
  d.figures = {{{SignalKind::position, kX}, "held-out laps", 3e-6, 1e-6, 0.9e-6},
               {{SignalKind::position, kC}, "test <run>", 2e-5, 1e-5, 0}};
  d.excitation = {{"X.backlash", 0.1, true, "", "effects.X.backlash.gap_um", 0.25},
                  {"C.cogging",
                   std::numeric_limits<double>::infinity(),
                   false,
                   "rotary",
                   "effects.C.cogging.amplitude_Nm",
                   {}}};
  d.ladder = {{"declared", 5000, {3e-6}}, {"X.backlash", 1200, {1e-6}}};
  d.warnings = {"25 samples are missing"};
  return d;
}

TEST(DiagnosisJson, HoldsAllThatWasFoundInTheUnitsOfItsNames) {
  const auto json = nlohmann::json::parse(to_json(found_backlash(), "run.csv"));
  EXPECT_EQ(json["verdict"], "PARTLY");
  EXPECT_EQ(json["mode"], "differential");
  EXPECT_EQ(json["explained_share"], 0.87);
  const auto& effect = json["effects"][0];
  EXPECT_EQ(effect["name"], "backlash");
  EXPECT_EQ(effect["axis"], "X");
  EXPECT_EQ(effect["parameters"][0]["key"], "effects.X.backlash.gap_um");
  EXPECT_EQ(effect["parameters"][0]["low"], 4.91);
  EXPECT_EQ(effect["class"][0], "X.windup");
  EXPECT_EQ(effect["contour_error_um"], 1.4);
  EXPECT_EQ(effect["minor"], false);
  EXPECT_EQ(json["figures"][0]["unit"], "um");
  EXPECT_NEAR(json["figures"][0]["rms_before"].get<double>(), 3, 1e-12);
  EXPECT_EQ(json["figures"][1]["unit"], "arcsec");
  EXPECT_NEAR(json["figures"][1]["rms_after"].get<double>(), 2.0626480624709636, 1e-9);
  EXPECT_EQ(json["excitation"][0]["key"], "effects.X.backlash.gap_um");
  EXPECT_EQ(json["excitation"][0]["unit"], "um");
  EXPECT_EQ(json["excitation"][0]["detection_limit_beside_found"], 0.25);
  EXPECT_FALSE(json["excitation"][1].contains("detection_limit_beside_found"));  // nothing found
  EXPECT_TRUE(json["excitation"][1]["detection_limit"].is_null());               // infinite
  EXPECT_EQ(json["ladder"][1]["chi2"], 1200);
  EXPECT_TRUE(json["laws"].empty());
}

TEST(DiagnosisText, BeginsWithTheVerdictAndHasNumbersWithIntervals) {
  Diagnosis d = found_backlash();
  d.verdict = DiagnosisVerdict::explained;
  EXPECT_EQ(verdict_sentence(d), "what was added leaves nothing but noise");
  Diagnosis commissioned = d;
  commissioned.declared.commissioned.push_back({"position X", 1e-7});
  EXPECT_EQ(verdict_sentence(commissioned),
            "what was added leaves no more than noise and what commissioning left");
  d.explained_share = 0.9934;
  d.left = 1.66;
  EXPECT_EQ(verdict_sentence(d),
            "what was added explains 99.3 % of what was to be explained and leaves 1.66 times the "
            "noise");
  for (const auto& [share, words] :
       {std::pair(0.37, "37 %"), {0.012, "1 %"}, {0.0043, "0.4 %"}, {1.0, "100 %"}})
    EXPECT_EQ(percent(share), words);
  const std::string text = to_text(found_backlash());
  EXPECT_EQ(text.find("PARTLY: what was added explains 87 %"), 0u) << text;
  for (const char* part :
       {"mode: differential", "X.backlash: gap_um = 5.03 [4.91 .. 5.15]", "or: X.windup",
        "vcnc program reversals", "this run cannot show 1 of 2 candidates",
        "warning: 25 samples are missing"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(DiagnosisText, TellsWhatTheUserCallsTheAxes) {
  Diagnosis d = found_backlash();
  EXPECT_EQ(to_text(d).find("axes:"), std::string::npos);
  d.axis_names[kX] = "X";
  d.axis_names[kC] = "shoulder";
  EXPECT_NE(to_text(d).find("\naxes: C is shoulder\n"), std::string::npos) << to_text(d);
  EXPECT_NE(
      diagnosis_page({.diagnosis = d, .record = {}, .residuals = {}}).find("<p>C is shoulder.</p>"),
      std::string::npos);
  const auto json = nlohmann::json::parse(to_json(d, "run.csv"));
  EXPECT_EQ(json["axes"]["C"], "shoulder");
  EXPECT_FALSE(json["axes"].contains("Y"));
}

TEST(DiagnosisText, OfAnEffectThatIsDeclaredTheChangeIsToldToo) {
  Diagnosis d = found_backlash();
  move_number(d.declared, "effects.X.backlash.gap_um", 2);
  EXPECT_NE(to_text(d).find("gap_um = 5.03 [4.91 .. 5.15], 3.03 [2.91 .. 3.15] against the "
                            "reference run"),
            std::string::npos)
      << to_text(d);
  EXPECT_NE(diagnosis_page({.diagnosis = d, .record = {}, .residuals = {}})
                .find("3.03 [2.91 .. 3.15] against"),
            std::string::npos);
  const auto json = nlohmann::json::parse(to_json(d, "run.csv"));
  EXPECT_NEAR(json["effects"][0]["parameters"][0]["declared"].get<double>(), 2, 1e-12);
}

TEST(LawFigure, DrawsTheCurveWithItsBandInTheUnitsOfPages) {
  LearnedLaw learned;
  learned.law.point = Law::Point::displacement;
  learned.law.over = Covariate::velocity;
  learned.law.over_axis = Law::OfAxis::C;
  learned.law.at = {-0.1, 0.1};
  learned.law.value = {-2e-6, 3e-6};
  learned.low = {-2.5e-6, 2e-6};
  learned.high = {-1.5e-6, 4e-6};
  const std::string text = law_figure(learned);
  for (const char* part :
       {"-5.72958 -2 -2.5 -1.5", "5.72958 3 2 4", "speed of C  [deg/s]", "f  [um]"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(law_numbers(learned),
            "f is least -2 [-2.5 .. -1.5] um at -5.73 deg/s, most 3 [2 .. 4] um at 5.73 deg/s");
  learned.law.point = Law::Point::table_force;  // N per m of the position of X: N per mm
  learned.law.times = Covariate::position;
  learned.law.value = {5000, 5000};
  const std::string spring = law_figure(learned);
  EXPECT_NE(spring.find("-5.72958 5 "), std::string::npos) << spring;
  EXPECT_NE(spring.find("f  [N per mm]"), std::string::npos) << spring;
}

TEST(LawFigure, ShowsOfAJumpWhatWasBeforeAndAfter) {
  LearnedLaw learned;
  learned.law.point = Law::Point::displacement;
  learned.law.at = {30.001, 30.002};
  learned.law.value = {-1e-6, 3e-6};
  learned.low = {-1.3e-6, 2.6e-6};
  learned.high = {-0.7e-6, 3.4e-6};
  EXPECT_EQ(law_numbers(learned), "by 4 [3.5 .. 4.5] um");
  const std::string text = law_figure(learned);
  for (const char* part : {"28.001 -1 ", "30.001 -1 ", "30.002 3 ", "32.002 3 "})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  learned.law.at = {10, 30};  // takes its time
  EXPECT_FALSE(learned.law.jumps());
}

TEST(DiagnosisText, DigitsFollowTheInterval) {
  EXPECT_EQ(with_interval({"k", 1234.5678, 1200, 1270}), "1235 [1200 .. 1270]");
  EXPECT_EQ(with_interval({"k", 0.0123456, 0.0121, 0.0126}), "0.01235 [0.01210 .. 0.01260]");
  EXPECT_EQ(unit_of_key("effects.X.backlash.gap_um"), "um");
  EXPECT_EQ(unit_of_key("no.such.key"), "");
}

/// A record whose X goes back and forth, with a residual that is half a step at every reversal.
Record swinging() {
  Record record;
  record.source = "run.csv";
  MeasuredSignal command;
  command.kind = SignalKind::command;
  for (int k = 0; k < 4000; ++k) command.value.push_back(0.05 * std::sin(2 * kPi * k / 1000.0));
  record.signals = {command};
  return record;
}

TEST(ExplainedBy, FindsWhatAResidualGoesAlongWith) {
  const Record record = swinging();
  std::vector<double> stepped, noise;
  for (int k = 0; k < 4000; ++k) {
    stepped.push_back(std::cos(2 * kPi * k / 1000.0) > 0 ? 1e-6 : -1e-6);
    noise.push_back(1e-6 * std::sin(12.9898 * k * k));
  }
  const std::vector<RelatedQuantity> all = related_quantities(record);
  ASSERT_EQ(all.size(), 4u);                       // position, speed, acceleration of X, time
  EXPECT_GT(explained_by(all[0], stepped), 0.95);  // by direction
  EXPECT_GT(explained_by(all[1], stepped), 0.85);
  EXPECT_LT(explained_by(all[2], stepped), 0.1);
  for (const RelatedQuantity& c : all) EXPECT_LT(explained_by(c, noise), 0.03) << c.name;
}

TEST(DiagnosisPage, TellsEveryLawOnWhatThoseBeforeLeave) {
  Diagnosis d;
  d.verdict = DiagnosisVerdict::unexplained;
  for (const char* words : {"displacement on X as f(q_Y)", "displacement on X as q_X f(q_Y)"}) {
    LearnedLaw& law = d.laws.emplace_back();
    law.words = words;
    law.law.over = Covariate::position;
    law.law.at = law.low = law.high = law.law.value = {0, 1};
    law.share = d.laws.size() == 1 ? 0.83 : 0.55;
  }
  const std::string both =
      "behaves like displacement on X as f(q_Y) and like displacement on X as q_X f(q_Y)";
  EXPECT_NE(to_text(d).find(both), std::string::npos);
  const auto json = nlohmann::json::parse(to_json(d, "run"));
  ASSERT_EQ(json["laws"].size(), 2u);
  EXPECT_EQ(json["laws"][1]["behaves_like"], "displacement on X as q_X f(q_Y)");
  const Record record = swinging();
  const std::string page = diagnosis_page({d, record, {}});
  for (const std::string& part :
       {both, std::string("83 % of what is otherwise left"),
        std::string("A further law</h2>\n<p>behaves like displacement on X as q_X f(q_Y), which "
                    "takes 55 % of what those before have left.")})
    EXPECT_NE(page.find(part), std::string::npos) << part;
}

TEST(DiagnosisPage, TellsTheStoryInPicturesAndIsSelfContained) {
  const Record record = swinging();
  Diagnosis d = found_backlash();
  d.laws.emplace_back();
  d.laws[0].law.over = Covariate::velocity;
  d.laws[0].law.at = d.laws[0].low = d.laws[0].high = d.laws[0].law.value = {0, 1};
  ModelResiduals residuals;
  residuals.channels = {{SignalKind::position, kX}};
  residuals.before.emplace_back();
  residuals.after.emplace_back();
  for (int k = 0; k < 4000; ++k) {
    residuals.before[0].push_back(std::cos(2 * kPi * k / 1000.0) > 0 ? 1e-6 : -1e-6);
    residuals.after[0].push_back(1e-7 * std::sin(12.9898 * k * k));
  }
  const std::string page = diagnosis_page({d, record, residuals});
  EXPECT_EQ(page.find("<!DOCTYPE html>\n" + std::string(kDiagnosisMark) + "\n"), 0u);
  for (const char* part : {"PARTLY", "backlash", "5.03 [4.91 .. 5.15]", "What it goes along with",
                           "position X", "One effect after the other", "not excited",
                           "vcnc program rotary", "test &lt;run&gt;", "25 samples are missing",
                           // What gnuplot leaves out where it finds no room for it.
                           ">speed of X  [mm/s]<", ">f  [N]<", ">position X [mm]<"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_EQ(page.find("src="), std::string::npos);
}

}  // namespace
}  // namespace vcnc::diagnosis_page_test
