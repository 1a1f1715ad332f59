#include "diagnosis/evidence/recent_products.hpp"

#include <algorithm>

namespace vcnc {
namespace {

RecentProducts::Known known_of(const std::shared_ptr<const RecentProducts::Made>& made,
                               const std::vector<const Column*>& columns) {
  RecentProducts::Known known{made, {}, {}, {}};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto at = std::find_if(made->columns.begin(), made->columns.end(),
                                 [&](const Column& c) { return c.shares(*columns[i]); });
    const bool is_known = at != made->columns.end();
    (is_known ? known.old : known.others).push_back(static_cast<Eigen::Index>(i));
    if (is_known) known.from.push_back(at - made->columns.begin());
  }
  return known;
}

}  // namespace

RecentProducts::Known RecentProducts::most_of(const std::vector<const Column*>& columns) const {
  std::vector<std::shared_ptr<const Made>> all;
  {
    const std::lock_guard lock(guard_);
    all = made_;
  }
  Known best;
  for (const std::shared_ptr<const Made>& made : all)
    if (Known known = known_of(made, columns); known.old.size() > best.old.size())
      best = std::move(known);
  return best;
}

void RecentProducts::keep(const std::vector<const Column*>& columns, const RoleGrams& grams) {
  auto made = std::make_shared<Made>(Made{{}, grams});
  for (const Column* c : columns) made->columns.push_back(*c);
  const std::lock_guard lock(guard_);
  made_.push_back(std::move(made));
  if (made_.size() > kKept) made_.erase(made_.begin());
}

}  // namespace vcnc
