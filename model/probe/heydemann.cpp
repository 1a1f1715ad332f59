#include "model/probe/heydemann.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr int kFewest = 50;
constexpr double kLeastAmplitude = 0.3, kMostAmplitude = 0.6;  // [V]
constexpr double kMostResidual = 0.02;                         // of R1

std::size_t sector_of(double u, double w) {
  const double share = std::atan2(w, u) / (2 * kPi) + 0.5;  // 0..1
  return std::min(static_cast<std::size_t>(share * LissajousSums::kSectors),
                  std::size_t{LissajousSums::kSectors - 1});
}

}  // namespace

SinCos Lissajous::signals(double phi) const {
  return {amplitude * std::cos(phi) + p, amplitude / gain * std::sin(phi - alpha) + q};
}

SinCos Lissajous::corrected(const SinCos& raw) const {
  const double u = raw.u - p;
  return {u, (u * std::sin(alpha) + gain * (raw.w - q)) / std::cos(alpha)};
}

void LissajousSums::add(const SinCos& sample) {
  const auto [u, w] = sample;
  Eigen::Matrix<double, 5, 1> row;
  row << u * u, w * w, u * w, u, w;
  normal_ += row * row.transpose();
  right_ += row;
  ++count_;
  ++sector_[sector_of(u, w)];
}

LissajousFit LissajousSums::fit() const {
  LissajousFit result;
  if (count_ < kFewest) return result;
  const auto refuse = [&](FitVerdict why) {
    result.verdict = why;
    return result;
  };
  if (*std::min_element(sector_.begin(), sector_.end()) == 0)
    return refuse(FitVerdict::no_coverage);

  const Eigen::Matrix<double, 5, 1> x = normal_.ldlt().solve(right_);
  const double A = x[0], B = x[1], C = x[2], D = x[3], E = x[4];
  const double shape = 4 * A * B - C * C;
  if (!(A > 0 && shape > 0)) return refuse(FitVerdict::no_ellipse);

  Lissajous& e = result.ellipse;
  e.alpha = std::asin(C / std::sqrt(4 * A * B));
  e.gain = std::sqrt(B / A);
  e.p = (2 * B * D - E * C) / -shape;
  e.q = (2 * A * E - D * C) / -shape;
  const double level = 1 + A * e.p * e.p + B * e.q * e.q + C * e.p * e.q;
  e.amplitude = std::sqrt(4 * B * level / shape);
  if (!(e.amplitude >= kLeastAmplitude && e.amplitude <= kMostAmplitude))
    return refuse(FitVerdict::amplitude);

  // Sum of (algebraic residual)^2 from the sums; a radial distance dr changes the form by 2 level
  // dr / R1.
  const double sum = x.dot(normal_ * x) - 2 * x.dot(right_) + count_;
  result.residual = std::sqrt(std::max(sum, 0.0) / count_) / (2 * level);
  if (result.residual > kMostResidual) return refuse(FitVerdict::residual);
  return refuse(FitVerdict::good);
}

LissajousFit fit_lissajous(std::span<const SinCos> samples) {
  LissajousSums sums;
  for (const SinCos& sample : samples) sums.add(sample);
  return sums.fit();
}

SinCos OnlineCorrector::correct(const SinCos& raw) {
  if (ellipse_) return ellipse_->corrected(raw);
  int& taken = taken_[sector_of(raw.u, raw.w)];
  if (taken < kPerSector) {
    sums_.add(raw);
    if (++taken == kPerSector) ++full_sectors_;
  }
  if (full_sectors_ < LissajousSums::kSectors) return raw;
  if (const LissajousFit fit = sums_.fit(); fit.verdict == FitVerdict::good) {
    ellipse_ = fit.ellipse;
    return ellipse_->corrected(raw);
  }
  sums_ = {};
  taken_ = {};
  full_sectors_ = 0;
  ++refused_;
  return raw;
}

}  // namespace vcnc
