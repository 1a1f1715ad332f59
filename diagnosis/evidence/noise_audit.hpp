// What of a record is noise: taken from repetitions, never from a formula.
//
// The laps of one condition differ by noise only. With r_i the residual of lap i of n and m their
// mean, d_i = (r_i - m) sqrt(n/(n-1)) less its straight line has the statistics of the noise. An
// autoregressive filter of order 12 is fitted to all d_i of a channel (Yule-Walker equations,
// solved by Levinson's recursion; Kay, Modern Spectral Estimation, 1988, ch. 7); it whitens:
//
//   z_k = (r_k - sum_j a_j r_{k-j}) / s,   s such that the d_i of the held-out laps have variance 1
//
// so that chi-square per sample is 1 where nothing but noise is left. The beginning of a lap that
// follows something else than the others do (run_in()) is no repetition and tells no noise. A
// disturbance that does not repeat (hum, vibration) belongs to that noise; it is seen as a line in
// the periodogram of d_i, 40 times above the running median.
//
// Rounding by an encoder depends on where the axis is, so it repeats from lap to lap though nobody
// can predict it: a sample of it is added, which counts double what laps do show of it.
//
// A channel can never be quieter than its own step (q^2/12, Widrow 1956), nor than the replica is
// exact. Without repetitions the filter is fitted to the residual itself; s is 1.4826 times the
// median size of what it leaves (the standard deviation if that is normal), which the few moments
// do not change at which an axis turns over. White noise is what such a filter cannot foretell:
// sigma = s / sqrt(1 + sum a_j^2). At first noise is white and of that size, with what encoders
// round off. If what is found leaves more, all is done anew with the filter of that remainder
// (diagnose.cpp): what it can predict from its own past has little weight then. The filter is
// fitted to the residual itself of what was run once, too, though other motions were repeated (the
// way to a circle and back), where that differs from the model by more than the laps do from each
// other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/evidence/partition.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

inline constexpr std::size_t kWhiteningOrder = 12;

/// Linear prediction filter of one channel with the scale of what it leaves.
struct WhiteningFilter {
  std::vector<double> a;  ///< z_k = (r_k - sum_j a[j] r_{k-1-j}) / scale
  double scale = 1;
};

/// Fits a filter to the autocovariances c[0..order] by Levinson's recursion.
WhiteningFilter fit_autoregression(const std::vector<double>& covariance);

/// A periodic disturbance that does not repeat with the laps.
struct NoiseLine {
  ComparedChannel channel;
  double frequency = 0;  ///< [Hz]
  double strength = 0;   ///< power over the running median
  double amplitude = 0;  ///< [SI of the channel]
};

struct ChannelNoise {
  WhiteningFilter filter;
  WhiteningFilter once;  ///< of what was run once; the same where that is no noisier
  double rms = 0;        ///< of the noise [SI]
  /// Variance after the filter of what laps really differ by: 1, or less where the channel counts
  /// as noisier than that.
  double of_laps = 1;
};

struct NoiseAudit {
  std::vector<ChannelNoise> channels;
  std::vector<NoiseLine> lines;
  bool from_repetitions = false;
  std::vector<std::string> warnings;
};

/// What a replica that computes in another order than the machine cannot be better than [SI].
double exactness(const ComparedChannel& channel, const std::vector<double>& residual);

/// The strongest lines of one channel, at most three, where laps of a condition differ.
std::vector<NoiseLine> vibrations(const Record& record, const Partition& partition,
                                  const ComparedChannel& channel,
                                  const std::vector<double>& series);

/// RMS of what laps of a condition differ by; none where no sample is there in several laps.
std::optional<double> lap_scatter(const Partition& partition, const std::vector<double>& series);

/// What a remainder of motions that were not repeated is besides white noise: something to be
/// explained, or noise, too, because what could be explained was taken off.
enum class Coloured { deviation, noise };

/// `residual` is one series per channel, NaN where there is nothing to compare; `rounding`
/// likewise, or empty (Replica::rounding()).
NoiseAudit audit_noise(const Record& record, const Partition& partition,
                       const std::vector<ComparedChannel>& channels,
                       const std::vector<std::vector<double>>& residual,
                       const std::vector<std::vector<double>>& rounding = {},
                       Coloured coloured = Coloured::deviation);

}  // namespace vcnc
