#include "diagnosis/evidence/lap_shifts.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "diagnosis/candidates/freed_number.hpp"
#include "model/probe/probe_sensor.hpp"

namespace vcnc {
namespace {

/// What each shift makes of one sample: constant ones, then growing ones if there is room.
void fill_row(const std::vector<SeriesOfChannels>& per_shift, const Stretch& lap, std::size_t c,
              std::size_t k, Eigen::VectorXd& x) {
  const double t = static_cast<double>(k - lap.begin) / static_cast<double>(lap.end - lap.begin);
  const std::size_t n = per_shift.size();
  for (std::size_t j = 0; j < n; ++j) {
    const double d = std::isfinite(per_shift[j][c][k]) ? per_shift[j][c][k] : 0;
    x[static_cast<Eigen::Index>(j)] = d;
    const auto grown = static_cast<Eigen::Index>(n + j);
    if (grown < x.size()) x[grown] = d * (t - 0.5);
  }
}

struct LapShift {
  Eigen::VectorXd shift;
  Eigen::VectorXd weight;  ///< sum of squares of what each makes of the lap
};

/// Per channel and sample of a lap, counted from its beginning.
using LapFlags = std::vector<std::vector<char>>;

/// Where all laps of each condition have readings.
std::map<int, LapFlags> read_in_all(const std::vector<Stretch>& laps,
                                    const SeriesOfChannels& series) {
  std::map<int, LapFlags> all;
  for (const Stretch& lap : laps) {
    const std::size_t length = lap.end - lap.begin;
    LapFlags& flags =
        all.try_emplace(lap.condition, series.size(), std::vector<char>(length, 1)).first->second;
    for (std::size_t c = 0; c < series.size(); ++c) {
      flags[c].resize(std::min(flags[c].size(), length));
      for (std::size_t i = 0; i < flags[c].size(); ++i)
        flags[c][i] = flags[c][i] && std::isfinite(series[c][lap.begin + i]);
    }
  }
  return all;
}

/// Whether most of what is known of a lap is known of all of its condition.
bool mostly_in_all(const Stretch& lap, const LapFlags& in_all, const SeriesOfChannels& series) {
  constexpr double kMost = 0.5;
  double known = 0, shared = 0;
  for (std::size_t c = 0; c < series.size(); ++c) {
    for (std::size_t k = lap.begin; k < lap.end; ++k) known += std::isfinite(series[c][k]);
    shared += static_cast<double>(std::count(in_all[c].begin(), in_all[c].end(), 1));
  }
  return shared > kMost * known;
}

/// By all that is known of the lap, or `only` by some samples.
LapShift shift_of(const Stretch& lap, const std::vector<SeriesOfChannels>& per_shift,
                  const SeriesOfChannels& series, Shifts shifts = Shifts::growing,
                  const LapFlags* only = nullptr) {
  const auto columns =
      static_cast<Eigen::Index>((shifts == Shifts::growing ? 2 : 1) * per_shift.size());
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd with_series = Eigen::VectorXd::Zero(columns), x(columns);
  for (std::size_t c = 0; c < series.size(); ++c) {
    if (per_shift[0][c].empty()) continue;
    const std::size_t end = only ? lap.begin + (*only)[c].size() : lap.end;
    for (std::size_t k = lap.begin; k < end; ++k) {
      if (!std::isfinite(series[c][k]) || (only && !(*only)[c][k - lap.begin])) continue;
      fill_row(per_shift, lap, c, k, x);
      products.noalias() += x * x.transpose();
      with_series += x * series[c][k];
    }
  }
  const Eigen::VectorXd weight = products.diagonal();
  products.diagonal().array() += 1e-9 * products.diagonal().maxCoeff() + 1e-300;
  return {products.ldlt().solve(with_series), weight};
}

}  // namespace

std::vector<Machine> with_piece_shifted(const Machine& machine, double by) {
  std::vector<Machine> all;
  for (const char* key :
       {"effects.setup.piece_offset.shift_um.x", "effects.setup.piece_offset.shift_um.y",
        "effects.setup.piece_offset.shift_um.z"}) {
    all.push_back(machine);
    move_number(all.back(), key, number_of(machine, key) + by * 1e6);
  }
  return all;
}

std::vector<Machine> with_axes_shifted(const Machine& machine, double by) {
  std::vector<Machine> all;
  for (const Law::OfAxis axis : {Law::OfAxis::X, Law::OfAxis::Y, Law::OfAxis::Z}) {
    Law shift;
    shift.axis = axis;
    shift.point = Law::Point::displacement;
    shift.at = {0, 1};
    shift.value = {by, by};
    all.push_back(machine);
    all.back().effects.laws.push_back(std::move(shift));
  }
  return all;
}

Machine with_older_readings(const Machine& machine) {
  Machine older = machine;
  older.effects.get<SampleLatency>().latency += kProbeSampleTime;
  return older;
}

Eigen::Vector3d rms_shift(const std::vector<Stretch>& laps,
                          const std::vector<SeriesOfChannels>& per_shift,
                          const SeriesOfChannels& series) {
  Eigen::Array3d sum = Eigen::Array3d::Zero(), weights = Eigen::Array3d::Constant(1e-300);
  for (const Stretch& lap : laps) {
    const LapShift s = shift_of(lap, per_shift, series);
    sum += s.weight.head<3>().array() * s.shift.head<3>().array().square();
    weights += s.weight.head<3>().array();
  }
  return (sum / weights).sqrt();
}

void take_out_shifts(const std::vector<Stretch>& laps,
                     const std::vector<SeriesOfChannels>& per_shift, SeriesOfChannels& series,
                     Shifts shifts) {
  const std::map<int, LapFlags> read = read_in_all(laps, series);
  for (const Stretch& lap : laps) {
    const LapFlags& in_all = read.at(lap.condition);
    const bool alike = mostly_in_all(lap, in_all, series);
    const Eigen::VectorXd shift =
        shift_of(lap, per_shift, series, shifts, alike ? &in_all : nullptr).shift;
    Eigen::VectorXd x(shift.size());
    for (std::size_t c = 0; c < series.size(); ++c) {
      if (per_shift[0][c].empty()) continue;
      for (std::size_t k = lap.begin; k < lap.end; ++k) {
        fill_row(per_shift, lap, c, k, x);
        series[c][k] -= shift.dot(x);
      }
    }
  }
}

ShiftWhitening::ShiftWhitening(std::vector<Stretch> laps, const std::vector<Channels>& per_shift)
    : laps_(std::move(laps)) {
  std::set<std::size_t> changed;
  for (const Channels& column : per_shift)
    for (std::size_t c = 0; c < column.size(); ++c)
      if (!column[c].empty()) changed.insert(c);
  channels_.assign(changed.begin(), changed.end());
  for (const Stretch& lap : laps_) {
    const std::size_t length = lap.end - lap.begin;
    Eigen::MatrixXf u = Eigen::MatrixXf::Zero(static_cast<Eigen::Index>(length * channels_.size()),
                                              static_cast<Eigen::Index>(per_shift.size()));
    for (std::size_t j = 0; j < per_shift.size(); ++j)
      for (std::size_t i = 0; i < channels_.size(); ++i) {
        const std::vector<float>& from = per_shift[j][channels_[i]];
        if (from.empty()) continue;
        for (std::size_t k = 0; k < length; ++k)
          u(static_cast<Eigen::Index>(i * length + k), static_cast<Eigen::Index>(j)) =
              from[lap.begin + k];
      }
    const Eigen::MatrixXd products = (u.transpose() * u).cast<double>();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(products);
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(products.rows());
    for (Eigen::Index i = 0; i < scale.size(); ++i)
      if (const double l = axes.eigenvalues()[i]; l > 1e-9)
        scale[i] = std::sqrt((1 - 1 / std::sqrt(1 + l)) / l);
    vectors_.push_back(u * (axes.eigenvectors() * scale.asDiagonal()).cast<float>());
  }
}

void ShiftWhitening::apply(Channels& z) const {
  const auto is_empty = [&](std::size_t c) { return z[c].empty(); };
  if (std::all_of(channels_.begin(), channels_.end(), is_empty)) return;
  const auto some =
      std::find_if(z.begin(), z.end(), [](const std::vector<float>& c) { return !c.empty(); });
  for (const std::size_t c : channels_) z[c].resize(some->size(), 0.0F);
  for (std::size_t n = 0; n < laps_.size(); ++n) {
    const auto length = static_cast<Eigen::Index>(laps_[n].end - laps_[n].begin);
    const auto part = [&](std::size_t i) {
      return Eigen::Map<Eigen::VectorXf>(&z[channels_[i]][laps_[n].begin], length);
    };
    Eigen::VectorXf along = Eigen::VectorXf::Zero(vectors_[n].cols());
    for (std::size_t i = 0; i < channels_.size(); ++i)
      along += vectors_[n].middleRows(static_cast<Eigen::Index>(i) * length, length).transpose() *
               part(i);
    for (std::size_t i = 0; i < channels_.size(); ++i)
      part(i) -= vectors_[n].middleRows(static_cast<Eigen::Index>(i) * length, length) * along;
  }
}

}  // namespace vcnc
