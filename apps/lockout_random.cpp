#include "apps/lockout_random.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/fault_draw.hpp"
#include "configs/config.hpp"
#include "model/probe/contact.hpp"
#include "model/probe/noise.hpp"

namespace vcnc {

namespace {

using CaseKind = Scenario::Kind;
using CaseTarget = Scenario::Target;
using Expect = Scenario::Expect;

/// Rounded to what a file shows, so that a scenario and its file are the same.
double rounded(double v, double step) { return std::round(v / step) * step; }

class CaseDraw {
 public:
  CaseDraw(std::uint64_t seed, std::uint64_t stream, std::uint64_t number)
      : seed_(seed), stream_(stream), counter_(number << 8) {}

  double unit() { return uniform_noise(seed_, stream_, counter_++); }
  double between(double a, double b) { return a + (b - a) * unit(); }
  double log_between(double a, double b) { return a * std::pow(b / a, unit()); }
  bool chance(double p) { return unit() < p; }
  std::size_t index(std::size_t n) {
    return std::min(static_cast<std::size_t>(unit() * static_cast<double>(n)), n - 1);
  }

 private:
  std::uint64_t seed_, stream_, counter_;
};

constexpr std::uint64_t kCrashStream = 0x6c6f636b0001, kOrdinaryStream = 0x6c6f636b0002,
                        kFaultedStream = 0x6c6f636b0003;

/// What the probe and the axes are like, and where the ball is.
ProbeParams draw_machine(CaseDraw& draw, const std::vector<std::string>& machines, Scenario& s) {
  s.machine = machines[draw.index(machines.size())];
  s.seed = 1 + static_cast<int>(draw.index(1'000'000'000));
  const auto set = [&](const char* key, double value, double step) {
    s.set.push_back(fmt::format("{}={:.10g}", key, rounded(value, step)));
  };
  const double spring = draw.log_between(1, 3), range = draw.between(1.5, 2.5);  // [N/mm], [mm]
  const bool vertical = draw.chance(0.5);
  // Gravity leaves at least 0.4 of the range on its side.
  const double heaviest = 0.6 * range * spring / 9.81e-3 - (vertical ? 0 : 55);  // [g]
  set("probe.stylus_mass_g", draw.log_between(2, std::min(heaviest, 80.0)), 0.1);
  set("probe.spring_rate_N_per_mm", spring, 0.001);
  set("probe.damping_ratio", draw.between(0.1, 1), 0.01);
  set("probe.range_mm", range, 0.01);
  set("probe.overtravel_force_lateral_N", draw.between(20, 65), 0.1);
  s.set.push_back(vertical ? "probe.mounting=vertical" : "probe.mounting=horizontal");
  s.set.push_back(draw.chance(0.8) ? "probe.adc_bits=16" : "probe.adc_bits=12");
  const double acceleration = draw.log_between(1000, 8000);
  for (const char* axis : {"X", "Y", "Z"})
    set(fmt::format("axes.{}.acceleration_mm_s2", axis).c_str(), acceleration, 1);
  s.at = {rounded(draw.between(-60e-3, 60e-3), 1e-6), rounded(draw.between(-60e-3, 60e-3), 1e-6),
          rounded(draw.between(30e-3, 90e-3), 1e-6)};
  s.a = draw.chance(0.3) ? 0 : rounded(draw.between(-40, 40), 0.01) * kDegree;
  s.c = draw.chance(0.3) ? 0 : rounded(draw.between(-120, 120), 0.01) * kDegree;
  s.azimuth = rounded(draw.between(0, 360), 0.01) * kDegree;
  return load_machine(s.machine, s.set).probe;
}

void draw_target(CaseDraw& draw, Scenario& s) {
  const double which = draw.unit();
  s.target = which < 0.55   ? CaseTarget::plane
             : which < 0.7  ? CaseTarget::sphere
             : which < 0.85 ? CaseTarget::bore
                            : CaseTarget::piece;
  s.radius = rounded(draw.log_between(15e-3, 100e-3), 1e-6);
  s.station = rounded(draw.unit(), 1e-6);
}

/// The way to a feed under the acceleration and jerk of a usual machine, and a little more.
double run_up(CaseDraw& draw, double feed) {
  const double a = 1, j = 50;
  return rounded(
      std::min(feed * feed / (2 * a) + feed * a / (2 * j), 40e-3) + draw.log_between(0.2e-3, 2e-3),
      1e-6);
}

CaseKind draw_kind(CaseDraw& draw) {
  constexpr std::pair<CaseKind, double> kShares[] = {
      {CaseKind::program_error, 0.34}, {CaseKind::wrong_offset, 0.26},
      {CaseKind::wrong_length, 0.16},  {CaseKind::not_retracted, 0.12},
      {CaseKind::rotary, 0.08},        {CaseKind::spindle_start, 0.04}};
  double u = draw.unit();
  for (const auto& [kind, share] : kShares) {
    if (u < share) return kind;
    u -= share;
  }
  return CaseKind::program_error;
}

}  // namespace

ScenarioDraw::ScenarioDraw(std::uint64_t seed, std::vector<std::string> machines)
    : seed_(seed), machines_(std::move(machines)) {
  if (machines_.empty()) throw InputError("no machine file is given");
  for (const std::string& machine : machines_) load_machine(machine);
}

Scenario ScenarioDraw::crash(std::uint64_t number) const {
  return crash(kCrashStream, number, Feed::any);
}

Scenario ScenarioDraw::faulted(std::uint64_t number) const {
  Scenario s = crash(kFaultedStream, number, Feed::usual);
  const double range = load_machine(s.machine, s.set).probe.range;
  const double speed = s.kind == CaseKind::rotary ? 20e-3 : s.feed;
  const auto cycles = [](double t) { return static_cast<Tick>(std::ceil(t / kCycle)); };
  constexpr Tick kBefore = 50;
  BusFault fault = FaultDraw(seed_).in_turn(number, -kBefore, cycles(range / speed));
  fault.at_contact = true;
  s.faults = {text_of(fault)};
  s.name = fmt::format("{} {}, {}", to_string(s.kind), number, s.faults.front());
  s.expect = Expect::fault_safe;
  return s;
}

Scenario ScenarioDraw::crash(std::uint64_t stream, std::uint64_t number, Feed feed) const {
  CaseDraw draw(seed_, stream, number);
  Scenario s;
  s.kind = draw_kind(draw);
  s.name = fmt::format("{} {}", to_string(s.kind), number);
  const ProbeParams probe = draw_machine(draw, machines_, s);
  draw_target(draw, s);
  if (feed == Feed::usual && s.kind == CaseKind::spindle_start) s.kind = CaseKind::program_error;
  const double most = draw.chance(0.35) ? (feed == Feed::usual ? 4000 : 20000)
                                        : (feed == Feed::usual ? 1500 : 5000);  // [mm/min]
  s.feed = rounded(draw.log_between(300, most), 0.1) * 1e-3 / 60;
  s.rotary_feed = rounded(draw.log_between(1, 60), 0.01) * kDegree;
  switch (draw.index(4)) {
    case 0:
      s.axial_angle = 0;
      break;
    case 1:
      s.axial_angle = kPi / 2;
      break;
    default:
      s.axial_angle = rounded(draw.between(0, 90), 0.01) * kDegree;
  }
  if (s.kind == CaseKind::wrong_length) {
    s.axial_angle = kPi / 2;
    if (s.target == CaseTarget::piece) s.target = CaseTarget::plane;
  }
  if (s.kind == CaseKind::rotary || s.kind == CaseKind::wrong_length ||
      s.kind == CaseKind::spindle_start)
    s.target = s.target == CaseTarget::piece ? CaseTarget::plane : s.target;
  if (s.target == CaseTarget::plane && draw.chance(0.5)) {
    s.incidence = rounded(draw.between(0, 55), 0.01) * kDegree;
    s.incidence_azimuth = rounded(draw.between(0, 360), 0.01) * kDegree;
  }
  if (s.kind != CaseKind::wrong_length && s.kind != CaseKind::rotary && draw.chance(0.2))
    s.turn = rounded(draw.between(-10, 10), 0.01) * kDegree;
  if (s.target == CaseTarget::piece) s.turn = 0;

  // Deep enough to leave the range whatever its shape, the surface and the way are like.
  const UsableRange range = usable_range(probe);
  const double widest = std::max(range.positive.maxCoeff(), range.negative.maxCoeff());
  const double needed = 1.25 * widest * std::sqrt(3.0) / std::cos(s.incidence);
  s.depth = rounded(needed + draw.log_between(2e-3, 20e-3), 1e-6);
  s.run_up = run_up(draw, s.kind == CaseKind::rotary ? 20e-3 : s.feed);
  // The way begins in the free: within the bore, not across the piece.
  if (s.target == CaseTarget::bore)
    s.run_up = std::min(s.run_up, rounded(1.6 * (s.radius - probe.ball_radius), 1e-6));
  if (s.target == CaseTarget::piece) s.run_up = std::min(s.run_up, 8e-3);
  if (draw.chance(0.25) && s.kind != CaseKind::not_retracted && s.kind != CaseKind::rotary)
    s.predeflection = rounded(draw.between(0.1, 0.5) * std::cos(s.incidence) * probe.range, 1e-6);
  const bool fast = s.feed > 1500e-3 / 60;
  // A swing may be refused, too: its lever is drawn.
  s.expect = s.kind == CaseKind::spindle_start   ? Expect::refused
             : s.kind == CaseKind::rotary        ? Expect::safe
             : s.kind == CaseKind::not_retracted ? Expect::trip
             : fast                              ? Expect::safe
                                                 : Expect::trip;
  return s;
}

Scenario ScenarioDraw::ordinary(std::uint64_t number) const {
  CaseDraw draw(seed_, kOrdinaryStream, number);
  Scenario s;
  s.kind = CaseKind::scan;
  s.expect = Expect::none;
  s.name = fmt::format("scan {}", number);
  const ProbeParams probe = draw_machine(draw, machines_, s);
  draw_target(draw, s);
  s.feed = rounded(draw.log_between(200, 2500), 0.1) * 1e-3 / 60;
  s.axial_angle = draw.chance(0.3) ? 0 : rounded(draw.between(0, 90), 0.01) * kDegree;
  s.run_up = rounded(draw.log_between(0.2e-3, 2e-3), 1e-6);
  const UsableRange range = usable_range(probe);
  const double narrowest = std::min(range.positive.minCoeff(), range.negative.minCoeff());
  s.predeflection = rounded(draw.between(0.1, 0.6) * narrowest, 1e-6);
  s.sideways = rounded(draw.between(0.5e-3, 4e-3), 1e-6);
  if (s.target == CaseTarget::plane && draw.chance(0.3))
    s.turn = rounded(draw.between(-5, 5), 0.01) * kDegree;
  return s;
}

}  // namespace vcnc
