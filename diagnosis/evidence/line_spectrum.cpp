#include "diagnosis/evidence/line_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr Eigen::Index kBinsPerWave = 16;  ///< of the shortest

/// Sums over sines and cosines.
struct WaveSums {
  double ss, cc, sc, zs, zc;

  double power() const {
    const double det = ss * cc - sc * sc;
    return det > 1e-9 * ss * cc ? (zs * zs * cc - 2 * zs * zc * sc + zc * zc * ss) / det : 0;
  }
};

using Spectrum = std::vector<std::complex<double>>;

}  // namespace

Eigen::ArrayXXd line_powers(const Eigen::ArrayXd& position, const Eigen::ArrayXXd& z, double length,
                            const WaveGrid& grid) {
  Eigen::ArrayXXd power(grid.count, z.cols());
  for (Eigen::Index row = 0; row < grid.count; ++row) {
    const Eigen::ArrayXd angle = 2 * kPi * grid.waves(row) / length * position;
    const Eigen::ArrayXd s = angle.sin(), c = angle.cos();
    const double ss = s.square().sum(), cc = c.square().sum(), sc = (s * c).sum();
    for (Eigen::Index i = 0; i < z.cols(); ++i)
      power(row, i) = WaveSums{ss, cc, sc, (z.col(i) * s).sum(), (z.col(i) * c).sum()}.power();
  }
  return power;
}

WaveGrid even_waves(Eigen::Index most) {
  return {.first = 1.5, .apart = 0.5, .count = std::max<Eigen::Index>(0, 2 * most - 2)};
}

Eigen::ArrayXXd line_spectrum(const Eigen::ArrayXd& position, const Eigen::ArrayXXd& z,
                              double length, Eigen::Index most) {
  const WaveGrid grid = even_waves(most);
  Eigen::ArrayXXd power(grid.count, z.cols());
  if (power.size() == 0) return power;
  // Over twice the length, so that half a wave more is a bin.
  Eigen::Index bins = 1;
  while (bins < 2 * kBinsPerWave * most) bins *= 2;
  const double low = position.size() > 0 ? position.minCoeff() : 0;
  std::vector<std::size_t> bin(static_cast<std::size_t>(position.size()));
  for (Eigen::Index k = 0; k < position.size(); ++k)
    bin[static_cast<std::size_t>(k)] =
        static_cast<std::size_t>(
            std::llround((position[k] - low) / (2 * length) * static_cast<double>(bins))) %
        static_cast<std::size_t>(bins);
  Eigen::FFT<double> fft;
  const auto spectrum_of = [&](auto&& value) {
    std::vector<double> gathered(static_cast<std::size_t>(bins), 0.0);
    for (std::size_t k = 0; k < bin.size(); ++k)
      gathered[bin[k]] += value(static_cast<Eigen::Index>(k));
    Spectrum spectrum;
    fft.fwd(spectrum, gathered);
    return spectrum;
  };
  const Spectrum ones = spectrum_of([](Eigen::Index) { return 1.0; });
  for (Eigen::Index i = 0; i < z.cols(); ++i) {
    const Spectrum of_z = spectrum_of([&](Eigen::Index k) { return z(k, i); });
    for (Eigen::Index row = 0; row < grid.count; ++row) {
      const auto n = static_cast<std::size_t>(row + 3);  // of half waves
      const double all = ones[0].real(), twice = ones[2 * n].real();
      power(row, i) = WaveSums{.ss = (all - twice) / 2,
                               .cc = (all + twice) / 2,
                               .sc = -ones[2 * n].imag() / 2,
                               .zs = -of_z[n].imag(),
                               .zc = of_z[n].real()}
                          .power();
    }
  }
  return power;
}

}  // namespace vcnc
