// A machine by hypothesis, driven with the commands of a record: what it would have measured.
//
// A hypothesis is a Machine: what is declared, with effects, laws and deviations. So everything the
// library has can be tried by setting its numbers, and what is found is a machine file.
//
// The replica is noise-free: effects that only add noise do nothing in it.
#pragma once

#include <vector>

#include "diagnosis/record.hpp"

namespace vcnc {

/// A signal that can be compared with its prediction.
struct ComparedChannel {
  SignalKind kind = SignalKind::position;
  std::size_t axis = 0;
};

class Replica {
 public:
  virtual ~Replica() = default;

  /// The channels of the record that it predicts, in an order that never changes.
  virtual const std::vector<ComparedChannel>& channels() const = 0;
  /// One series per channel, as long as the record; NaN where it says nothing. Deterministic; may
  /// be called from several threads.
  virtual std::vector<std::vector<double>> predict(const Machine& hypothesis) const = 0;
  /// What follows is asked about machines near this one: a replica may be exact here and quicker
  /// elsewhere. Not while others predict.
  virtual void anchor(const Machine&) {}
};

}  // namespace vcnc
