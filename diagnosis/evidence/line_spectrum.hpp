// Lines of signals over the position of an axis.
//
// Of a column z, n waves per length L explain, by least squares with s = sin(2 pi n x/L) and
// c = cos(2 pi n x/L) (Lomb 1976, Astrophys. Space Sci. 39, 447),
//
//   P = (zs^2 cc - 2 zs zc sc + zc^2 ss) / (ss cc - sc^2),   ss = sum s s, zs = sum z s, ...
//
// For many n at once these sums are Fourier transforms of z and of the number of samples over the
// position, gathered in bins (Press and Rybicki 1989, Astrophys. J. 338, 277). A bin is 1/16 of the
// shortest wave at most, so that 0.7 % of the power of the shortest is lost at most.
#pragma once

#include <Eigen/Dense>

namespace vcnc {

/// Numbers of waves per length: `first`, `first + apart`, ...
struct WaveGrid {
  double first = 1, apart = 1;
  Eigen::Index count = 1;

  double waves(Eigen::Index i) const { return first + apart * static_cast<double>(i); }
};

/// What sine and cosine over `position` explain of each column of `z`, in squares of z: a row per
/// number of waves in `length`.
Eigen::ArrayXXd line_powers(const Eigen::ArrayXd& position, const Eigen::ArrayXXd& z, double length,
                            const WaveGrid& grid);

/// Half a bin apart.
WaveGrid even_waves(Eigen::Index most);

/// The same for all of even_waves(most).
Eigen::ArrayXXd line_spectrum(const Eigen::ArrayXd& position, const Eigen::ArrayXXd& z,
                              double length, Eigen::Index most);

}  // namespace vcnc
