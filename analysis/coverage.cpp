#include "analysis/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace vcnc {
namespace {

constexpr double kEnough = 0.5;  ///< share of a bin that must be seen

Coverage::Bin bin_of(Contact contact) {
  switch (contact) {
    case Contact::ok:
      return Coverage::Bin::ok;
    case Contact::no_contact:
      return Coverage::Bin::no_contact;
    case Contact::out_of_range:
      return Coverage::Bin::out_of_range;
    case Contact::invalid:
      break;
  }
  return Coverage::Bin::invalid;
}

}  // namespace

// The bins divide the line evenly, as near to the wanted length as that goes.
Coverage::Coverage(double length, double bin_length) : length_(length) {
  const auto bins = static_cast<std::size_t>(std::max(1.0, std::round(length / bin_length)));
  bin_length_ = length / static_cast<double>(bins);
  cells_.resize(bins);
}

void Coverage::cover(std::size_t index, double length, Contact contact) {
  if (index != current_) {  // entering a bin begins a new pass over it
    current_ = index;
    ++pass_;
  }
  Cell& cell = cells_[index];
  if (cell.pass != pass_) {
    const bool clean = cell.worst == Bin::ok;
    cell.covered = cell.covered || (clean && cell.ok_length >= kEnough * bin_length_);
    if (!clean) cell.ok_length = 0;
    cell.worst = Bin::ok;
    cell.pass = pass_;
  }
  cell.touched = true;
  if (contact == Contact::ok) {
    cell.ok_length += length;
  } else {
    cell.worst = std::max(cell.worst, bin_of(contact));
  }
}

void Coverage::add(double from, double step, Contact contact) {
  if (cells_.empty() || step == 0) return;
  const auto bins = static_cast<std::int64_t>(cells_.size());
  double at = from, left = std::min(std::abs(step), length_);
  const int sign = step > 0 ? 1 : -1;
  auto index = static_cast<std::int64_t>(std::floor(at / bin_length_));
  while (left > 0) {
    const double edge = static_cast<double>(sign > 0 ? index + 1 : index) * bin_length_;
    const double part = std::min(left, std::max(0.0, sign * (edge - at)));
    if (part > 0) cover(static_cast<std::size_t>(((index % bins) + bins) % bins), part, contact);
    left -= part;
    at = edge;
    index += sign;
  }
}

Coverage::Bin Coverage::bin(std::size_t i) const {
  const Cell& cell = cells_[i];
  if (cell.covered) return Bin::ok;
  if (!cell.touched) return Bin::not_visited;
  if (cell.worst != Bin::ok) return cell.worst;
  return cell.ok_length >= kEnough * bin_length_ ? Bin::ok : Bin::not_visited;
}

std::int64_t Coverage::count(Bin kind) const {
  std::int64_t n = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) n += bin(i) == kind;
  return n;
}

double Coverage::percent() const {
  if (cells_.empty()) return 0;
  return 100.0 * static_cast<double>(count(Bin::ok)) / static_cast<double>(cells_.size());
}

}  // namespace vcnc
