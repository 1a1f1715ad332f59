// Sums of products of many columns with each other: most of the linear algebra of a diagnosis.
//
//   to_ij += sum of x_i[k] y_j[k]  over begin <= k < end
//
// Columns are floats, products and sums doubles. A tile of columns goes through the samples
// together, so that each sample is read and widened once for several products. Processors that have
// AVX2 use it, to the same bits.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <vector>

namespace vcnc {

using ColumnRefs = std::vector<const float*>;

/// Products of each x with each y; `to` is x.size() by y.size().
void add_products(const ColumnRefs& x, const ColumnRefs& y, std::size_t begin, std::size_t end,
                  Eigen::MatrixXd& to);
/// The same of x with itself; `to` is symmetric.
void add_products(const ColumnRefs& x, std::size_t begin, std::size_t end, Eigen::MatrixXd& to);

}  // namespace vcnc
