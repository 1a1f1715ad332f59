// Which shapes of a candidate are worth trying on a record.
//
//   wavelength of an axis effect   lines of the residual over the axis' position down to 1/2000 of
//                                  the travel, or to four samples (line_spectrum.hpp), the
//                                  strongest three that are worth it; those of effects that were
//                                  found; and the typical one
//   frequency                      lines that do not repeat (noise audit), those of the residual
//                                  of the readings that stand out most, and the typical one
//   time constant                  0.1, 0.3, 1 and 3 times the length of the run
//   period in time                 half a wave in the run to five, a quarter apart
//   place along an axis            eight across the travel
//   instant                        where the residual jumps most
//   exponent, edge, ...            the typical value, an exponent also above 1
#pragma once

#include <vector>

#include "diagnosis/candidates/trial.hpp"
#include "diagnosis/evidence/evidence.hpp"

namespace vcnc {

class TrialValuesOf {
 public:
  /// Lines over an axis' position that explain less than `least_gain` of the chi-square of every
  /// channel are left out. `evidence` must outlive this.
  TrialValuesOf(const Evidence& evidence, const Machine& machine, const Column& residual,
                double least_gain);

  std::vector<double> operator()(const Candidate& candidate, std::size_t number) const;

  /// Takes what is as good as the same in `known` from there, so that only what is new differs.
  void follow(const TrialValuesOf& known);

  /// Adds the wavelength that an effect was found with.
  void add_found(const Candidate& candidate, const std::vector<FreedNumber>& numbers);

 private:
  std::vector<double> find_wavelengths(std::size_t axis, const Column& residual,
                                       double least_gain) const;
  double find_jump(const Column& residual) const;
  std::vector<double> find_ringing(const Column& residual) const;
  double largest_reading() const;  ///< of the probe [m]

  const Evidence* evidence_;
  std::vector<double> travel_per_turn_;  ///< per axis, of its motor [m or rad]
  double duration_ = 0;
  std::vector<double> travel_;                    ///< per axis, of its command [m or rad]
  std::vector<std::vector<double>> wavelengths_;  ///< per axis [m or rad]
  double jump_ = 0;                               ///< [s]
  std::vector<double> ringing_;                   ///< [Hz]
};

}  // namespace vcnc
