// A machine by hypothesis, driven with the commands of a record: what it would have measured.
//
// A hypothesis is a Machine: what is declared, with effects, laws and deviations. So everything the
// library has can be tried by setting its numbers, and what is found is a machine file.
//
// The replica is noise-free: effects that only add noise do nothing in it.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "diagnosis/records/record.hpp"

namespace vcnc {

/// A signal that can be compared with its prediction.
struct ComparedChannel {
  SignalKind kind = SignalKind::position;
  std::size_t axis = 0;

  bool operator==(const ComparedChannel&) const = default;
};

/// Numbers that never change; copies share them.
class SharedSeries {
 public:
  SharedSeries() : SharedSeries(std::vector<double>{}) {}
  SharedSeries(std::vector<double> values)
      : values_(std::make_shared<const std::vector<double>>(std::move(values))) {}

  operator const std::vector<double>&() const { return *values_; }
  double operator[](std::size_t i) const { return (*values_)[i]; }
  std::size_t size() const { return values_->size(); }
  auto begin() const { return values_->begin(); }
  auto end() const { return values_->end(); }
  bool operator==(const SharedSeries& other) const { return *values_ == *other.values_; }
  /// Whether both are the same numbers by being the same object.
  bool shares(const SharedSeries& other) const { return values_ == other.values_; }

 private:
  std::shared_ptr<const std::vector<double>> values_;
};

/// One series per channel in SI; what a change left alone is shared with what was before.
using Prediction = std::vector<SharedSeries>;
/// The same of numbers that were measured, or changed; NaN where there is nothing to compare.
using SeriesOfChannels = std::vector<std::vector<double>>;

class Replica {
 public:
  virtual ~Replica() = default;

  /// The channels of the record that it predicts, in an order that never changes.
  virtual const std::vector<ComparedChannel>& channels() const = 0;
  /// One series per channel, as long as the record; NaN where it says nothing. Deterministic; may
  /// be called from several threads.
  virtual Prediction predict(const Machine& hypothesis) const = 0;
  /// The same of several machines, which may be quicker than one after the other.
  virtual std::vector<Prediction> predict_all(const std::vector<Machine>& hypotheses) const {
    std::vector<Prediction> all;
    for (const Machine& h : hypotheses) all.push_back(predict(h));
    return all;
  }
  /// A sample of what the rounding of the encoders that a machine declares does to each channel,
  /// which no prediction has in it; empty where there is none.
  virtual std::vector<std::vector<double>> rounding(const Machine&) const { return {}; }
  /// What a standard deviation of each of the forces that only a healthy run tells of makes of the
  /// channels of the declared machine; a channel that it leaves alone may be empty.
  virtual std::vector<SeriesOfChannels> of_unknown_forces() const { return {}; }
  /// What follows is asked about machines near this one: a replica may be exact here and quicker
  /// elsewhere. False: it was here already, and predicts what it did. Not while others predict.
  virtual bool anchor(const Machine&) { return true; }
};

}  // namespace vcnc
