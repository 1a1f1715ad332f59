// Every effect changes the dynamic error in the way its text says: on the whole machine, seen by
// its own instruments, the feature of the signature has the size that its equation gives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <map>

#include "apps/demonstrations.hpp"

namespace vcnc::signature_test {
namespace {

constexpr double kUm = 1e-6, kRadius = 25e-3;  // of the circles
constexpr double kPeriod = 20e-6;              // of the probe's signals
constexpr double kPerRadian = kPeriod / (2 * kPi);
constexpr double kDeflection = 0.5e-3;

/// An effect shown: both runs, their curves, and what the effect made of them.
struct Shown {
  Demonstration d;
  Observation without, with;
  std::vector<Curve> before, after, off;

  explicit Shown(std::string_view name) : d(demonstration(name, ideal_machine())) {
    without = observe(d.without);
    with = observe(d.with);
    before = curves(d.without, without, d.quantity);
    after = curves(d.with, with, d.quantity);
    for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i)
      off.push_back(difference(after[i], before[i]));
  }

  std::vector<Curve> changes_of(Quantity quantity) const {
    const std::vector<Curve> a = curves(d.without, without, quantity),
                             b = curves(d.with, with, quantity);
    std::vector<Curve> all;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      all.push_back(difference(b[i], a[i]));
    return all;
  }

  /// Over the feeds of the passes: n of y ~ v^n.
  double exponent(const std::function<double(const Curve&)>& size) const {
    std::vector<double> speed, value;
    for (std::size_t i = 0; i < off.size(); ++i) {
      speed.push_back(d.with.passes[i].feed);
      value.push_back(size(off[i]));
    }
    return growth_exponent(speed, value).value_or(-99);
  }
  double fastest() const { return d.with.passes.back().feed; }

  /// Mean time of the rows of a pass [s].
  double time_of(const Pass& pass) const {
    double sum = 0, count = 0;
    for (const TelemetryRow& row : with.rows)
      if (row.line >= pass.first_line && row.line <= pass.last_line && row.state == 1) {
        sum += row.tick * 1e-3;
        ++count;
      }
    return sum / count;
  }

  /// Change of the reading of one probe channel against its phase, as in an interpolation error.
  Curve reading_over_phase(std::size_t channel) const {
    Curve c;
    for (std::size_t k = 2000; k < std::min(without.rows.size(), with.rows.size()); ++k) {
      const double x = without.rows[k].deflection[channel];
      if (std::abs(x) > 20e-6) c.add(2 * kPi * x / kPeriod, with.rows[k].deflection[channel] - x);
    }
    return c;
  }
};

void near(double value, double expected, double share) {
  EXPECT_NEAR(value, expected, share * std::abs(expected));
}

/// sin 2 phi between two axes: its size, and how it grows with the feed.
void ellipse(const Shown& s, double at_fastest, double exponent, double share = 0.03) {
  near(2 * harmonic(s.off.back(), 2).amplitude(), at_fastest, share);
  near(s.exponent([](const Curve& c) { return harmonic(c, 2).amplitude(); }), exponent, 0.05);
}

double step(const Shown& s, double at = 0) { return std::abs(step_at(s.off.front(), at).value()); }

/// Travel from a reversal until the friction has turned its sign, median over the reversals [m];
/// the friction is what the drive's force exceeds the inertia by.
double travel_to_turn(const Observation& o, const Pass& pass, std::size_t axis) {
  std::vector<double> all;
  double extreme = 0;
  int direction = 0;
  bool waiting = false;
  const Machine ideal = ideal_machine();
  for (std::size_t k = 1; k + 1 < o.rows.size(); ++k) {
    if (o.rows[k].line < pass.first_line || o.rows[k].line > pass.last_line) continue;
    const double v = o.rows[k + 1].q_act[axis] - o.rows[k].q_act[axis];
    const int now = v > 2e-9 ? 1 : v < -2e-9 ? -1 : 0;
    if (now != 0 && direction != 0 && now != direction) {
      extreme = o.rows[k].q_act[axis];
      waiting = true;
    }
    if (now != 0) direction = now;
    const double a =
        (o.rows[k + 1].q_act[axis] - 2 * o.rows[k].q_act[axis] + o.rows[k - 1].q_act[axis]) / 1e-6;
    const MechanicsParams& mechanics = ideal.axes[axis].mechanics;
    const double friction =
        o.rows[k].force[axis] * mechanics.force_limit - mechanics.total_inertia() * a;
    if (waiting && friction * direction > 0) {
      all.push_back(std::abs(o.rows[k].q_act[axis] - extreme));
      waiting = false;
    }
  }
  if (all.empty()) return -1;
  std::sort(all.begin(), all.end());
  return all[all.size() / 2];
}

using Check = std::function<void(const Shown&)>;

const std::map<std::string, Check>& checks() {
  static const std::map<std::string, Check> table{
      // ---------------------------------------------------------------------------- servo, bus, NC
      {"command_delay", [](const Shown& s) { ellipse(s, s.fastest() * 0.2e-3, 1); }},
      {"bus_latency", [](const Shown& s) { ellipse(s, s.fastest() * 1e-3, 1); }},
      {"load_encoder_latency", [](const Shown& s) { ellipse(s, s.fastest() * 100e-6, 1); }},
      {"kv_error", [](const Shown& s) { ellipse(s, s.fastest() / 40 * (1 / 0.9 - 1), 1); }},
      {"velocity_ff_error", [](const Shown& s) { ellipse(s, 0.01 * s.fastest() / 40, 1); }},
      {"acceleration_ff_error",
       [](const Shown& s) {  // d Ti / (w_v Kv) times the jerk v^3 / R^2
         const double jerk = std::pow(s.fastest(), 3) / (kRadius * kRadius);
         ellipse(s, 0.5 * 0.010 / (2 * kPi * 80 * 40) * jerk, 3);
       }},
      {"torque_constant_error",
       [](const Shown& s) {  // as a missing share 0.2 of all force, in a loop of 0.8 its gain
         const double jerk = std::pow(s.fastest(), 3) / (kRadius * kRadius);
         ellipse(s, 0.2 / 0.8 * 0.010 / (2 * kPi * 80 * 40) * jerk, 3, 0.05);
       }},
      {"integral_time_error",
       [](const Shown& s) {  // area under the error after a reversal ~ Ti
         double with = 0, without = 0;
         for (const double y : s.after.front().y) with += std::abs(y);
         for (const double y : s.before.front().y) without += std::abs(y);
         near(with / without, 2.0, 0.1);
       }},
      {"velocity_gain_error",
       [](const Shown& s) {  // area ~ 1 / Kp
         double with = 0, without = 0;
         for (const double y : s.after.front().y) with += std::abs(y);
         for (const double y : s.before.front().y) without += std::abs(y);
         near(with / without, 1 / 0.7, 0.05);
       }},
      {"current_lag",
       [](const Shown& s) {  // only where there is jerk: at the corners of the square
         double corners = 0, all = 0;
         const Curve& c = s.off.front();
         for (std::size_t i = 0; i < c.size(); ++i) {
           const double from_corner = std::abs(std::remainder(c.x[i] - 10e-3, 20e-3));
           all += c.y[i] * c.y[i];
           if (from_corner < 4e-3) corners += c.y[i] * c.y[i];
         }
         EXPECT_GT(corners, 0.95 * all);
         EXPECT_GT(max_abs(c), 0.1 * kUm);
       }},
      {"torque_limit",
       [](const Shown& s) {  // a flat top of the force at what is left of the limit
         double most = 0, free = 0;
         for (const TelemetryRow& row : s.with.rows) most = std::max(most, std::abs(row.force[kX]));
         for (const TelemetryRow& row : s.without.rows)
           free = std::max(free, std::abs(row.force[kX]));
         near(most, 0.2, 1e-3);
         EXPECT_GT(free, 0.21);
       }},
      {"encoder_eccentricity",
       [](const Shown& s) {  // A times the lever of 30 mm, once per turn
         near(harmonic(s.off.front(), 1).amplitude(), 8 * unit::arcsec.to_si * 0.030, 0.01);
       }},
      {"lead_error",
       [](const Shown& s) {  // in proportion to the way
         const Curve& off = s.off.front();
         const double e = (off.y.back() - off.y.front()) / (off.x.back() - off.x.front());
         near(std::abs(e), 100e-6, 0.01);
       }},
      {"transmission_error",
       [](const Shown& s) { near(wave(s.off.front(), 10e-3).amplitude(), 2 * kUm, 0.01); }},
      {"load_encoder_error",
       [](const Shown& s) {  // as far as a position loop of 40/s follows
         const double w = 2 * kPi * s.d.with.passes.front().feed / 20e-3;
         near(wave(s.off.front(), 20e-3).amplitude(), 2 * kUm / std::hypot(1, w / 40), 0.005);
       }},
      {"encoder_subdivision",
       [](const Shown& s) { near(wave(s.off.front(), 20e-6).amplitude(), 200e-9, 0.03); }},
      {"encoder_quantisation",
       [](const Shown& s) { near(peak_to_peak(s.off.front()), 1e-6, 0.05); }},
      {"torque_ripple",
       [](const Shown& s) {
         // |T| A with T = L / (1 + L), L = w_v (1 + 1/(Ti s)) (s + Kv) / s^2, at six per turn
         const double w = 2 * kPi * s.d.with.passes.front().feed / (12e-3 / 6);
         const std::complex<double> p(0, w);
         const std::complex<double> L =
             2 * kPi * 80 * (1.0 + 1.0 / (0.010 * p)) * (p + 40.0) / (p * p);
         near(wave(s.off.front(), 2e-3).amplitude(), 40 * std::abs(L / (1.0 + L)), 0.05);
       }},
      {"cogging", [](const Shown& s) { near(wave(s.off.front(), 24e-3).amplitude(), 50, 0.03); }},
      {"bus_jitter",
       [](const Shown& s) { near(s.exponent([](const Curve& c) { return scatter(c); }), 1, 0.1); }},
      {"bus_loss",
       [](const Shown& s) {  // the set-point stands for a cycle: seen in its differences
         int moving = 0, lost = 0;
         const auto way = [&](const Observation& o, std::size_t k) {
           return o.rows[k].q_act[kX] - o.rows[k - 1].q_act[kX];
         };
         for (std::size_t k = 2; k < s.with.rows.size(); ++k) {
           const double v = way(s.without, k);
           if (std::abs(v) < 15e-6) continue;
           ++moving;
           const double now = (v - way(s.with, k)) / v;
           const double before = (way(s.without, k - 1) - way(s.with, k - 1)) / v;
           lost += now > 0.05 && std::abs(before) < 0.02;
         }
         EXPECT_GT(moving, 1500);
         EXPECT_NEAR(static_cast<double>(lost) / moving, 0.01, 0.005);
       }},
      {"corner_cutting",
       [](const Shown& s) {  // from P20 to P70: up to 50 um more, at the corners only
         const double most = max_abs(s.off.front());
         EXPECT_LE(most, 50.1 * kUm);
         EXPECT_GE(most, 40 * kUm);
         for (std::size_t i = 0; i < s.off.front().size(); ++i)
           if (std::abs(std::remainder(s.off.front().x[i], 20e-3)) < 4e-3) {
             EXPECT_LT(std::abs(s.off.front().y[i]), 0.01 * kUm);
           }
       }},
      {"chord_error",
       [](const Shown& s) {  // n chords with the height of R (1 - cos(pi/n))
         const double n = std::ceil(kPi / std::acos(1 - 10e-6 / kRadius));
         near(peak_to_peak(s.off.front()), kRadius * (1 - std::cos(kPi / n)), 0.06);
         const double ripple = wave(s.off.front(), 2 * kPi / n).amplitude();
         EXPECT_GT(ripple, 3 * wave(s.off.front(), 2 * kPi / (n + 7)).amplitude());
       }},
      {"path_filter",
       [](const Shown& s) {
         near(std::abs(mean(s.off.back())),
              kRadius - kRadius / std::hypot(1, s.fastest() / kRadius * 5e-3), 0.01);
         near(s.exponent([](const Curve& c) { return std::abs(mean(c)); }), 2, 0.02);
       }},
      // ---------------------------------------------------------------------------------- friction
      {"coulomb",
       [](const Shown& s) {  // the force turns over by 2 Fc at the reversals of X
         near(step_at(s.changes_of(Quantity::force).front(), 0).value(), -500, 0.08);
         EXPECT_GT(std::abs(spike_at(s.off.front(), 0).value()), 0.5 * kUm);
         EXPECT_LT(std::abs(spike_at(s.off.front(), kPi / 2).value()), 0.1 * kUm);
       }},
      {"motor_friction",
       [](const Shown& s) {  // the force turns over by 2 Fc; its twist: effects/MotorFriction
         near(step_at(s.changes_of(Quantity::force).front(), 0).value(), -200, 0.08);
       }},
      {"stribeck",
       [](const Shown& s) {  // only slowly: gone where X is fast, there at its reversals
         double fast = 0, slow = 0;
         const Curve force = s.changes_of(Quantity::force).front();
         for (std::size_t i = 0; i < force.size(); ++i) {
           double& most = std::abs(std::sin(force.x[i])) > 0.5 ? fast : slow;
           most = std::max(most, std::abs(force.y[i]));
         }
         EXPECT_GT(slow, 50);
         EXPECT_LT(slow, 200);
         EXPECT_LT(fast, 0.1 * slow);
       }},
      {"viscous",
       [](const Shown& s) {
         near(harmonic(s.off.back(), 1).amplitude(), 2000 * s.fastest(), 0.02);
         near(s.exponent([](const Curve& c) { return harmonic(c, 1).amplitude(); }), 1, 0.02);
       }},
      {"nonlinear_viscous",
       [](const Shown& s) {
         near(s.exponent([](const Curve& c) { return peak_to_peak(c); }), 0.5, 0.06);
       }},
      {"grease_drag",
       [](const Shown& s) {  // at its limit at every feed
         near(peak_to_peak(s.off.back()), 2 * 200, 0.1);
         EXPECT_NEAR(s.exponent([](const Curve& c) { return peak_to_peak(c); }), 0, 0.06);
       }},
      {"presliding",
       [](const Shown& s) {  // half turned over after ln 2 Fc / sigma0 = 6.9 um
         near(travel_to_turn(s.with, s.d.with.passes.front(), kX), std::log(2.0) * 250 / 2.5e7,
              0.25);
         EXPECT_LT(travel_to_turn(s.without, s.d.with.passes.front(), kX), 1 * kUm);
       }},
      {"friction_asymmetry",
       [](const Shown& s) {  // the mean of both directions
         near(0.5 * (mean(s.off.at(0)) + mean(s.off.at(1))), 0.2 * 250, 0.05);
       }},
      {"friction_zone",
       [](const Shown& s) {  // changes its sign with the direction
         near(peak_to_peak(s.off.at(0)), 0.4 * 250, 0.05);
         near(max_abs(s.off.at(0)), 100, 0.06);
         EXPECT_LT(mean(s.off.at(0)) * mean(s.off.at(1)), 0);
       }},
      {"friction_fade",
       [](const Shown& s) {  // the level of the force, where the axis slides
         double ee = 0, ev = 0;
         for (std::size_t k = 2; k < s.with.rows.size(); ++k) {
           const double before = std::abs(s.without.rows[k].force[kX]) * 4e4;
           const auto way = [&](std::size_t i) {
             return s.without.rows[i].q_act[kX] - s.without.rows[i - 1].q_act[kX];
           };
           if (std::abs(way(k)) < 1e-6 || std::abs(way(k) - way(k - 1)) > 1e-9) continue;
           const double change = std::abs(s.with.rows[k].force[kX]) * 4e4 - before;
           const double expected = 250 * 0.3 * std::expm1(-s.with.rows[k].tick * 1e-3 / 10);
           ee += expected * expected;
           ev += expected * change;
         }
         near(ev / ee, 1, 0.1);
       }},
      // --------------------------------------------------------------------------------- mechanics
      {"windup", [](const Shown& s) { near(step(s), 2 * 10e-9 * 50, 0.05); }},
      {"backlash",
       [](const Shown& s) {  // the gap, and what friction winds up the contact
         EXPECT_NEAR(step(s), 10.04 * kUm, 0.25 * kUm);
         EXPECT_LT(step(s, kPi / 2), 0.05 * kUm);
       }},
      {"load_play",
       [](const Shown& s) {
         near(step(s), 8 * kUm, 0.03);
         EXPECT_LT(step(s, kPi / 2), 0.1 * kUm);
       }},
      {"lost_motion", [](const Shown& s) { near(step(s), 2 * 10e-9 * 250, 0.05); }},
      {"structural_mode",
       [](const Shown& s) {  // the response of 35 Hz and 4 % to the acceleration of the scale
         const double w = 2 * kPi * 35, zeta = 0.04;
         double z = 0, dz = 0, ee = 0, ev = 0, vv = 0;
         for (std::size_t k = 1; k + 1 < s.with.rows.size(); ++k) {
           const auto q = [&](std::size_t i) { return s.with.rows[i].q_act[kX]; };
           const double a = (q(k + 1) - 2 * q(k) + q(k - 1)) / 1e-6;
           constexpr int kParts = 50;
           for (int i = 0; i < kParts; ++i) {
             dz += 1e-3 / kParts * (-a - 2 * zeta * w * dz - w * w * z);
             z += 1e-3 / kParts * dz;
           }
           if (!s.with.errors[k + 1].near_piece || !s.without.errors[k + 1].near_piece) continue;
           const double seen = s.with.errors[k + 1].e_n - s.without.errors[k + 1].e_n;
           ee += z * z;
           ev += z * seen;
           vv += seen * seen;
         }
         near(std::abs(ev / ee), 1, 0.05);
         EXPECT_GT(std::abs(ev) / std::sqrt(ee * vv), 0.95);
       }},
      {"weight_imbalance",
       [](const Shown& s) {
         near(mean(s.off.at(0)), -300, 0.02);
         near(mean(s.off.at(1)), -300, 0.02);
       }},
      {"cable_chain",
       [](const Shown& s) {  // k1 x + k3 x^3 held by the drive, the same both ways
         const Curve &out = s.off.at(0), &back = s.off.at(1);
         EXPECT_NEAR(mean_difference(out, back).value(), 0, 0.5);
         near(trend(out).slope, 500, 0.03);
       }},
      {"cross_inertia",
       [](const Shown& s) {
         const double a = s.fastest() * s.fastest() / kRadius;
         near(2 * harmonic(s.off.back(), 2).amplitude(), 2 * kUm * a, 0.02);
         near(s.exponent([](const Curve& c) { return harmonic(c, 2).amplitude(); }), 2, 0.02);
       }},
      {"frame_vibration",
       [](const Shown& s) { near(wave(s.off.front(), 0.020).amplitude(), 1 * kUm, 0.01); }},
      // ------------------------------------------------------------------------- geometry, thermal
      {"scale_error",
       [](const Shown& s) {
         near(std::abs(mean(s.off.front())), kRadius * 100e-6 / 2, 0.01);
         near(harmonic(s.off.front(), 2).amplitude(), kRadius * 100e-6 / 2, 0.01);
       }},
      {"pitch_periodic",
       [](const Shown& s) { near(wave(s.off.front(), 10e-3).amplitude(), 2 * kUm, 0.01); }},
      {"pitch_progressive",
       [](const Shown& s) {  // quadratic and cubic at both ends of the way
         const auto [low, high] =
             std::minmax_element(s.off.front().x.begin(), s.off.front().x.end());
         const auto e = [](double x) { return 5e-4 * x * x + 2.5e-3 * x * x * x; };
         near(peak_to_peak(s.off.front()), std::max(e(*high), e(*low)) - 0, 0.02);
       }},
      {"straightness",
       [](const Shown& s) {  // the wave of 1 um and 100 mm: J1 + J3 of pi/2 in sin 2 phi
         const double z = 2 * kPi * kRadius / 0.1;
         near(harmonic(s.off.front(), 2).amplitude(),
              1 * kUm * (std::cyl_bessel_j(1, z) + std::cyl_bessel_j(3, z)), 0.01);
         near(harmonic(s.off.front(), 3).amplitude(), 5 * kUm / 4 * std::pow(kRadius / 0.1, 2),
              0.02);
       }},
      {"angular_errors",
       [](const Shown& s) {  // across a guide wall: a slope of angle per travel times the arm
         const Curve& c = s.off.front();
         const Trend t = trend(c);
         EXPECT_GT(std::abs(t.slope), 1e-6);
         double left = 0;
         for (std::size_t i = 0; i < c.size(); ++i)
           left = std::max(left, std::abs(c.y[i] - t.offset - t.slope * c.x[i]));
         EXPECT_LT(left, 0.02 * kUm) << "a straight line";
       }},
      {"lateral_play",
       [](const Shown& s) {  // Y jumps by l = 4 um where X reverses: seen half way, at 45 deg
         const auto at = [&](double phi) {
           double best = 9, y = 0;
           for (std::size_t i = 0; i < s.off.front().size(); ++i) {
             const double d = std::abs(std::remainder(s.off.front().x[i] - phi, 2 * kPi));
             if (d < best) best = d, y = s.off.front().y[i];
           }
           return y;
         };
         // Upwards on one half, downwards on the other: the radius gains the same at 90 and 270
         // deg.
         near(std::abs(at(kPi / 2)), 2 * kUm, 0.03);
         near(at(kPi / 2), at(-kPi / 2), 0.03);
         EXPECT_LT(step(s), 0.3 * kUm) << "no step along the axis that reverses";
       }},
      {"squareness",
       [](const Shown& s) {  // the same sign both ways round
         const Wave ccw = harmonic(s.off.at(0), 2), cw = harmonic(s.off.at(1), 2);
         near(ccw.amplitude(), 0.5 * kRadius * 50e-6, 0.01);
         near(cw.sine, ccw.sine, 0.02);
       }},
      {"pivot_length",
       [](const Shown& s) {  // dL sin A on a wall across Y
         const Curve& c = s.off.front();
         const double span = *std::max_element(c.x.begin(), c.x.end());
         near(peak_to_peak(c),
              20 * kUm * (std::sin(span) - std::sin(*std::min_element(c.x.begin(), c.x.end()))),
              0.02);
       }},
      {"rotary_runout",
       [](const Shown& s) { near(peak_to_peak(s.off.front()), 2 * 3 * kUm, 0.02); }},
      {"a_axis_offset",
       [](const Shown& s) {  // |(1 - cos A) s_y, sin A s_z| on one normal: first harmonic |s|
         near(harmonic(s.off.front(), 1).amplitude(), std::hypot(10, 5) * kUm, 0.02);
       }},
      {"a_axis_tilt",
       [](const Shown& s) { EXPECT_GT(harmonic(s.off.front(), 1).amplitude(), 1 * kUm); }},
      {"c_axis_offset",
       [](const Shown& s) {
         near(harmonic(s.off.front(), 1).amplitude(), std::hypot(10, 5) * kUm, 0.01);
       }},
      {"c_axis_tilt",
       [](const Shown& s) {  // once per turn, nothing above
         EXPECT_GT(harmonic(s.off.front(), 1).amplitude(), 1 * kUm);
         EXPECT_LT(harmonic(s.off.front(), 2).amplitude(), 0.05 * kUm);
       }},
      {"thermal_expansion",
       [](const Shown& s) {  // the slope over the position grows by r per time
         const double grown = trend(s.off.back()).slope - trend(s.off.front()).slope;
         const double between =
             s.time_of(s.d.with.passes.back()) - s.time_of(s.d.with.passes.front());
         near(std::abs(grown), 100e-6 / 60 * between, 0.03);
       }},
      {"thermal_warm_up",
       [](const Shown& s) {
         near(std::abs(trend(s.off.back()).slope),
              11.5e-6 * 5 * -std::expm1(-s.time_of(s.d.with.passes.back()) / 60), 0.03);
       }},
      {"thermal_drift",
       [](const Shown& s) {
         const Curve& c = s.off.front();
         near(std::abs(c.y.back() - c.y.front()),
              20 * kUm * (std::exp(-c.x.front() / 60) - std::exp(-c.x.back() / 60)), 0.05);
       }},
      {"ambient_cycle",
       [](const Shown& s) { near(wave(s.off.front(), 20).amplitude(), 4 * kUm, 0.02); }},
      // --------------------------------------------------------------------- probe and acquisition
      {"surface_friction",
       [](const Shown& s) {  // sideways mu times the deflection, turning with the direction
         // The ball's inertia presses it on, the damper of the suspension holds it back.
         const ProbeParams probe;
         const double v = s.d.with.passes.front().feed,
                      mass = probe.moving_mass + probe.stylus_mass;
         const double damper = 2 * probe.damping_ratio * std::sqrt(probe.spring_rate * mass);
         const double expected = 0.15 * (kDeflection + mass * v * v / kRadius / probe.spring_rate) -
                                 damper * v / kRadius * kDeflection / probe.spring_rate;
         double sideways[2] = {};
         for (std::size_t pass = 0; pass < 2; ++pass) {
           std::vector<double> all;
           const Pass& p = s.d.with.passes[pass];
           for (std::size_t k = 0; k < s.with.rows.size(); ++k) {
             const TelemetryRow& row = s.with.rows[k];
             if (row.line < p.first_line || row.line > p.last_line || !s.with.errors[k].near_piece)
               continue;
             const Vec3 along = Vec3::UnitZ().cross(s.with.errors[k].n);
             all.push_back(Vec3(row.deflection.data()).dot(along));
           }
           std::nth_element(all.begin(), all.begin() + static_cast<long>(all.size() / 2),
                            all.end());
           sideways[pass] = all[all.size() / 2];
           near(std::abs(sideways[pass]), expected, 0.003);
         }
         EXPECT_LT(sideways[0] * sideways[1], 0);
       }},
      {"return_to_zero",
       [](const Shown& s) {
         EXPECT_GT(max_abs(s.off.front()), 0.05 * kUm);
         EXPECT_LE(max_abs(s.off.front()), 1.01 * kUm);
       }},
      {"tip_radius", [](const Shown& s) { near(mean(s.off.front()), -5 * kUm, 0.005); }},
      {"tip_lobing",
       [](const Shown& s) { near(harmonic(s.off.front(), 3).amplitude(), 1 * kUm, 0.01); }},
      {"contact_loss",
       [](const Shown& s) {  // the reading falls to zero: off by the predeflection
         std::vector<double> lost;
         for (const Curve& c : s.off)
           for (const double y : c.y)
             if (std::abs(y) > 0.25e-3) lost.push_back(std::abs(y));
         ASSERT_GT(lost.size(), 50u);
         std::nth_element(lost.begin(), lost.begin() + static_cast<long>(lost.size() / 2),
                          lost.end());
         near(lost[lost.size() / 2], kDeflection, 0.1);
       }},
      {"stylus_bending",
       [](const Shown& s) {  // k c / (1 + k c) of the deflection is not seen
         const double kc = 1324 * 10e-6;
         near(std::abs(mean(s.off.front())), kc / (1 + kc) * kDeflection, 0.03);
       }},
      {"probe_gain",
       [](const Shown& s) {
         near(std::abs(mean(s.off.front())), 0.0075 * kDeflection, 0.01);
         near(harmonic(s.off.front(), 2).amplitude(), 0.0025 * kDeflection, 0.01);
       }},
      {"cross_talk",
       [](const Shown& s) {
         near(harmonic(s.off.front(), 2).amplitude(), 0.01 * kDeflection, 0.01);
       }},
      {"probe_drift",
       [](const Shown& s) { near(std::abs(trend(s.off.front()).slope), 2e-6 / 60, 0.01); }},
      {"range_clip",
       [](const Shown& s) {
         double most = 0;
         for (const TelemetryRow& row : s.with.rows)
           most = std::max({most, std::abs(row.deflection[0]), std::abs(row.deflection[1])});
         near(most, 0.4e-3, 1e-4);
       }},
      {"sample_latency",
       [](const Shown& s) {  // -tau times the speed of the reading
         double ee = 0, ev = 0;
         for (std::size_t k = 1; k + 1 < s.without.rows.size(); ++k) {
           const double v =
               (s.without.rows[k].deflection[0] - s.without.rows[k - 1].deflection[0]) / 1e-3;
           ev += v * (s.with.rows[k].deflection[0] - s.without.rows[k].deflection[0]);
           ee += v * v;
         }
         near(ev / ee, -1e-3, 0.1);
       }},
      {"clock_drift",
       [](const Shown& s) {  // the latency grows with the time
         double ee = 0, ev = 0;
         for (std::size_t k = 1; k + 1 < s.without.rows.size(); ++k) {
           const double v =
               (s.without.rows[k + 1].deflection[0] - s.without.rows[k - 1].deflection[0]) / 2e-3;
           const double regressor = v * s.without.rows[k].tick * 1e-3;
           ev += regressor * (s.with.rows[k].deflection[0] - s.without.rows[k].deflection[0]);
           ee += regressor * regressor;
         }
         near(ev / ee, -50e-6, 0.1);
       }},
      {"sample_jitter",
       [](const Shown& s) {  // rms in proportion to the speed of the reading
         double ee = 0, vv = 0;
         for (std::size_t k = 1; k < s.without.rows.size(); ++k) {
           const double v =
               (s.without.rows[k].deflection[0] - s.without.rows[k - 1].deflection[0]) / 1e-3;
           const double e = s.with.rows[k].deflection[0] - s.without.rows[k].deflection[0];
           ee += e * e;
           vv += v * v;
         }
         near(std::sqrt(ee / vv), 5e-6, 0.1);
       }},
      {"signal_phase",
       [](const Shown& s) {
         const Wave w = harmonic(s.reading_over_phase(0), 2);
         near(w.amplitude(), kPerRadian * 2 * kDegree / 2, 0.05);
       }},
      {"signal_gain",
       [](const Shown& s) {
         near(harmonic(s.reading_over_phase(0), 2).sine, kPerRadian * 0.05 / 2, 0.06);
       }},
      {"signal_offset",
       [](const Shown& s) {
         const Wave w = harmonic(s.reading_over_phase(0), 1);
         near(w.cosine, kPerRadian * -0.02, 0.05);
         near(w.sine, kPerRadian * -0.03, 0.05);
       }},
      {"signal_harmonics",
       [](const Shown& s) {
         near(harmonic(s.reading_over_phase(0), 4).amplitude(), kPerRadian * 0.01, 0.06);
       }},
      {"adc_noise",
       [](const Shown& s) { near(scatter(s.off.front()), kPerRadian * 2e-3 / 2.5 / 0.5, 0.06); }},
      {"mains_hum",
       [](const Shown& s) {
         near(wave(s.off.front(), 0.020).amplitude(), kPerRadian * 0.01, 0.05);
       }},
      {"period_slip", [](const Shown& s) { near(peak_to_peak(s.off.front()), kPeriod, 1e-3); }},
      {"dropped_samples",
       [](const Shown& s) {  // two readings exactly equal while the ball moves
         int moving = 0, repeated = 0;
         for (std::size_t k = 1; k < s.without.rows.size(); ++k) {
           if (std::abs(s.without.rows[k].deflection[0] - s.without.rows[k - 1].deflection[0]) <
               0.1e-6)
             continue;
           ++moving;
           repeated += s.with.rows[k].deflection == s.with.rows[k - 1].deflection;
         }
         EXPECT_GT(moving, 100);
         EXPECT_NEAR(static_cast<double>(repeated) / moving, 0.05, 0.04);
       }},
      // ------------------------------------------------------------------------------------ set-up
      {"piece_offset",
       [](const Shown& s) {
         near(harmonic(s.off.front(), 1).amplitude(), std::hypot(20, 10) * kUm, 0.005);
       }},
      {"piece_tilt",
       [](const Shown& s) {  // -n . (t x p) at every place on the path
         const Vec3 t(100e-6, -50e-6, 50e-6);
         double ee = 0, ev = 0, vv = 0;
         for (std::size_t k = 0; k < s.with.rows.size(); ++k) {
           const ErrorSample &a = s.without.errors[k], &b = s.with.errors[k];
           if (!a.near_piece || a.contact != Contact::ok || b.contact != Contact::ok) continue;
           const double expected = -a.n.dot(t.cross(a.theoretical)), seen = b.e_n - a.e_n;
           ee += expected * expected;
           ev += expected * seen;
           vv += seen * seen;
         }
         near(std::abs(ev / ee), 1, 0.03);
         EXPECT_GT(std::abs(ev) / std::sqrt(ee * vv), 0.99);
       }},
  };
  return table;
}

TEST(Signature, EveryEffectHasOne) {
  for (const EffectText* text : all_effect_texts())
    EXPECT_TRUE(checks().contains(std::string(text->name))) << text->name;
  EXPECT_EQ(checks().size(), all_effect_texts().size());
  EXPECT_GE(checks().size(), 35u);
}

class EverySignature : public testing::TestWithParam<const EffectText*> {};

TEST_P(EverySignature, IsAsItsTextSays) {
  const Shown shown(GetParam()->name);
  ASSERT_TRUE(shown.without.clean()) << shown.without.nc.end.reason;
  ASSERT_TRUE(shown.with.clean()) << shown.with.nc.end.reason;
  ASSERT_FALSE(shown.off.empty());
  const auto check = checks().find(std::string(GetParam()->name));
  ASSERT_NE(check, checks().end());
  check->second(shown);
}

INSTANTIATE_TEST_SUITE_P(Library, EverySignature, testing::ValuesIn(all_effect_texts()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace vcnc::signature_test
