// A law where it acts, in the loop, with the numbers that go along with it.
#pragma once

#include <memory>
#include <vector>

#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/fit/fitted_machine.hpp"
#include "diagnosis/fit/ground.hpp"
#include "model/effects/law.hpp"

namespace vcnc {

class LawInLoop {
 public:
  /// `law` with values to begin with, on what `at` leaves; `linear`: at.linear(). Evidence and `at`
  /// must live as long.
  LawInLoop(const Evidence& evidence, const FittedMachine& at, Law law,
            std::shared_ptr<const LinearPart> linear);
  ~LawInLoop();
  LawInLoop(LawInLoop&&) noexcept;
  LawInLoop& operator=(LawInLoop&&) noexcept;

  /// Fits the values again (Gauss-Newton): the first ones come from the loop without the law, and
  /// friction is not linear. In turn with the declared numbers: for want of the law they may have
  /// been pulled, and their columns lack it.
  void refine();

  const Law& law() const;
  const Ground& ground() const;  ///< what is left with it
  /// The machine that leaves least of the fitted laps.
  Machine machine() const;
  /// Standard deviations of the values, once refined.
  Eigen::VectorXd deviations() const;

 private:
  struct Acting;
  std::vector<Column> gauss_newton(const FittedMachine& without, const LinearPart& linear,
                                   std::unique_ptr<Acting>& acting) const;

  const Evidence* evidence_;
  std::shared_ptr<const FittedMachine> without_;  ///< the law
  std::shared_ptr<const LinearPart> linear_;      ///< of `without_`
  std::unique_ptr<Acting> acting_;
  std::vector<Column> columns_;  ///< of the values
};

}  // namespace vcnc
