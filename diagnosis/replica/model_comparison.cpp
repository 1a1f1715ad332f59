#include "diagnosis/replica/model_comparison.hpp"

#include <algorithm>

#include "diagnosis/records/signal_name.hpp"
#include "diagnosis/records/stretches.hpp"
#include "model/axes.hpp"

namespace vcnc {

namespace {

std::vector<char> inside_stretches(const Record& record) {
  std::vector<char> inside(record.samples(), record.stretches.empty());
  for (const Stretch& s : record.stretches)
    for (std::size_t k = s.begin; k < std::min(s.end, inside.size()); ++k) inside[k] = true;
  return inside;
}

}  // namespace

ModelResiduals model_residuals(const Record& record, const Replica& replica, const Machine& before,
                               const Machine& after) {
  ModelResiduals result;
  result.channels = replica.channels();
  const std::vector<char> inside = inside_stretches(record);
  const auto less = [&](const Prediction& predicted) {
    std::vector<std::vector<double>> residual;
    for (std::size_t c = 0; c < result.channels.size(); ++c) {
      const auto [kind, axis] = result.channels[c];
      const std::vector<double>& measured = record.find(kind, axis)->value;
      const bool drive =
          kind == SignalKind::force || kind == SignalKind::twist || kind == SignalKind::velocity;
      const std::vector<char> counts = drive ? moving(record, axis) : inside;
      std::vector<double>& r = residual.emplace_back(measured.size(), kMissing);
      for (std::size_t k = 0; k < r.size(); ++k)
        if (inside[k] && counts[k]) r[k] = measured[k] - predicted[c][k];
    }
    return residual;
  };
  result.before = less(replica.predict(before));
  result.after = less(replica.predict(after));
  return result;
}

ShownUnit shown_unit(const ComparedChannel& channel) {
  const bool rotary = is_rotary(channel.axis);
  switch (channel.kind) {
    case SignalKind::force:
      return {rotary ? "N m" : "N", 1};
    case SignalKind::velocity:
      return rotary ? ShownUnit{"deg/s", 1 / kDegree} : ShownUnit{"mm/s", 1e3};
    case SignalKind::cosine:
    case SignalKind::sine:
      return {"mV", 1e3};
    case SignalKind::deflection:
    case SignalKind::tool_position:
      return {"um", 1e6};
    default:
      return rotary ? ShownUnit{"arcsec", 3600 / kDegree} : ShownUnit{"um", 1e6};
  }
}

std::string channel_name(const ComparedChannel& channel) {
  return signal_name(channel.kind, channel.axis);
}

}  // namespace vcnc
