// A machine simple enough that the right answer is known in closed form: two axes on circles and
// lines, signals that are sums of known functions of the command, and white noise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/math.hpp"
#include "model/probe/noise.hpp"

namespace vcnc::toy {

inline constexpr double kPositionNoise = 50e-9, kForceNoise = 2.0, kProbeNoise = 100e-9;

/// Three conditions of `laps` repetitions: circle forwards, circle backwards at another feed, and a
/// line of X there and back; `lap` samples each.
inline Record commands(std::size_t lap, int laps) {
  Record record;
  record.source = "toy";
  std::vector<double> x, y;
  for (int condition = 0; condition < 3; ++condition) {
    for (int i = 0; i < laps; ++i) {
      const std::size_t begin = x.size();
      const double turns = condition == 1 ? -2 : 1;
      for (std::size_t k = 0; k < lap; ++k) {
        const double angle = 2 * kPi * turns * static_cast<double>(k) / static_cast<double>(lap);
        x.push_back(0.03 * std::cos(angle) + (condition == 2 ? 0.02 * std::cos(2 * angle) : 0));
        y.push_back(condition == 2 ? 0 : 0.03 * std::sin(angle));
      }
      record.stretches.push_back({begin, x.size(), condition, i, ""});
    }
  }
  record.signals.push_back({SignalKind::command, 0, "qx", x, 0});
  record.signals.push_back({SignalKind::command, 1, "qy", y, 0});
  return record;
}

/// Following error of X, force of X, and the probe's x:
///
///   e_x = -t_d v                        command_delay
///   F_x = m a + F_c s(v) + k v          load (declared 500 kg), coulomb, viscous
///   d_x = e_x + eps q_x + alpha q_y     scale_error, squareness
///         + w/2 s(v) + A sin(2 pi q/p + psi) + o    load_play, pitch_periodic, piece_offset
///         + laws of the displacement of X + a slip of the period counter, up to range_clip
class ToyReplica : public Replica {
 public:
  explicit ToyReplica(const Record& commands) : commands_(commands) {
    channels_ = {{SignalKind::position, 0}, {SignalKind::force, 0}, {SignalKind::deflection, 0}};
  }
  const std::vector<ComparedChannel>& channels() const override { return channels_; }

  Prediction predict(const Machine& m) const override {
    const std::vector<double>& x = commands_.find(SignalKind::command, 0)->value;
    const std::vector<double>& y = commands_.find(SignalKind::command, 1)->value;
    const auto& e = m.effects.axis[0];
    const double delay = e.get<CommandDelay>().delay, coulomb = e.get<Coulomb>().level;
    const double viscous = e.get<Viscous>().coefficient, scale = e.get<ScaleError>().error;
    const double play = e.get<LoadPlay>().width, xy = m.effects.get<Squareness>().xy;
    const PitchPeriodic& pitch = e.get<PitchPeriodic>();
    const double offset = m.effects.get<PieceOffset>().shift.x();
    const PeriodSlip& slip = m.effects.get<PeriodSlip>();
    const RangeClip& clip = m.effects.get<RangeClip>();
    std::vector<std::vector<double>> all(3, std::vector<double>(x.size()));
    for (std::size_t k = 0; k < x.size(); ++k) {
      const std::size_t before = k > 0 ? k - 1 : k, after = k + 1 < x.size() ? k + 1 : k;
      const double h = commands_.period;
      const double v = (x[after] - x[before]) / (2 * h);
      const double a = (x[after] - 2 * x[k] + x[before]) / (h * h);
      const double s = std::tanh(v / 1e-3);
      const bool jump = std::abs(a) > 100;  // between laps of another motion
      all[0][k] = x[k] - (jump ? 0 : delay * v);
      all[1][k] = jump ? 0 : m.axes[0].mechanics.load * a + coulomb * s + viscous * v;
      all[2][k] =
          (jump ? 0 : -delay * v) + scale * x[k] + xy * y[k] + 0.5 * play * s + offset +
          (pitch.null() ? 0
                        : pitch.amplitude * std::sin(2 * kPi * x[k] / pitch.period + pitch.phase));
      Motions<double> motions{};
      motions[0] = {x[k], v, a};
      motions[1] = {y[k], k > 0 ? (y[k] - y[k - 1]) / h : 0, 0};
      for (const Law& law : m.effects.laws)
        if (law.point == Law::Point::displacement && law.axis == Law::OfAxis::X)
          all[2][k] += law(static_cast<double>(k) * h, motions);
      if (static_cast<double>(k) * h + 0.5 * h >= slip.start)
        all[2][k] += slip.periods * m.probe.signal_period;
      if (clip.limit > 0) all[2][k] = std::clamp(all[2][k], -clip.limit, clip.limit);
    }
    return {all.begin(), all.end()};
  }

 private:
  const Record& commands_;
  std::vector<ComparedChannel> channels_;
};

/// The declared machine with other numbers: key and value, in the unit of the key.
inline Machine machine(const std::vector<std::pair<std::string, double>>& numbers) {
  Machine m;
  for (const auto& [key, value] : numbers) move_number(m, key, value);
  return m;
}

/// What `truth` would have measured, with white noise.
inline void measure(Record& record, const Machine& truth, std::uint64_t seed) {
  const ToyReplica replica(record);
  const Prediction clean = replica.predict(truth);
  std::vector<std::vector<double>> all(clean.begin(), clean.end());
  const double noise[] = {kPositionNoise, kForceNoise, kProbeNoise};
  std::erase_if(record.signals, [](const auto& s) { return s.kind != SignalKind::command; });
  for (std::size_t c = 0; c < all.size(); ++c) {
    for (std::size_t k = 0; k < all[c].size(); ++k)
      all[c][k] += noise[c] * gaussian_noise(seed, c, k)[0];
    record.signals.push_back({replica.channels()[c].kind, 0, "", all[c], 0});
  }
}

inline std::vector<Candidate> candidates() {
  const auto one = [](const char* effect, const char* place, const char* key, double typical,
                      double min, double max) {
    return Candidate{
        effect,
        place,
        {{std::string("effects.") + place + "." + effect + "." + key, typical, min, max, min == 0}},
        {}};
  };
  std::vector<Candidate> all{one("command_delay", "X", "delay_ms", 0.2, 0, 5),
                             one("coulomb", "X", "level_N", 250, 0, 1e5),
                             one("viscous", "X", "coefficient_Ns_per_m", 2000, 0, 1e6),
                             one("scale_error", "X", "error_ppm", 100, -1e4, 1e4),
                             one("load_play", "X", "width_um", 8, 0, 2000),
                             one("squareness", "geometry", "xy_urad", 50, -5000, 5000),
                             one("cable_chain", "X", "stiffness_N_per_mm", 0.5, -1000, 1000)};
  Candidate pitch = one("pitch_periodic", "X", "amplitude_um", 2, 0, 1000);
  pitch.numbers.push_back({"effects.X.pitch_periodic.period_mm", 10, 0.001, 1e4});
  pitch.numbers.push_back({"effects.X.pitch_periodic.phase_deg", 0, -360, 360});
  pitch.shape = {1, 2};
  all.push_back(pitch);
  return all;
}

}  // namespace vcnc::toy
