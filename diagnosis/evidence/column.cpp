#include "diagnosis/evidence/column.hpp"

namespace vcnc {

bool Column::zero() const {
  for (std::size_t c = 0; c < size(); ++c)
    if (!(*channels_)[c].empty()) return false;
  return true;
}

std::vector<const Column*> pointers(const std::vector<Column>& columns) {
  std::vector<const Column*> all;
  for (const Column& c : columns) all.push_back(&c);
  return all;
}

Column less(const Column& z, const std::vector<Column>& columns, const Eigen::VectorXd& step) {
  Column::Channels left(z.size());
  for (std::size_t c = 0; c < z.size(); ++c) {
    left[c] = z[c];
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::vector<float>& column = columns[i][c];
      if (column.empty()) continue;
      left[c].resize(column.size(), 0.0F);
      const auto s = static_cast<float>(step[static_cast<Eigen::Index>(i)]);
      for (std::size_t k = 0; k < column.size(); ++k) left[c][k] -= s * column[k];
    }
  }
  return left;
}

}  // namespace vcnc
