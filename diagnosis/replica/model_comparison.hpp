// Measured less predicted by two machines: the declared one and the one that was found.
//
// Counted are samples inside stretches (all, where a record has none) that are measured and
// predicted; of force and twist only while the axis moves (stretches.hpp), because a standing axis
// keeps a friction force that nobody can predict.
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/records/record.hpp"
#include "diagnosis/replica/replica.hpp"

namespace vcnc {

struct ModelResiduals {
  std::vector<ComparedChannel> channels;
  /// One series per channel in SI; NaN where nothing is compared.
  std::vector<std::vector<double>> before, after;
};

ModelResiduals model_residuals(const Record& record, const Replica& replica, const Machine& before,
                               const Machine& after);

/// "um", "arcsec", "mm/s", "deg/s", "N", "N m" or "mV", and the factor from SI.
struct ShownUnit {
  const char* name;
  double factor;
};
ShownUnit shown_unit(const ComparedChannel& channel);

/// "position X".
std::string channel_name(const ComparedChannel& channel);

}  // namespace vcnc
