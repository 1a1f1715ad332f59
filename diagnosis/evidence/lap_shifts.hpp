// A piece that does not lie where it lay a lap before.
//
// What shifts a piece by s = (x, y, z) during a lap changes its readings by J s, with J the change
// of the readings per shift at that moment. Temperatures drift, and an axis that stands rests
// anywhere within the step of its encoder, so every lap has a shift of its own; the whitening of
// samples (noise_audit.hpp) knows nothing of what stays for a lap. With shifts of the standard
// deviation tau, U = W J tau and W that whitening, the noise of a lap has the covariance 1 + U U^T.
// It is whitened by
//
//   (1 + U U^T)^(-1/2) = 1 - sum_i v_i v_i^T (1 - 1/sqrt(1 + l_i)) / l_i
//
// with v_i the columns of U turned to the axes of U^T U and l_i = v_i^T v_i (random effects: Laird,
// Ware, Biometrics 38 (1982) 963).
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// The piece shifted in x, y, z; the tool centre shifted along X, Y, Z, each [m].
std::vector<Machine> with_piece_shifted(const Machine& machine, double by);
std::vector<Machine> with_axes_shifted(const Machine& machine, double by);
/// With readings 0.1 ms older: what those of a module differ by whose clock is not the machine's.
Machine with_older_readings(const Machine& machine);

/// RMS over the laps of the shifts in x, y, z that explain `series` best beside such that grow
/// during a lap, in the unit that the three `per_shift` are per; laps count by how well they tell.
Eigen::Vector3d rms_shift(const std::vector<Stretch>& laps,
                          const std::vector<SeriesOfChannels>& per_shift,
                          const SeriesOfChannels& series);

/// Takes out of every lap what shifts make of it, any number of them: constant ones, and with
/// `growing` such that grow during it, too. They are fitted where all laps of a condition have
/// readings, if those are most: what is no shift and the same in all laps (play, friction) is taken
/// for the same shift then, and laps do not differ by it.
enum class Shifts { constant, growing };
void take_out_shifts(const std::vector<Stretch>& laps,
                     const std::vector<SeriesOfChannels>& per_shift, SeriesOfChannels& series,
                     Shifts shifts = Shifts::growing);

/// Whitens what a shift makes of a lap.
class ShiftWhitening {
 public:
  using Channels = std::vector<std::vector<float>>;

  ShiftWhitening() = default;
  /// `per_shift`: what standard deviations of the shifts in x, y, z make of whitened channels; a
  /// channel may be empty.
  ShiftWhitening(std::vector<Stretch> laps, const std::vector<Channels>& per_shift);
  /// Of whitened channels, where an empty one is zero.
  void apply(Channels& z) const;

 private:
  std::vector<Stretch> laps_;
  std::vector<std::size_t> channels_;     ///< that a shift changes
  std::vector<Eigen::MatrixXf> vectors_;  ///< per lap: samples of these channels in rows
};

}  // namespace vcnc
