#include "diagnosis/evidence/packed_column.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr std::size_t kTogether = 256;
constexpr float kLargest = 32767;

/// Calls f(first, last, which) for every 256 of n samples.
template <class F>
void each_piece(std::size_t n, F&& f) {
  for (std::size_t first = 0, which = 0; first < n; first += kTogether, ++which)
    f(first, std::min(n, first + kTogether), which);
}

}  // namespace

PackedColumn::PackedColumn(const Column& column) {
  std::size_t samples = 0;
  for (std::size_t c = 0; c < column.size(); ++c) samples = std::max(samples, column[c].size());
  if (samples < kLong) {
    whole_ = column;
    return;
  }
  std::vector<Channel> channels(column.size());
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::vector<float>& x = column[c];
    Channel& to = channels[c];
    to.value.resize(x.size());
    each_piece(x.size(), [&](std::size_t first, std::size_t last, std::size_t) {
      float largest = 0;
      for (std::size_t k = first; k < last; ++k) largest = std::max(largest, std::abs(x[k]));
      to.scale.push_back(largest / kLargest);
      const float per = largest > 0 ? kLargest / largest : 0;
      for (std::size_t k = first; k < last; ++k)
        to.value[k] = static_cast<std::int16_t>(x[k] * per + std::copysign(0.5F, x[k]));
    });
  }
  channels_ = std::make_shared<const std::vector<Channel>>(std::move(channels));
}

Column PackedColumn::unpacked() const {
  if (!channels_) return whole_;
  Column::Channels channels(channels_->size());
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Channel& from = (*channels_)[c];
    std::vector<float>& x = channels[c];
    x.resize(from.value.size());
    each_piece(x.size(), [&](std::size_t first, std::size_t last, std::size_t which) {
      const float scale = from.scale[which];
      for (std::size_t k = first; k < last; ++k) x[k] = scale * static_cast<float>(from.value[k]);
    });
  }
  return Column(std::move(channels));
}

bool PackedColumn::zero() const {
  return channels_ ? std::all_of(channels_->begin(), channels_->end(),
                                 [](const Channel& c) { return c.value.empty(); })
                   : whole_.zero();
}

}  // namespace vcnc
