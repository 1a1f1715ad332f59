#include "diagnosis/evidence/column_products.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "toy_machine.hpp"

namespace vcnc {
namespace {

using Columns = std::vector<std::vector<float>>;

Columns random_columns(std::size_t count, std::size_t samples, std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  Columns all(count, std::vector<float>(samples));
  for (std::vector<float>& column : all)
    for (float& z : column) z = normal(random);
  return all;
}

ColumnRefs refs(const Columns& columns) {
  ColumnRefs all;
  for (const std::vector<float>& c : columns) all.push_back(c.data());
  return all;
}

/// One after the other, in long doubles.
double product(const std::vector<float>& x, const std::vector<float>& y, std::size_t begin,
               std::size_t end) {
  long double sum = 0;
  for (std::size_t k = begin; k < end; ++k)
    sum += static_cast<long double>(x[k]) * static_cast<long double>(y[k]);
  return static_cast<double>(sum);
}

Eigen::MatrixXd ones(std::size_t rows, std::size_t cols) {
  return Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
}

TEST(ColumnProducts, AreTheSumsOfProductsOfAnyNumberOfColumnsAndSamples) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t samples = 1 + random() % 2500, begin = random() % samples,
                      end = begin + random() % (samples - begin + 1);
    const Columns x = random_columns(random() % 12, samples, random),
                  y = random_columns(random() % 12, samples, random);
    Eigen::MatrixXd across = ones(x.size(), y.size()), own = ones(x.size(), x.size());
    add_products(refs(x), refs(y), begin, end, across);
    add_products(refs(x), begin, end, own);
    const auto check = [&](const Eigen::MatrixXd& to, const Columns& other) {
      for (std::size_t i = 0; i < x.size(); ++i)
        for (std::size_t j = 0; j < other.size(); ++j)
          EXPECT_NEAR(to(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                      1 + product(x[i], other[j], begin, end), 1e-9)
              << samples << " samples from " << begin << " to " << end;
    };
    check(across, y);
    check(own, x);
    EXPECT_EQ(own, own.transpose());
  }
}

TEST(RecentProducts, AreTheSameToTheLastBitAsMadeAnew) {
  Record record = toy::commands(1000, 4);
  toy::measure(record, Machine(), 3);
  toy::ToyReplica replica(record);
  const Evidence searching(record, replica, Machine()), fresh(record, replica, Machine());
  const std::size_t channels = replica.channels().size();
  std::mt19937_64 random(2);
  const auto some_column = [&] {
    Column::Channels all = random_columns(channels, record.samples(), random);
    if (random() % 2 == 0) all[random() % channels].clear();
    return Column(std::move(all));
  };
  std::vector<Column> columns;
  for (int i = 0; i < 12; ++i) columns.push_back(some_column());
  for (int step = 0; step < 200; ++step) {
    // Most stay, some come and go, and the order is another one.
    columns[random() % columns.size()] = some_column();
    if (random() % 4 == 0) columns.push_back(some_column());
    if (random() % 4 == 0 && columns.size() > 3) columns.pop_back();
    if (random() % 3 == 0) std::shuffle(columns.begin(), columns.end(), random);
    const RoleGrams found = searching.products(pointers(columns)),
                    anew = fresh.cross(pointers(columns), pointers(columns));
    EXPECT_EQ(found.fitted, anew.fitted);
    EXPECT_EQ(found.held_out, anew.held_out);
    EXPECT_EQ(found.fitted_of, anew.fitted_of);
    EXPECT_EQ(found.held_out_of, anew.held_out_of);
  }
}

}  // namespace
}  // namespace vcnc
