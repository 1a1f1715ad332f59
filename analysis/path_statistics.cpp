#include "analysis/path_statistics.hpp"

#include <algorithm>

namespace vcnc {

namespace {

void add_to(ErrorGroup& group, const ErrorSample& e, double s) {
  group.e_n.add(e.e_n, s);
  group.e_plan.add(e.e_plan, s);
  group.e_servo.add(e.e_servo, s);
  group.e_rest.add(e.e_rest, s);
}

void merge_into(ErrorGroup& group, const ErrorGroup& later) {
  group.e_n.merge(later.e_n);
  group.e_plan.merge(later.e_plan);
  group.e_servo.merge(later.e_servo);
  group.e_rest.merge(later.e_rest);
}

}  // namespace

void PathStatistics::add(const ErrorSample& e, double s, Face face) {
  add_to(whole, e, s);
  add_to(faces[static_cast<std::size_t>(face)], e, s);
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    following[j].add(e.following[j], s);
    share[j].add(e.share[j], s);
  }
  lag.add(e.lag, s);
  cross.add(e.cross, s);
}

void PathStatistics::add_crossing(std::size_t i, const ErrorSample& e, double s) {
  if (crossings.size() <= i) crossings.resize(i + 1);
  add_to(crossings[i], e, s);
}

void PathStatistics::add_circle(double phi, bool counter_clockwise, double dr) {
  std::vector<AngleBin>& bins = circle[counter_clockwise ? 0 : 1];
  if (bins.empty()) bins.resize(kAngleBins);
  const double turn = (phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi);
  AngleBin& bin = bins[std::min(static_cast<std::size_t>(turn * kAngleBins), kAngleBins - 1)];
  bin.sum += dr;
  ++bin.count;
}

void PathStatistics::merge(const PathStatistics& later) {
  merge_into(whole, later.whole);
  for (std::size_t i = 0; i < faces.size(); ++i) merge_into(faces[i], later.faces[i]);
  if (crossings.size() < later.crossings.size()) crossings.resize(later.crossings.size());
  for (std::size_t i = 0; i < later.crossings.size(); ++i)
    merge_into(crossings[i], later.crossings[i]);
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    following[j].merge(later.following[j]);
    share[j].merge(later.share[j]);
  }
  lag.merge(later.lag);
  cross.merge(later.cross);
  for (std::size_t d = 0; d < circle.size(); ++d) {
    if (later.circle[d].empty()) continue;
    circle[d].resize(kAngleBins);
    for (std::size_t i = 0; i < kAngleBins; ++i) {
      circle[d][i].sum += later.circle[d][i].sum;
      circle[d][i].count += later.circle[d][i].count;
    }
  }
  if (!failure || (later.failure && later.failure->worse_than(*failure))) failure = later.failure;
}

}  // namespace vcnc
