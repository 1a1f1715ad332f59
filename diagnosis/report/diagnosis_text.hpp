// A diagnosis for the terminal: the verdict first, then what was found, then before and after.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"

namespace vcnc {

std::string to_text(const Diagnosis& diagnosis);

/// The table of before and after alone.
std::string figures_table(const std::vector<SignalFigure>& figures);

/// "C is shoulder, X is carriage": what the user calls the axes; empty: as we do.
std::string axes_told(const Diagnosis& diagnosis);

/// What the verdict says, in one sentence.
std::string verdict_sentence(const Diagnosis& diagnosis);

/// Value with as many digits as its interval deserves.
std::string with_interval(const FittedNumber& number);
/// A declared number that is out of tolerance: by how much.
std::string against_declared(const FittedNumber& number, const Diagnosis& diagnosis);
/// With its interval and, of an effect that the declared machine has already, with the change.
std::string with_change(const FittedNumber& number, const Diagnosis& diagnosis);

/// A share in percent: whole ones, below 1 the first digit that is not nought.
std::string percent(double share);

}  // namespace vcnc
