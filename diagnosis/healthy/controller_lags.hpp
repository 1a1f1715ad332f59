// Lags of the loops of a healthy machine, which hardly anybody can declare.
//
// How late a position loop acts, a velocity is measured and a feed-forward comes depends on cycles
// and filters of a drive. Where it is not as declared, a position is off by what no force makes
// (controller_check.hpp), in proportion to speed and acceleration, and what that hides is put down
// to something else. (A velocity that is measured late puts an axis ahead by a tau / Kv where it
// accelerates, a feed-forward that is late behind by as much: what both leave is what counts.) Lags
// are fitted to nothing but r of the healthy run, by least squares, so that friction has no say:
//
//   min | r - sum_i d r / d tau_i  (tau_i - tau_i declared) |^2,   0 <= tau_i <= 4 ms
//
// and are kept where they take half of its mean square at least and that is more than noise: first
// those of velocity and feed-forward, then a lag of the set-point of the position loop, too, or a
// delay of the command in its place that leaves less than it does, where it leaves a quarter of
// what these do, and so that of the position loop itself (with full feed-forward it has next to
// nothing to be late with). A set-point that waits for the feed-forward (balancing filter) by tau
// puts the axis behind by v tau and is, in one run, a velocity feed-forward that is Kv tau less: of
// a healthy machine the gain is believed, which somebody has set. Without feed-forward nothing has
// to wait, and of these two none is sought. Gains stay as declared. None is fitted of a sampled
// controller, whose lags are another number, nor where command, position or force of an axis is not
// recorded.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "diagnosis/records/record.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// A lag of a cascade.
struct LoopLag {
  double ServoParams::*value;  ///< [s]
  std::string_view key, of;    ///< "position_lag_us", "the position loop"
};
inline constexpr std::array<LoopLag, 4> kLoopLags{
    LoopLag{&ServoParams::position_lag, "position_lag_us", "the position loop"},
    LoopLag{&ServoParams::setpoint_lag, "setpoint_lag_us", "the set-point of the position loop"},
    LoopLag{&ServoParams::velocity_lag, "velocity_lag_us", "the measured velocity"},
    LoopLag{&ServoParams::feedforward_lag, "feedforward_lag_us", "the feed-forward"}};

/// Lags of an axis that are others, "the position loop 250 -> 0 us, the feed-forward 0 -> 480 us";
/// empty: none. Those that went as far as is sought say so.
std::string told_lags(const Machine& was, const Machine& is, std::size_t axis);

/// The declared machine with the lags of its loops as a healthy run has them.
Machine with_lags_of(const Record& healthy, const Machine& declared);

}  // namespace vcnc
