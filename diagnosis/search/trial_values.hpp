// Which shapes of a candidate are worth trying on a record.
//
//   wavelength of an axis effect   lines of the residual over the axis' position: least squares of
//                                  sine and cosine at every trial wavelength (Lomb 1976), the
//                                  strongest three; and the typical one
//   frequency                      lines that do not repeat (noise audit), those of the residual
//                                  of the readings that stand out most, and the typical one
//   time constant                  0.1, 0.3, 1 and 3 times the length of the run
//   period in time                 half a wave in the run to five, a quarter apart
//   place along an axis            eight across the travel
//   instant                        where the residual jumps most
//   exponent, edge, ...            the typical value, an exponent also above 1
#pragma once

#include <vector>

#include "diagnosis/search/evidence.hpp"
#include "diagnosis/search/trial.hpp"

namespace vcnc {

class TrialValuesOf {
 public:
  /// `evidence` must outlive this.
  TrialValuesOf(const Evidence& evidence, const Machine& machine, const Column& residual);

  std::vector<double> operator()(const Candidate& candidate, std::size_t number) const;

 private:
  std::vector<double> find_wavelengths(std::size_t axis, const Column& residual) const;
  double find_jump(const Column& residual) const;
  std::vector<double> find_ringing(const Column& residual) const;
  double largest_reading() const;  ///< of the probe [m]

  const Evidence& evidence_;
  std::vector<double> travel_per_turn_;  ///< per axis, of its motor [m or rad]
  double duration_ = 0;
  std::vector<std::vector<double>> wavelengths_;  ///< per axis [m or rad]
  double jump_ = 0;                               ///< [s]
  std::vector<double> ringing_;                   ///< [Hz]
};

/// Power that sine and cosine of wavelength w over `position` explain of `z`, in squares of z.
double line_power(const std::vector<double>& position, const std::vector<double>& z, double w);

}  // namespace vcnc
