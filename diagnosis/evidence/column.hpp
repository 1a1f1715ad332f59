// What a diagnosis compares: the samples of all channels in standard deviations of their noise.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace vcnc {

/// Whitened numbers, one series per channel; a channel that is zero throughout is empty. They never
/// change; copies share them.
class Column {
 public:
  using Channels = std::vector<std::vector<float>>;

  Column() = default;
  Column(Channels channels) : channels_(std::make_shared<const Channels>(std::move(channels))) {}

  std::size_t size() const { return channels_ ? channels_->size() : 0; }
  const std::vector<float>& operator[](std::size_t channel) const { return (*channels_)[channel]; }
  bool zero() const;
  /// Whether both are the same numbers by being the same object.
  bool shares(const Column& other) const { return channels_ == other.channels_; }

 private:
  std::shared_ptr<const Channels> channels_;
};

/// Where each is, for what takes products of them.
std::vector<const Column*> pointers(const std::vector<Column>& columns);

/// z less the sum of step_i columns_i.
Column less(const Column& z, const std::vector<Column>& columns, const Eigen::VectorXd& step);

}  // namespace vcnc
