#include "diagnosis/evidence/column_products.hpp"

#include <algorithm>

namespace vcnc {
namespace {

constexpr std::size_t kRows = 4, kCols = 2;  ///< of a tile, whose sums fit in 16 registers
constexpr std::size_t kChunk = 1024;         ///< samples that stay in the cache

/// A vector of the compiler: two halves where the processor has no registers that wide.
using FourDoubles = double __attribute__((vector_size(32)));

/// Products of R columns with C others.
template <std::size_t R, std::size_t C>
[[gnu::always_inline]] inline void add_tile(const float* const* x, const float* const* y,
                                            std::size_t begin, std::size_t end, double* to,
                                            std::size_t stride) {
  FourDoubles sum[R][C] = {};
  std::size_t k = begin;
  for (; k + 4 <= end; k += 4) {
    FourDoubles a[R], b[C];  // widened by loops, of which GCC makes one instruction each
    for (std::size_t i = 0; i < R; ++i)
      for (std::size_t l = 0; l < 4; ++l) a[i][l] = static_cast<double>(x[i][k + l]);
    for (std::size_t j = 0; j < C; ++j)
      for (std::size_t l = 0; l < 4; ++l) b[j][l] = static_cast<double>(y[j][k + l]);
    for (std::size_t i = 0; i < R; ++i)
      for (std::size_t j = 0; j < C; ++j) sum[i][j] += a[i] * b[j];
  }
  for (std::size_t i = 0; i < R; ++i)
    for (std::size_t j = 0; j < C; ++j) {
      const FourDoubles& s = sum[i][j];
      double all = (s[0] + s[2]) + (s[1] + s[3]);
      for (std::size_t rest = k; rest < end; ++rest)
        all += static_cast<double>(x[i][rest]) * static_cast<double>(y[j][rest]);
      to[i + j * stride] += all;
    }
}

/// One chunk of samples. With `half`, of the same columns: tiles below the diagonal are left out.
[[gnu::always_inline]] inline void add_chunk(const ColumnRefs& x, const ColumnRefs& y, bool half,
                                             std::size_t begin, std::size_t end,
                                             Eigen::MatrixXd& to) {
  const std::size_t stride = x.size();
  for (std::size_t j = 0; j < y.size(); j += kCols) {
    const bool pair = j + kCols <= y.size();
    const std::size_t rows = half ? std::min(x.size(), j + kCols) : x.size();
    std::size_t i = 0;
    double* column = to.data() + j * stride;
    for (; i + kRows <= rows; i += kRows)
      pair ? add_tile<kRows, kCols>(&x[i], &y[j], begin, end, column + i, stride)
           : add_tile<kRows, 1>(&x[i], &y[j], begin, end, column + i, stride);
    for (; i < rows; ++i)
      pair ? add_tile<1, kCols>(&x[i], &y[j], begin, end, column + i, stride)
           : add_tile<1, 1>(&x[i], &y[j], begin, end, column + i, stride);
  }
}

using Chunk = void(const ColumnRefs&, const ColumnRefs&, bool, std::size_t, std::size_t,
                   Eigen::MatrixXd&);

void add_plain(const ColumnRefs& x, const ColumnRefs& y, bool half, std::size_t begin,
               std::size_t end, Eigen::MatrixXd& to) {
  add_chunk(x, y, half, begin, end, to);
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void add_by_avx2(const ColumnRefs& x, const ColumnRefs& y, bool half,
                                         std::size_t begin, std::size_t end, Eigen::MatrixXd& to) {
  add_chunk(x, y, half, begin, end, to);
}
Chunk* fastest() { return __builtin_cpu_supports("avx2") ? add_by_avx2 : add_plain; }
#else
Chunk* fastest() { return add_plain; }
#endif

void add_all(const ColumnRefs& x, const ColumnRefs& y, bool half, std::size_t begin,
             std::size_t end, Eigen::MatrixXd& to) {
  static Chunk* const add = fastest();
  for (std::size_t k = begin; k < end; k += kChunk)
    add(x, y, half, k, std::min(k + kChunk, end), to);
}

}  // namespace

void add_products(const ColumnRefs& x, const ColumnRefs& y, std::size_t begin, std::size_t end,
                  Eigen::MatrixXd& to) {
  add_all(x, y, false, begin, end, to);
}

void add_products(const ColumnRefs& x, std::size_t begin, std::size_t end, Eigen::MatrixXd& to) {
  add_all(x, x, true, begin, end, to);
  to.triangularView<Eigen::StrictlyLower>() = to.transpose();
}

}  // namespace vcnc
