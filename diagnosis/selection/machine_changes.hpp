// What a search does to a machine by hypothesis: an effect is added or taken out with all else
// fitted again, what became needless goes, and what is left is asked whether it may be told.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/healthy/controller_check.hpp"
#include "diagnosis/selection/appraisal.hpp"

namespace vcnc {

/// Whether two effects that make `one` and `other` of chi-square, and `both` together, take each
/// other back: what they explain is what they differ by, and the rest is anybody's.
bool take_each_other_back(double one, double other, double both);

class MachineChanges {
 public:
  /// What becomes of common numbers at whose drive nothing is any more.
  enum class Common { held, free };

  /// All must outlive this; `base` is the machine before anything was found.
  MachineChanges(Evidence& evidence, const Machine& declared, const ContestRules& rules,
                 const FittedMachine& base);

  /// With a contender, everything fitted together. `much`: what is left where it is no use to fit
  /// on; `equivalent`: candidates that do as well.
  void add(FittedMachine& m, const Contender& best, const std::vector<std::size_t>& equivalent,
           double much = std::numeric_limits<double>::infinity()) const;
  /// The same, and what the others can do without then goes.
  FittedMachine fitted_with(const FittedMachine& now, const Contender& contender,
                            const std::vector<std::size_t>& equivalent,
                            double much = std::numeric_limits<double>::infinity()) const;
  /// With dry friction in place of another law that is no more than that (is_another_law()), all
  /// fitted again.
  FittedMachine with_dry_friction(FittedMachine m) const;
  /// Without what the others can do without; says what each one is worth. Anchored at `m` then.
  void drop(FittedMachine& m) const;
  /// Without effects of which beside all others nothing counts that would have them told now, and
  /// without what the others can do without; after an exchange.
  void drop_uncounted(FittedMachine& m) const;
  /// Without one of its effects, everything else as it was.
  FittedMachine taken_out(const FittedMachine& m, std::size_t i, Common common) const;
  /// With declared numbers that are pulled further held, of those that have one.
  FittedMachine within_tolerance(const FittedMachine& m, double tolerances) const;

  /// What counts with all declared numbers within their tolerances: what pulls them further
  /// explains less than it seems to, and what does not is not to give way to it. Anchored at `m`
  /// then.
  double counted_within(const FittedMachine& m, const Appraisal& appraisal) const;
  /// The same of a machine that is asked for by several: `within` holds it with its
  /// numbers within their tolerances, or nothing yet.
  double counted_within(const FittedMachine& m, const Appraisal& appraisal,
                        std::optional<FittedMachine>& within) const;
  /// What a rival leaves that need not be fitted to the end.
  double far_more_than(const FittedMachine& m) const;
  /// Whether its effects are told by what else is known of them than what they explain together.
  bool holds_up(const FittedMachine& m) const;
  /// Whether a friction went to the end at which its law is another one: a drag that builds up over
  /// no speed is dry friction.
  bool is_another_law(const FittedMachine& m) const;
  /// Whether what was added last is not as declared for certain: else it is not told, and what is
  /// in its place would be.
  bool is_certain(const FittedMachine& m) const;

 private:
  /// Takes over where a contender was fitted to.
  void move_to(FittedMachine& m, const Refit& fit) const;
  /// What one added effect is worth: without it, all others moved along their columns.
  double weigh(FittedMachine& m, std::size_t i) const;
  /// Removes what the others can do without, and says what each one is worth.
  void drop_effects(FittedMachine& m) const;
  FittedMachine removed(const FittedMachine& m, std::size_t i) const;
  /// Declared numbers that were released when effects were still missing get their tolerance back
  /// where that costs little.
  void hold_again(FittedMachine& m) const;
  /// Whether two effects of one place take each other back.
  bool cancels(const FittedMachine& m) const;
  /// Whether some signal of a drive is much farther off than without all that was found: what
  /// explains one signal and spoils another is not the cause. (A reading of the tool is off by what
  /// fits leave free, where the piece lies, too.)
  bool spoils(const FittedMachine& m) const;
  bool is_another_law(const AddedEffect& effect) const;
  /// Whether the controller's own signals say that a gain is not what it is told to be, or all of
  /// an axis together are not: it stands for a force (controller_check.hpp).
  bool contradicts_controller(const FittedMachine& m) const;

  Evidence& evidence_;
  const Machine& declared_;
  const ContestRules& rules_;
  const FittedMachine& base_;
  ControllerCheck controller_;
};

}  // namespace vcnc
