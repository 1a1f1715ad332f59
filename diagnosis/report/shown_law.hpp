// A law without a name in the units of pages and of the terminal.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"

namespace vcnc {

struct Shown {
  std::string name, unit;
  double factor = 1;  ///< from SI
};

Shown shown_covariate(Covariate of, bool rotary);
/// What a law adds, per unit of what it is multiplied by.
Shown shown_value(const Law& law);

/// "behaves like A and like B"
std::string law_words(const std::vector<LearnedLaw>& laws);
/// Where the curve of a law is least and most, with its 95 % band.
std::string law_numbers(const LearnedLaw& law);

}  // namespace vcnc
