// Each of what was found against all that might be in its place.
//
// What was accepted when other things were still missing may be a stand-in. An effect is taken out,
// or a released number held again, and all candidates and declared numbers compete for the place;
// those that do as well are its class. When one gave way, the others are judged anew: what does as
// well as they was found beside the stand-in. Two effects of one place of which another one does
// all, but for what a model of it may be wrong by, are that one.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/selection/appraisal.hpp"
#include "diagnosis/selection/machine_changes.hpp"

namespace vcnc {

class Exchange {
 public:
  /// All must outlive this. `base`: before anything was found; `also_fitted`: machines with another
  /// contender than the last one that was accepted.
  Exchange(Evidence& evidence, const ContestRules& rules, const MachineChanges& changes,
           const FittedMachine& base, const std::vector<FittedMachine>& also_fitted)
      : evidence_(evidence),
        rules_(rules),
        changes_(changes),
        base_(base),
        also_fitted_(also_fitted) {}

  /// Until nothing gives way any more; what was found beside a stand-in may go with it.
  void settle(FittedMachine& m) const {
    const bool exchanged = exchange(m), joined = join(m);
    if (exchanged || joined) changes_.drop_uncounted(m);
  }

 private:
  /// Whether something gave way.
  bool exchange(FittedMachine& m) const;
  /// Whether another one took the place of an effect or a released number, if it may; those that do
  /// as well become its class. `within`: of `m` (counted_within()).
  bool gives_way(FittedMachine& m, std::size_t i, bool may_give_way,
                 std::optional<FittedMachine>& within) const;
  /// Sensitivities tell a large gain to some per mille only: rivals that promise as much are fitted
  /// in full. Those that do as well are of one class with the effect; whether one of them that says
  /// it more simply has taken its place.
  bool exchange_for_as_good(FittedMachine& m, std::size_t i, const FittedMachine& less,
                            const std::vector<Contender>& rivals, const Appraisal& appraisal,
                            double lost, std::optional<FittedMachine>& within) const;
  /// `m` with one more candidate, as it was fitted in full when the last effect was accepted; null:
  /// it was not.
  const FittedMachine* fitted_before(const FittedMachine& m, std::size_t candidate) const;
  /// Whether two became one.
  bool join(FittedMachine& m) const;
  /// Errors of two measuring systems that leave what the one has against the other, say. The
  /// smaller of the two must make more than a model may be wrong by.
  bool became_one(FittedMachine& m, std::size_t i, std::size_t j) const;

  Evidence& evidence_;
  const ContestRules& rules_;
  const MachineChanges& changes_;
  const FittedMachine& base_;
  const std::vector<FittedMachine>& also_fitted_;
};

}  // namespace vcnc
