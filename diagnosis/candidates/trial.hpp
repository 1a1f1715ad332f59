// How a candidate is tried: which numbers are set, in which directions, at which shapes.
//
// A direction is a size of one amplitude with everything else of the candidate set; the change of
// the prediction per size is a column of the screening. An amplitude A with a phase psi has two,
//
//   A sin(k x + psi) = A cos(psi) sin(k x) + A sin(psi) cos(k x)
//
// so that the phase needs no search; of one that the base machine has, the second is a turn of its
// phase. Shapes that cannot be linearised away are tried at several
// values: wavelengths and frequencies where the residual has lines (trial_values), time constants
// at shares of the run's length, places across the travel. An amplitude of which nothing would be
// most, not least (the end of a scale: 0 is none), is tried at several values as well.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/candidates/freed_number.hpp"

namespace vcnc {

struct Direction {
  std::size_t number = 0;   ///< index of the amplitude
  bool quadrature = false;  ///< with the phase a quarter of a period on
  double step = 0;          ///< change of the amplitude, in the unit of its key
  bool whole = false;       ///< the step is the amplitude, not a measure of it
};

struct Trial {
  std::size_t candidate = 0;
  std::vector<double> values;  ///< of all numbers, amplitudes as they are in the base machine
  std::vector<Direction> directions;
};

/// Values of a shape that are worth trying for `candidate`, its number `number`.
using TrialValues = std::function<std::vector<double>(const Candidate&, std::size_t number)>;

/// A number that only shifts what others do (a reference position): never fitted.
bool is_fixed(const FreeNumber& number);
bool is_phase(const FreeNumber& number);
/// Where on the travel of an axis something is.
bool is_place(const FreeNumber& number);
/// Over the position of an axis, in a unit of that.
bool is_wavelength(const FreeNumber& number);
/// An amplitude that stands beside a wave and has no phase.
bool has_no_phase(const FreeNumber& number);
/// An amplitude whose null value is no limit at all: it does more the smaller it is.
bool is_limit(const FreeNumber& number);
/// Whether a fitted value went to the most that is allowed: it would go on, for something else.
bool at_its_most(const FreeNumber& number, double value);

std::vector<Trial> trials(const Machine& base, const std::vector<Candidate>& candidates,
                          const TrialValues& values);

Machine machine_of(const Machine& base, const Candidate& candidate, const Trial& trial,
                   const Direction& direction);

/// Gives a machine the whole numbers of a trial, which no refit moves.
void set_whole_numbers(Machine& machine, const Candidate& candidate, const Trial& trial);

/// The numbers that a refit moves, started where the linear solution says: `size` per direction, in
/// steps. Amplitudes and shapes; phases where there are two directions: that of the amplitude that
/// does most, by `worth`, what one step of each direction does.
std::vector<FreedNumber> start_of(const Candidate& candidate, const Trial& trial,
                                  const Eigen::VectorXd& size, const Eigen::VectorXd& worth);

}  // namespace vcnc
