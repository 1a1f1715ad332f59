// Products of columns with each other that were made lately.
//
// From one step of a search to the next most columns stay: of the products of sixty with each
// other, those of two are new. What is taken from here is the same to the last bit as made anew.
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <mutex>
#include <vector>

#include "diagnosis/evidence/column.hpp"
#include "diagnosis/evidence/role_grams.hpp"

namespace vcnc {

class RecentProducts {
 public:
  struct Made {
    std::vector<Column> columns;
    RoleGrams grams;
  };
  /// Where columns that are asked for stand in what was made, if they do.
  struct Known {
    std::shared_ptr<const Made> made;             ///< null: nothing of it is known
    std::vector<Eigen::Index> from, old, others;  ///< as completed() takes them
  };

  /// Most of these.
  Known most_of(const std::vector<const Column*>& columns) const;
  void keep(const std::vector<const Column*>& columns, const RoleGrams& grams);

 private:
  static constexpr std::size_t kKept = 2;  ///< a long record has columns of megabytes
  mutable std::mutex guard_;
  std::vector<std::shared_ptr<const Made>> made_;
};

}  // namespace vcnc
