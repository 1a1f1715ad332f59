#include <gtest/gtest.h>

#include <set>

#include "configs/config.hpp"
#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/effect_stage.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "model/drive/axis_drive.hpp"
#include "model/parameters.hpp"

namespace vcnc::candidates_test {
namespace {

Machine machine() {
  return load_machine(std::string(VCNC_SOURCE_DIR) + "/configs/machines/trunnion.toml");
}

bool is_shape(const Candidate& c, std::size_t i) {
  return std::find(c.shape.begin(), c.shape.end(), i) != c.shape.end();
}

/// Of the file, only the lines of effects that are not as by default are written.
TEST(Candidates, AmplitudesActAndShapesAloneDoNot) {
  const Machine declared = machine();
  std::size_t amplitudes = 0, shapes = 0;
  for (const Candidate& c : candidates(declared)) {
    if (c.effect == "deviation") continue;
    for (std::size_t i = 0; i < c.numbers.size(); ++i) {
      const FreeNumber& n = c.numbers[i];
      Machine changed = declared;
      ASSERT_LE(n.min, n.max);
      if (is_shape(c, i)) {
        ++shapes;
        continue;
      }
      ++amplitudes;
      EXPECT_GT(n.typical, 0) << n.key;
      ASSERT_NO_THROW(set_parameter(changed, n.key, n.typical)) << n.key;
      bool acts = false;
      for_each_effect_of(changed.effects,
                         [&](const auto& effect, std::size_t) { acts = acts || !effect.null(); });
      EXPECT_TRUE(acts) << n.key;
    }
  }
  EXPECT_GT(amplitudes, 200u);
  EXPECT_GT(shapes, 80u);
}

std::set<std::string> sought_in(const Record& record) {
  std::set<std::string> names;
  for (const Candidate& c : candidates(machine(), record)) names.insert(c.name());
  return names;
}

TEST(Candidates, OfARecordAreWhatItCanTellOf) {
  Record joint;
  for (const SignalKind kind : {SignalKind::command, SignalKind::position, SignalKind::force})
    joint.signals.push_back({kind, kC, "", {}, 0});
  for (const std::string& name : sought_in(joint))
    EXPECT_TRUE(name.starts_with("C.") || name.starts_with("axes.C.")) << name;
  EXPECT_TRUE(sought_in(joint).contains("C.kv_error"));

  Record sensor = joint;
  sensor.signals.push_back({SignalKind::tool_position, 0, "", {}, 0});
  sensor.on_table = OnTable{};
  const std::set<std::string> of_sensor = sought_in(sensor);
  EXPECT_TRUE(of_sensor.contains("geometry.squareness"));
  EXPECT_TRUE(of_sensor.contains("probe.sample_latency"));
  EXPECT_FALSE(of_sensor.contains("probe.signal_phase"));
  EXPECT_FALSE(of_sensor.contains("probe.stylus_bending"));
  EXPECT_FALSE(of_sensor.contains("probe.moving_mass_g.deviation"));

  Record probe = joint;
  probe.signals.push_back({SignalKind::deflection, 0, "", {}, 0});
  EXPECT_EQ(sought_in(probe).size(), candidates(machine()).size());
}

TEST(DeclaredNumbers, ReckonedOnesMayBeFurtherOffThanMeasuredOnes) {
  Machine declared = machine();
  declared.effects.axis[kC].get<WeightImbalance>() = {.force = -20, .angle = 0};
  declared.effects.axis[kC].get<Windup>().compliance = 60e-6;
  const auto tolerance = [&](const std::string& key, Against against) {
    for (const FreedNumber& n : nuisances(declared, against))
      if (n.number.key == key) return n.tolerance;
    return 0.0;
  };
  const std::string weight = "effects.C.weight_imbalance.torque_Nm",
                    angle = "effects.C.weight_imbalance.angle_deg",
                    compliance = "effects.C.windup.compliance_urad_per_Nm",
                    scale = "effects.X.scale_error.error_ppm";
  EXPECT_NEAR(tolerance(weight, Against::reckoning), 1, 1e-12);
  EXPECT_NEAR(tolerance(angle, Against::reckoning), 2, 1e-12);
  EXPECT_NEAR(tolerance(compliance, Against::reckoning), 3.6, 1e-9);
  EXPECT_NEAR(tolerance(scale, Against::reckoning), 15, 1e-12);
  for (const Against exact : {Against::declaration, Against::healthy_run}) {
    EXPECT_EQ(tolerance(weight, exact), 0);
    EXPECT_EQ(tolerance(angle, exact), 0);
    EXPECT_NEAR(tolerance(compliance, exact), 1.2, 1e-9);
    EXPECT_NEAR(tolerance(scale, exact), 1.5, 1e-12);
  }
  declared.effects.axis[kC].get<WeightImbalance>() = {};
  EXPECT_EQ(tolerance(angle, Against::reckoning), 0);
}

TEST(Candidates, HaveEveryEffectThatCanBePredicted) {
  std::set<std::string> named;
  Machine declared = machine();
  declared.effects.axis[kX].get<Windup>().compliance = 5e-9;  // else friction has one side
  for (const Candidate& c : candidates(declared)) EXPECT_TRUE(named.insert(c.name()).second);
  std::set<std::string> missing;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    bool found = false;
    for (const std::string& name : named)
      found = found || name.ends_with("." + std::string(Effect::text.name));
    if (!found && no_hypothesis<Effect>().empty()) missing.emplace(Effect::text.name);
    EXPECT_FALSE(found && !no_hypothesis<Effect>().empty()) << Effect::text.name;
  });
  EXPECT_EQ(missing, (std::set<std::string>{"bus_latency", "period_slip"}));
  EXPECT_TRUE(named.contains("X.backlash") && named.contains("C.encoder_eccentricity") &&
              named.contains("geometry.squareness") && named.contains("setup.piece_offset") &&
              named.contains("axes.Y.load_kg.deviation"));
}

TEST(Candidates, PlayNeedsAMotorSide) {
  Machine one_mass = machine();
  one_mass.axes[kX].mechanics.motor_inertia = 0;
  for (const Candidate& c : candidates(one_mass)) {
    EXPECT_NE(c.name(), "X.backlash");
    EXPECT_NE(c.name(), "X.windup");
  }
}

/// However masses are tried, together too: a drive with play refuses a motor that is too light.
TEST(Candidates, LeaveAMotorSideThatPlayCanStrike) {
  Machine light = machine();
  light.axes[kX].mechanics.motor_inertia *= 0.01;
  light.effects.axis[kX].get<Backlash>().gap = 5e-6;
  int met = 0;
  for (const Candidate& c : candidates(light)) {
    if (c.place == "axes.X.load_kg") ++met, move_number(light, c.place, c.numbers[0].max);
    if (c.place == "axes.X.motor_inertia_kgm2")
      ++met, move_number(light, c.place, c.numbers[0].min);
  }
  EXPECT_EQ(met, 2);
  EXPECT_NO_THROW(AxisDrive(light, kX, 1));
  EXPECT_GT(actual(light).axes[kX].mechanics.load, 3 * machine().axes[kX].mechanics.load);
}

TEST(Candidates, SidesAreThoseOfTheNullValue) {
  for (const Candidate& c : candidates(machine())) {
    if (c.name() == "X.backlash") {
      EXPECT_TRUE(c.numbers[0].one_sided);
    }
    if (c.name() == "X.kv_error") {
      EXPECT_FALSE(c.numbers[0].one_sided);
    }
    if (c.name() == "X.pitch_periodic") {
      EXPECT_EQ(c.shape, (std::vector<std::size_t>{1, 2}));  // period and phase
    }
  }
}

/// Of X, which goes from -100 to 300 mm.
Candidate of_x(const std::string& effect) {
  Machine machine;
  machine.axes[0].limits.min = -0.1;
  machine.axes[0].limits.max = 0.3;
  for (const Candidate& c : candidates(machine))
    if (c.name() == "X." + effect) return c;
  ADD_FAILURE() << "no such candidate";
  return {};
}

TEST(Candidates, AWaveIsTwiceTheTravelLongAtMost) {
  for (const char* effect : {"transmission_error", "pitch_periodic", "cogging", "straightness"}) {
    bool any = false;
    for (const FreeNumber& n : of_x(effect).numbers)
      if (n.key.find("period_mm") != std::string::npos ||
          n.key.find("pitch_mm") != std::string::npos ||
          n.key.find("wavelength_mm") != std::string::npos) {
        any = true;
        EXPECT_NEAR(n.max, 800, 1e-9) << n.key;
      }
    EXPECT_TRUE(any) << effect;
  }
  // Of a rotary axis a turn may be longer than its travel.
  for (const Candidate& c : candidates(machine()))
    if (c.name() == "A.load_encoder_error") {
      EXPECT_GE(c.numbers[1].max, 400) << c.numbers[1].key;
    }
}

TEST(Candidates, ALeadIsOneOfAnAxisThatIsClosedOnItsLoad) {
  Machine machine;
  const auto has_lead = [&] {
    const std::vector<Candidate> all = candidates(machine);
    const std::vector<FreedNumber> known = nuisances(machine);
    const bool along = has_key(known, "effects.X.lead_error.error_ppm");
    const bool candidate = std::any_of(
        all.begin(), all.end(), [](const Candidate& c) { return c.name() == "X.lead_error"; });
    EXPECT_EQ(along, candidate);
    return along;
  };
  machine.axes[kX].servo.feedback = ServoParams::Feedback::load;
  EXPECT_TRUE(has_lead());
  machine.axes[kX].mechanics.motor_inertia = 0;  // a linear motor
  EXPECT_FALSE(has_lead());
  machine = {};
  machine.axes[kX].servo.feedback = ServoParams::Feedback::motor;
  EXPECT_FALSE(has_lead());
}

TEST(Candidates, ASpringRestsHalfATravelBeyondItAtMost) {
  const Candidate c = of_x("cable_chain");
  ASSERT_EQ(c.numbers.size(), 3U);
  const FreeNumber& rest = c.numbers.back();
  EXPECT_EQ(rest.key, "effects.X.cable_chain.rest_mm");
  EXPECT_NEAR(rest.min, -300, 1e-9);
  EXPECT_NEAR(rest.max, 500, 1e-9);
}

TEST(Candidates, AZoneOfFrictionLiesWithinTheTravel) {
  const Candidate c = of_x("friction_zone");
  ASSERT_FALSE(c.numbers.empty());
  for (const FreeNumber& n : c.numbers) {
    if (n.key.ends_with("centre_mm")) {
      EXPECT_NEAR(n.min, -100, 1e-9);
      EXPECT_NEAR(n.max, 300, 1e-9);
    } else if (n.key.ends_with("width_mm") || n.key.ends_with("edge_mm")) {
      EXPECT_NEAR(n.max, 200, 1e-9);
    }
  }
}

/// Of one mass friction has one side.
TEST(Candidates, FrictionHasTwoSidesWhereTheTransmissionGivesWay) {
  const auto known = [](const Machine& machine) {
    std::vector<std::string> names;
    for (const Candidate& c : candidates(machine))
      if (c.effect == "motor_friction") names.push_back(c.name());
    return names;
  };
  Machine declared = machine();
  EXPECT_EQ(known(declared), std::vector<std::string>{});
  declared.effects.axis[kY].get<Windup>().compliance = 5e-9;
  declared.effects.axis[kC].get<Backlash>().gap = 1e-5;
  EXPECT_EQ(known(declared), (std::vector<std::string>{"Y.motor_friction", "C.motor_friction"}));
}

TEST(AsHypothesis, TurnsChangedNumbersIntoDeviations) {
  const Machine declared = machine();
  Machine changed = declared;
  changed.axes[kY].mechanics.load *= 1.1;
  changed.effects.get<Squareness>().xy = 1e-6;
  const Machine h = as_hypothesis(declared, changed);
  EXPECT_EQ(h.axes[kY].mechanics.load, declared.axes[kY].mechanics.load);
  ASSERT_EQ(h.effects.deviations.size(), 1u);
  EXPECT_EQ(h.effects.deviations[0].key, "axes.Y.load_kg");
  EXPECT_EQ(h.effects.get<Squareness>().xy, 1e-6);
  EXPECT_DOUBLE_EQ(actual(h).axes[kY].mechanics.load, changed.axes[kY].mechanics.load);
}

}  // namespace
}  // namespace vcnc::candidates_test
