// Correction of sine/cosine signals: the ellipse they draw is fitted and turned back into a circle.
//
//   u = R1 cos phi + p,   w = R2 sin(phi - alpha) + q          [V]
//   A u^2 + B w^2 + C u w + D u + E w = 1                      least squares over the samples
//   alpha = asin(C / sqrt(4AB)),  k = sqrt(B/A) = R1/R2
//   p = (2BD - EC) / (C^2 - 4AB),  q = (2AE - DC) / (C^2 - 4AB)
//   R1 = sqrt(4B (1 + A p^2 + B q^2 + C p q) / (4AB - C^2))
//   u' = u - p,   w' = ((u - p) sin alpha + k (w - q)) / cos alpha,   phi = atan2(w', u')
// Uncorrected, phi is off by (q cos phi - p sin phi)/R1 + ((R2-R1)/R1) sin(2 phi)/2 - alpha cos^2
// phi. Valid for errors that stay constant over the samples, |alpha| < 90 deg, a radial noise of a
// few per cent; a fit is refused when 4AB <= C^2, R1 is outside 0.3..0.6 V, the rms radial residual
// exceeds 2 % of R1, or a sector of 30 deg holds no sample. Source: Heydemann, Applied Optics 20
// (1981) 3382.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

namespace vcnc {

/// One sample of both signals [V].
struct SinCos {
  double u = 0, w = 0;
};

/// The ellipse of a pair of signals. The default is the ideal circle of a 1 Vpp signal.
struct Lissajous {
  double amplitude = 0.5;  ///< R1 [V]
  double gain = 1;         ///< k = R1 / R2
  double p = 0, q = 0;     ///< offsets [V]
  double alpha = 0;        ///< quadrature error [rad]

  /// The signals of phase phi.
  SinCos signals(double phi) const;
  /// (u', w'): on the circle of radius `amplitude` again.
  SinCos corrected(const SinCos& raw) const;
};

enum class FitVerdict { good, too_few, no_coverage, no_ellipse, amplitude, residual };

struct LissajousFit {
  FitVerdict verdict = FitVerdict::too_few;
  Lissajous ellipse;    ///< counts when the verdict is good
  double residual = 0;  ///< rms radial distance over R1
};

/// Sums of a fit, built up sample by sample without memory of the samples.
class LissajousSums {
 public:
  static constexpr int kSectors = 12;

  void add(const SinCos& sample);
  int count() const { return count_; }
  LissajousFit fit() const;

 private:
  Eigen::Matrix<double, 5, 5> normal_ = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right_ = Eigen::Matrix<double, 5, 1>::Zero();
  int count_ = 0;
  std::array<int, kSectors> sector_{};
};

/// Fit over a batch of at least 50 samples.
LissajousFit fit_lissajous(std::span<const SinCos> samples);

/// Passes signals through until enough of the ellipse has been seen, then corrects them. It takes
/// the same number of samples from every sector, so that a probe at rest does not outweigh one that
/// moves. A fit that is refused starts the collection anew.
class OnlineCorrector {
 public:
  /// The samples corrected by what is known so far.
  SinCos correct(const SinCos& raw);
  /// The ellipse in use, once there is one.
  const std::optional<Lissajous>& ellipse() const { return ellipse_; }
  int refused() const { return refused_; }

 private:
  static constexpr int kPerSector = 20;

  LissajousSums sums_;
  std::array<int, LissajousSums::kSectors> taken_{};
  int full_sectors_ = 0;
  int refused_ = 0;
  std::optional<Lissajous> ellipse_;
};

}  // namespace vcnc
