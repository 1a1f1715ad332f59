// What laws without a name change, to first order.
//
// The closed loop answers a force by a convolution and a displacement at once, so that one pulse
// and one constant law per axis, simulated, give what any law y(t) does to every channel:
//
//   force         y * h, h the answer to a pulse where the axis moves fastest
//   displacement  y times what a displacement of 1 does
//   reading       y
//
// Known limit: a law that only acts while an axis sticks is not linear.
#pragma once

#include <functional>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "model/effects/law.hpp"

namespace vcnc {

class LawColumns {
 public:
  /// Both must live as long.
  LawColumns(const Evidence& evidence, const FittedMachine& at);

  /// All laws that are tried but for jumps, without values: ten knots from one end of what the
  /// covariate takes to the other.
  std::vector<Law> all() const;
  /// Jumps in time of the displacement of axes and of readings, each where `gain` of it is largest.
  std::vector<Law> jumps(const std::function<double(const Law&)>& gain) const;
  /// What a law with its values changes, per channel; empty: nothing. To first order, whitened.
  Column column(const Law& law) const;
  /// The same of every knot alone, its value 1.
  std::vector<Column> columns(const Law& law) const;

 private:
  /// Motion of an axis as commanded, by central differences.
  struct Course {
    std::vector<double> position, velocity, acceleration;
  };
  /// How the channels answer at one axis.
  struct Response {
    SeriesOfChannels displacement;           ///< per metre (or radian) of displacement
    std::vector<std::vector<double>> force;  ///< to a pulse of a newton, per channel
    std::vector<char> through_motion;        ///< whether the channel sees the axis' position
  };

  static Course course_of(const std::vector<double>& q, double period);
  const Course& course(Law::OfAxis axis) const { return courses_[static_cast<std::size_t>(axis)]; }
  double covariate(Covariate c, Law::OfAxis axis, std::size_t k) const;
  std::vector<double> even_knots(const Law& law) const;
  /// Whether the channels see a displacement of an axis as more than a trace of it; so they do a
  /// force.
  bool acts(std::size_t axis, Law::Point point) const;
  bool is_read(std::size_t component) const;
  Law jump(std::size_t axis, Law::Point point, std::size_t sample) const;
  Response response_of(std::size_t i) const;
  SeriesOfChannels difference(const Law& law, double scale) const;
  std::vector<double> strength(const Law& law) const;
  SeriesOfChannels change(const Law& law) const;

  const Evidence& evidence_;
  const FittedMachine& at_;
  double period_;
  std::vector<Course> courses_;
  std::vector<char> moves_;  ///< of every axis, whether it does
  std::vector<Response> responses_;
};

}  // namespace vcnc
