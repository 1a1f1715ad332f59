// The regression suite of the overtravel protection: it runs, it measures right, and it can see.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/fault_draw.hpp"
#include "apps/lockout_fault.hpp"
#include "apps/lockout_page.hpp"
#include "apps/lockout_random.hpp"
#include "apps/lockout_report.hpp"
#include "apps/lockout_suite.hpp"
#include "tests/machine/harness.hpp"

namespace vcnc::lockout_test {
namespace {

using Kind = Scenario::Kind;
using Expect = Scenario::Expect;

std::vector<std::string> shipped() {
  return {configs("machines/trunnion.toml"), configs("machines/head.toml"),
          configs("machines/trunnion_measured.toml")};
}

std::string told(const std::vector<LockoutVerdict>& verdicts) {
  std::string text;
  for (const LockoutVerdict& v : verdicts)
    for (const std::string& sentence : v.failures) text += v.id + ": " + sentence + "\n";
  return text;
}

std::vector<LockoutItem> drawn(std::uint64_t crashes, std::uint64_t ordinary,
                               std::uint64_t seed = 1) {
  return lockout_items(
      {.seed = seed, .crashes = crashes, .ordinary = ordinary, .machines = shipped()});
}

struct Played {
  LockoutVerdict verdict;
  TripLog log;
};

Played run_one(const Scenario& scenario, const Sabotage& sabotage = {}) {
  const LockoutFolder folder;
  Played played;
  played.verdict = run_lockout("one", scenario,
                               {.work_folder = folder.path(), .sabotage = sabotage}, played.log);
  return played;
}

Scenario scenario(Kind kind, Expect expect, double depth, const char* machine = "trunnion") {
  Scenario s;
  s.name = to_string(kind);
  s.machine = configs(std::string("machines/") + machine + ".toml");
  s.kind = kind;
  s.expect = expect;
  s.depth = depth;
  if (kind == Kind::wrong_length) s.axial_angle = kPi / 2;
  return s;
}

/// A protection that hardly ever finds a reason.
void dull(ProbeParams& probe) {
  probe.range *= 100;
  probe.overtravel_lateral *= 100;
  probe.overtravel_axial *= 100;
  probe.overtravel_force_lateral *= 100;
  probe.overtravel_force_axial *= 100;
}

// ------------------------------------------------------------------------------ drawn runs

TEST(Lockout, CrashesOfASeedEndSafelyAndInTime) {
  const auto verdicts = LockoutRunner{}.run(drawn(50, 0));
  const LockoutSummary s = summarise(verdicts);
  EXPECT_EQ(s.as_expected, 50u) << told(verdicts);
  EXPECT_EQ(s.missed, 0u);
  EXPECT_GT(s.soft, 10u);
  EXPECT_GT(s.hard + s.both, 10u);
  // Sample k, judged by the NC unit in k, acts from k+1 on: one to two cycles after the crossing.
  ASSERT_GT(s.reaction.sorted.size(), 25u);
  EXPECT_GE(s.reaction.min(), 1e-3 - 1e-9);
  EXPECT_LE(s.reaction.max(), 2e-3 + 1e-9);
  EXPECT_LT(s.limit_share.max(), 1);
}

TEST(Lockout, OrdinaryRunsOfASeedAreNotStopped) {
  const auto verdicts = LockoutRunner{}.run(drawn(0, 50));
  const LockoutSummary s = summarise(verdicts);
  EXPECT_EQ(s.as_expected, 50u) << told(verdicts);
  EXPECT_EQ(s.false_trips, 0u);
  std::size_t touched = 0;
  for (const LockoutVerdict& v : verdicts) touched += v.figures.deepest > 50e-6;
  EXPECT_EQ(touched, 50u) << "an ordinary run touches the piece";
}

TEST(Lockout, TheNumberOfThreadsChangesNothing) {
  const auto items = drawn(12, 4, 3);
  const auto one = LockoutRunner{.jobs = 1}.run(items), many = LockoutRunner{.jobs = 5}.run(items);
  ASSERT_EQ(one.size(), many.size());
  std::set<std::string> hashes;
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].trace_hash, many[i].trace_hash);
    EXPECT_EQ(one[i].figures.deepest, many[i].figures.deepest);
    hashes.insert(one[i].trace_hash);
  }
  EXPECT_GE(hashes.size(), 13u) << "every run is another one";
}

TEST(Lockout, ADrawnRunIsTheSameAloneAndFromItsFile) {
  const auto items = drawn(8, 3, 5);
  for (const LockoutItem& item : items) {
    LockoutOptions alone{.seed = 5, .machines = shipped(), .only = item.id};
    ASSERT_EQ(to_toml(lockout_items(alone).at(0).scenario), to_toml(item.scenario));
    const Scenario again = parse_scenario(to_toml(item.scenario), "again");
    EXPECT_EQ(run_one(again).verdict.trace_hash, run_one(item.scenario).verdict.trace_hash)
        << item.id;
  }
}

/// Every simulated kind at every node, once.
TEST(Lockout, CrashesWithAnyFaultEndSafely) {
  const std::size_t pairs = FaultDraw::pairs().size();
  LockoutOptions options{
      .seed = 8, .crashes = 0, .ordinary = 0, .faulted = pairs, .machines = shipped()};
  const auto items = lockout_items(options);
  const auto verdicts = LockoutRunner{}.run(items);
  const LockoutSummary s = summarise(verdicts);
  EXPECT_EQ(s.faulted, pairs);
  EXPECT_EQ(s.unsafe, 0u) << told(verdicts);
  std::set<std::pair<std::string, BusFault::Kind>> covered;
  std::size_t late = 0;
  for (const LockoutVerdict& v : verdicts) {
    for (const std::string& text : v.faults) {
      const BusFault fault = parse_fault(text);
      covered.insert({fault.node, fault.kind});
      late += fault.from >= static_cast<Tick>(v.cycles);
    }
  }
  EXPECT_EQ(covered.size() + s.refused, pairs) << "all but those of refused programs";
  EXPECT_LT(late, pairs / 5) << "faults come while there is something to disturb";
}

/// at=contact means the first cycle that shows a deflection, as a run without the fault has it.
TEST(Lockout, AFaultAtContactComesWhenTheBallTouches) {
  Scenario s = scenario(Kind::program_error, Expect::fault_safe, 6e-3);
  s.feed = 20e-3;
  s.faults = {"drive A duplicate at=contact from_s=-0.005", "probe mute at=contact from_s=0.02"};
  const Played faulted = run_one(s);
  EXPECT_TRUE(faulted.verdict.passed()) << told({faulted.verdict});
  ASSERT_EQ(faulted.verdict.faults.size(), 2u);
  const auto touch =
      std::find_if(faulted.log.begin(), faulted.log.end(),
                   [](const TripCycle& c) { return c.deflection.back().norm() > 1e-6; }) -
      faulted.log.begin();
  EXPECT_EQ(parse_fault(faulted.verdict.faults[0]).from, touch - 5);
  EXPECT_EQ(parse_fault(faulted.verdict.faults[1]).from, touch + 20);
  const auto& alarms = faulted.verdict.end.alarms;
  ASSERT_FALSE(alarms.empty());
  const auto silent =
      std::find_if(alarms.begin(), alarms.end(), [](const Alarm& a) { return a.code == 3202; });
  ASSERT_NE(silent, alarms.end());
  EXPECT_EQ(silent->tick, touch + 20 + 2) << "in the third cycle without it";
}

// ------------------------------------------------------------------------------ the kinds

TEST(Lockout, EveryShippedScenarioEndsAsItSays) {
  LockoutOptions options{.crashes = 0, .ordinary = 0};
  for (const auto& entry : std::filesystem::directory_iterator(configs("scenarios")))
    options.files.push_back(entry.path());
  ASSERT_GE(options.files.size(), 10u);
  const auto verdicts = LockoutRunner{}.run(lockout_items(options));
  EXPECT_EQ(summarise(verdicts).as_expected, options.files.size()) << told(verdicts);
}

/// Not deep enough to trip, every kind deflects the probe by its depth: with what its name says
/// and no other cause. The limit is the arc of the swing and the ball that settles.
TEST(Lockout, EveryKindDrivesTheBallAsDeepAsItSays) {
  for (const char* machine : {"trunnion", "head"})
    for (const Kind kind : {Kind::program_error, Kind::wrong_offset, Kind::wrong_length,
                            Kind::not_retracted, Kind::rotary}) {
      Scenario s = scenario(kind, Expect::none, 1.2e-3, machine);
      s.rotary_feed = 0.1;  // the head has a lever of 350 mm
      const Played run = run_one(s);
      EXPECT_TRUE(run.verdict.passed()) << told({run.verdict});
      EXPECT_NEAR(run.log.back().deflection.back().norm(), 1.2e-3,
                  kind == Kind::rotary ? 10e-6 : 10e-9)
          << machine << " " << to_string(kind);
      const bool axial = std::abs(run.log.back().deflection.back().z()) > 1e-3;
      EXPECT_EQ(axial, kind == Kind::wrong_length);
    }
}

/// From beyond the centre of curvature of the rim, where the foot on its nearest part is hard to
/// find, into it at a rapid.
TEST(Lockout, AWayFromFarOffMeetsTheRim) {
  Scenario s = scenario(Kind::not_retracted, Expect::trip, 6.754e-3);
  s.target = Scenario::Target::piece;
  s.station = 0.322389;
  s.run_up = 40.23e-3;
  s.set = {"axes.X.acceleration_mm_s2=1777", "axes.Y.acceleration_mm_s2=1777"};
  const LockoutVerdict verdict = run_one(s).verdict;
  EXPECT_TRUE(verdict.passed()) << told({verdict});
}

TEST(Lockout, AnOffsetErrorOfNothingIsNoCrash) {
  const Played run = run_one(scenario(Kind::wrong_offset, Expect::none, 0.5e-3));
  EXPECT_TRUE(run.verdict.passed()) << told({run.verdict});
  EXPECT_NEAR(run.verdict.figures.deepest, 0.5e-3, 1e-6);
}

TEST(Lockout, SpindleStartsAndFeedsThatCannotBeCountedAreRefused) {
  EXPECT_TRUE(run_one(scenario(Kind::spindle_start, Expect::refused, 5e-3)).verdict.passed());
  // At 200 mm/s a period goes by in every sample: the probe would read nothing at all.
  Scenario fast = scenario(Kind::program_error, Expect::refused, 30e-3);
  fast.run_up = 35e-3;
  fast.feed = 0.2;
  EXPECT_TRUE(run_one(fast).verdict.passed());
  fast.feed = 0.0999;
  fast.expect = Expect::hard;
  const LockoutVerdict just_allowed = run_one(fast).verdict;
  EXPECT_TRUE(just_allowed.passed()) << told({just_allowed});
}

// ------------------------------------------------------------------------------ measured right

/// Into a plane at constant speed everything follows from one moment: the deflection is v (t - t0),
/// so the range is left at T, the sample ceil(T) shows it, the axes brake from ceil(T) + 1 on, and
/// the hold 1 - (3 s^2 - 2 s^3) of T_h = 1.5 v / (a / 2) needs v T_h / 2.
TEST(Lockout, FiguresOfASoftStopFollowFromTheLawOfTheHold) {
  Scenario s = scenario(Kind::program_error, Expect::soft_stop, 6e-3);
  s.feed = 25e-3;
  const Played run = run_one(s);
  ASSERT_TRUE(run.verdict.passed()) << told({run.verdict});
  const TripFigures& f = run.verdict.figures;
  const double v = 25e-3, hold = 1.5 * v / 2.5;
  EXPECT_NEAR(f.speed, v, 1e-7);
  EXPECT_NEAR(f.action / kCycle, std::ceil(f.threshold / kCycle) + 1, 1e-9);
  const double way = v * (f.reaction() + hold / 2);
  EXPECT_NEAR(f.stopping_distance, way, 2e-6);  // ends when slower than 1 um per cycle
  EXPECT_NEAR(f.deepest, 2e-3 + way, 2e-6);
  EXPECT_NEAR(f.force, 1324 * f.deepest, 1e-9);
  EXPECT_NEAR(f.limit_share, f.deepest * 1324 / 20, 1e-9);
}

TEST(Lockout, CrossingsAreFoundBetweenTheSamples) {
  // 1 um per 100 us from cycle 5 on: 2 mm are passed 200 ms later, to the 0.05 us of rounding.
  Machine machine;
  TripLog log(400);
  for (std::size_t k = 0; k < log.size(); ++k)
    for (std::size_t j = 0; j < 10; ++j) {
      const double steps = 10.0 * (static_cast<double>(k) - 5) - 9 + static_cast<double>(j) + 0.25;
      log[k].deflection[j] = {std::max(0.0, steps * 1e-6), 0, 0};
    }
  const TripFigures f = measure(log, machine);
  EXPECT_NEAR(f.threshold, 5e-3 + 200e-3 - 0.25e-4, 1e-9);
  EXPECT_NEAR(f.hard_threshold, 5e-3 + 250e-3 - 0.25e-4, 1e-9);
  EXPECT_FALSE(f.tripped());
}

// ------------------------------------------------------------------------------ it can see

TEST(Lockout, AProtectionThatIsSwitchedOffIsMissedTrips) {
  const auto items = drawn(15, 0);
  const Sabotage off = [](Machine& module, Machine& nc) {
    module.probe.in_spindle = nc.probe.in_spindle = false;
  };
  const auto verdicts = LockoutRunner{.sabotage = off}.run(items);
  const LockoutSummary s = summarise(verdicts);
  EXPECT_EQ(s.as_expected, 0u);
  EXPECT_GE(s.missed, 10u);
}

TEST(Lockout, AProtectionWithWrongThresholdsIsSeen) {
  const Sabotage wrong = [](Machine& module, Machine& nc) {
    dull(module.probe);
    dull(nc.probe);
  };
  const Played run = run_one(scenario(Kind::program_error, Expect::trip, 6e-3), wrong);
  ASSERT_FALSE(run.verdict.passed());
  EXPECT_NE(told({run.verdict}).find("no trip"), std::string::npos);
  EXPECT_NE(told({run.verdict}).find("do not brake"), std::string::npos) << told({run.verdict});
  const auto verdicts = LockoutRunner{.sabotage = wrong}.run(drawn(15, 0));
  EXPECT_LE(summarise(verdicts).as_expected, 5u) << "slips and the mechanical switch are left";
}

TEST(Lockout, EachPathAloneStopsTheMachineInItsTime) {
  const Scenario s = scenario(Kind::wrong_offset, Expect::soft_stop, 6e-3);
  // Without the module the NC unit is as fast as ever; that the module is dead is found.
  const Played nc = run_one(s, [](Machine& module, Machine&) { dull(module.probe); });
  EXPECT_EQ(told({nc.verdict}), "one: the overtravel module did not trip\n");
  EXPECT_LE(nc.verdict.figures.reaction(), 2e-3);
  // Without the NC unit's own check it hears of it from the module, one cycle later.
  const Played module = run_one(s, [](Machine&, Machine& unit) { dull(unit.probe); });
  EXPECT_TRUE(module.verdict.passed()) << told({module.verdict});
  EXPECT_NEAR(module.verdict.figures.reaction() - nc.verdict.figures.reaction(), 1e-3, 1e-9);
}

/// The judgement of a good log that is spoilt in one place.
class Judgement : public testing::Test {
 protected:
  Judgement() : run_(run_one(scenario_)), machine_(make_case(scenario_).machine) {}

  std::string spoilt(const std::function<void(TripLog&, TripEnd&)>& spoil) {
    TripLog log = run_.log;
    TripEnd end = run_.verdict.end;
    spoil(log, end);
    std::string text;
    for (const std::string& s : judge(scenario_, true, log, measure(log, machine_), end, machine_))
      text += s + "\n";
    return text;
  }
  static bool says(const std::string& text, const char* what) {
    return text.find(what) != std::string::npos;
  }

  static Scenario exact() {
    Scenario s = scenario(Kind::program_error, Expect::soft_stop, 6e-3);
    s.reading_error = 10e-9;
    return s;
  }

  const Scenario scenario_ = exact();
  Played run_;
  Machine machine_;
};

/// The judgement of a run with a fault, spoilt in one place.
TEST(FaultedJudgement, FindsWhatIsNotSafe) {
  Scenario s = scenario(Kind::program_error, Expect::fault_safe, 6e-3);
  s.feed = 20e-3;
  s.faults = {"probe mute at=contact from_s=0.02"};
  const Played good = run_one(s);
  const LockoutCase the_case = make_case(s);
  const BusFaults faults{parse_fault(good.verdict.faults.at(0))};
  const auto spoilt = [&](const std::function<void(TripLog&, TripEnd&)>& spoil) {
    TripLog log = good.log;
    TripEnd end = good.verdict.end;
    spoil(log, end);
    std::string text;
    for (const std::string& sentence :
         judge_faulted(s, the_case, faults, log, measure(log, the_case.machine), end))
      text += sentence + "\n";
    return text;
  };
  const auto says = [](const std::string& text, const char* what) {
    return text.find(what) != std::string::npos;
  };
  EXPECT_EQ(spoilt([](TripLog&, TripEnd&) {}), "");
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) { log.back().axes[0] += 1e-3; }),
                   "axis X still moves"));
  EXPECT_TRUE(
      says(spoilt([](TripLog& log, TripEnd&) { log.back().lock = false; }), "neither locked"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (TripCycle& c : log) c.spindle_safe = false;
                   }),
                   "when the axes stood still"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     log[log.size() / 2].protection = OvertravelState::State::hard;
                     log.back().protection = OvertravelState::State::normal;
                   }),
                   "not latched"));
  EXPECT_TRUE(says(spoilt([](TripLog&, TripEnd& end) { end.alarms.clear(); }), "no alarm names"));
  EXPECT_TRUE(says(spoilt([](TripLog&, TripEnd& end) { end.run_down = -1; }), "come to rest"));
  EXPECT_TRUE(says(spoilt([](TripLog&, TripEnd& end) { end.spindle_stays_locked = false; }),
                   "could be started"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (std::size_t k = log.size() / 3; k < log.size(); ++k)
                       log[k].deflection.fill(Vec3(16e-3, 0, 0));
                   }),
                   "of the mechanical limit"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (TripCycle& c : log) {
                       c.nc_alarm = c.left_operation = false;
                       c.deflection.fill(Vec3(3e-3, 0, 0));
                     }
                   }),
                   "the axes do not brake"));
}

TEST_F(Judgement, OfAGoodRunIsEmpty) {
  EXPECT_EQ(spoilt([](TripLog&, TripEnd&) {}), "");
}

TEST_F(Judgement, AllowsOneDeadPathAndNoCycleMore) {
  const auto later = [&](int cycles) {
    return spoilt([cycles](TripLog& log, TripEnd&) {
      for (int i = 0; i < cycles; ++i)
        std::find_if(log.begin(), log.end(), [](const TripCycle& c) {
          return c.nc_alarm;
        })->nc_alarm = false;
    });
  };
  EXPECT_EQ(later(1), "");
  EXPECT_TRUE(says(later(2), "out of range in the sample of cycle")) << later(2);
}

TEST_F(Judgement, FindsWhatIsNotLatchedLockedRecordedOrWithinTheLimit) {
  EXPECT_TRUE(says(
      spoilt([](TripLog& log, TripEnd&) { log.back().module = OvertravelState::State::normal; }),
      "not latched"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (TripCycle& c : log) c.spindle_locked = false;
                   }),
                   "the spindle was not locked"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (TripCycle& c : log) c.emergency = false;
                   }),
                   "no EMCY"));
  EXPECT_TRUE(says(spoilt([](TripLog&, TripEnd& end) { end.rows -= 1; }), "rows recorded"));
  EXPECT_TRUE(says(spoilt([](TripLog&, TripEnd& end) { end.spindle_stays_locked = false; }),
                   "could be started"));
  EXPECT_TRUE(
      says(spoilt([](TripLog&, TripEnd& end) { end.module_stays_latched = false; }), "fell back"));
  EXPECT_TRUE(
      says(spoilt([](TripLog& log, TripEnd&) { log.back().deflection.back() = Vec3(16e-3, 0, 0); }),
           "of the mechanical limit"));
  EXPECT_TRUE(says(spoilt([](TripLog& log, TripEnd&) {
                     for (TripCycle& c : log)
                       for (Vec3& d : c.deflection) d *= 0.5;
                   }),
                   "without a reason"));
}

// ------------------------------------------------------------------------------ input, output

TEST(Lockout, WrongFaultsAreRefused) {
  Scenario s = scenario(Kind::program_error, Expect::trip, 6e-3);
  for (const char* fault : {"probe", "probe mute from_s=-1", "drive X kill at=contact",
                            "drive X kill wall_s=1", "probe mute at=end", "bus slip"}) {
    s.faults = {fault};
    EXPECT_THROW(make_case(s), InputError) << fault;
  }
  s.faults = {"probe mute at=contact from_s=-0.01"};
  EXPECT_NO_THROW(make_case(s));
  Scenario none = scenario(Kind::program_error, Expect::fault_safe, 6e-3);
  EXPECT_THROW(check_scenario(none, "f"), ConfigError);
}

TEST(Lockout, WhatCannotBeMadeIsSaid) {
  Scenario s = scenario(Kind::program_error, Expect::trip, 6e-3);
  s.at = {2, 0, 0};
  try {
    make_case(s);
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("beyond its travel"), std::string::npos) << e.what();
  }
  EXPECT_THROW(lockout_items({.machines = shipped(), .only = "crash-x"}), InputError);
  EXPECT_THROW(lockout_items({.machines = {"/none.toml"}}), InputError);
}

TEST(Lockout, QuantilesAndBinsAreThoseOfTheNumbers) {
  const Distribution d({4, 1, 3, 2, 5});
  EXPECT_EQ(d.quantile(0.5), 3);
  EXPECT_EQ(d.quantile(0.95), 5);
  EXPECT_EQ(d.quantile(0.2), 1);
  EXPECT_EQ(d.histogram(0, 4, 2), (std::vector<std::size_t>{1, 4}));
}

TEST(Lockout, ReportsNameEveryRunAndHowToRepeatIt) {
  LockoutResults results{.seed = 9, .items = drawn(3, 1, 9)};
  results.items[0].scenario.expect = Expect::none;  // which it will not do
  results.items[0].scenario.name = "a <name> & \"more\"";
  results.verdicts = LockoutRunner{}.run(results.items);
  results.summary = summarise(results.verdicts);
  ASSERT_FALSE(results.verdicts[0].passed());
  const std::string text = lockout_text(results), json = lockout_json(results),
                    junit = lockout_junit(results), page = lockout_page(results);
  EXPECT_NE(text.find("vcnc lockout --only crash-0 --seed 9"), std::string::npos);
  EXPECT_NE(text.find("FAIL"), std::string::npos);
  for (const char* id : {"crash-0", "crash-1", "crash-2", "ordinary-0"}) {
    EXPECT_NE(json.find(id), std::string::npos);
    EXPECT_NE(junit.find(id), std::string::npos);
  }
  EXPECT_NE(junit.find("tests=\"4\" failures=\"1\""), std::string::npos) << junit;
  EXPECT_NE(junit.find("a &lt;name&gt; &amp; &quot;more&quot;"), std::string::npos);
  EXPECT_EQ(junit.find("<name>"), std::string::npos);
  EXPECT_EQ(page.find("<name>"), std::string::npos);
  EXPECT_NE(page.find("Not as expected"), std::string::npos);
}

}  // namespace
}  // namespace vcnc::lockout_test
