#include "diagnosis/selection/intricacy.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/candidates/trial.hpp"
#include "model/effects/list.hpp"

namespace vcnc {
namespace {

constexpr double kUsual = 1;           ///< decades about the typical size, or of tolerances
constexpr double kUsualShape = 2;      ///< decades about the typical period, speed or time
constexpr double kOfTolerances = 0.3;  ///< numbers, for a decade of tolerances more
constexpr double kNothing = 0.03;      ///< of a typical size
/// Numbers: of equals, what displaces is told, not what turns, and be it out of tolerance by far.
constexpr double kByAnArm = 0.6;

/// Decades that a size is further from the typical one, which is 1, than is usual.
double unusual(double size, double usual) {
  return std::max(0.0, std::abs(std::log10(size)) - usual);
}

}  // namespace

double intricacy(const std::vector<Candidate>& candidates, const Contender& c) {
  if (!c.released.empty()) return intricacy(c.numbers.front());
  double largest = 0, odd_shape = 0;
  std::size_t numbers = c.numbers.size();
  for (const FreedNumber& n : c.numbers)
    for (const FreeNumber& own : candidates[c.candidate].numbers) {
      if (own.key != n.number.key || is_phase(own) || own.typical == 0) continue;
      const double size = c.needless.contains(own.key) ? 0 : std::abs(n.value / own.typical);
      if (!n.shape) {
        largest = std::max(largest, size);
        numbers -= size < kNothing;
      } else if (own.min > 0 && own.typical > 0) {
        odd_shape = std::max(odd_shape, unusual(size, kUsualShape));
      }
    }
  const bool by_an_arm = candidates[c.candidate].effect == AngularErrors::text.name;
  return static_cast<double>(numbers) + (by_an_arm ? kByAnArm : 0) +
         2 * ((largest > 0 ? unusual(largest, kUsual) : 0) + odd_shape);
}

double intricacy(const std::vector<Candidate>& candidates, const AddedEffect& effect) {
  Contender same;
  same.candidate = effect.candidate;
  same.numbers = effect.numbers;
  same.needless = effect.needless;
  return intricacy(candidates, same);
}

double intricacy(const FreedNumber& declared) {
  const double tolerances = std::abs(declared.value - declared.centre) / declared.number.typical;
  return 1 + kOfTolerances * std::max(0.0, std::log10(tolerances) - kUsual);
}

}  // namespace vcnc
