// Numbers of a machine that a fit may move, and moving them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "model/machine.hpp"

namespace vcnc {

/// What precedes the key of a number that a run and its healthy run have in common. It goes along
/// with a hypothesis, as one of its deviations, and changes nothing in the machine.
inline constexpr std::string_view kCommon = "common:";

/// A number with what is known of it, in the unit of its key. Fits count it in `number.typical`.
struct FreedNumber {
  FreeNumber number;
  double value = 0;      ///< where it stands
  double centre = 0;     ///< declared
  double tolerance = 0;  ///< standard deviation of the declaration; 0: nothing is known
  bool shape = false;    ///< frequency, time constant, ...: moved in small steps
  bool held = false;     ///< at its declaration, as if it were exact
  double ragged = 0;     ///< what its interval is wider by, in quadrature (look_about.hpp)

  /// The same in the healthy run (common_numbers.hpp): counted from what is declared.
  bool common() const { return number.key.starts_with(kCommon); }
  double pull() const { return tolerance > 0 ? (value - centre) / tolerance : 0; }
  /// Inverse variance of the declaration in units of the typical size.
  double precision() const {
    constexpr double kExact = 1e-3;  // of its tolerance
    const double off = held ? kExact * tolerance : tolerance;
    return off > 0 ? number.typical * number.typical / (off * off) : 0;
  }
};

/// In the unit of the key, common ones less what is declared; of one that is said to deviate, its
/// true value. Throws std::invalid_argument for an unknown key.
double number_of(const Machine& machine, const std::string& key);
/// Like set_parameter(), but what is out of range becomes the nearest that is allowed.
void move_number(Machine& machine, const std::string& key, double value);
Machine with(Machine machine, const std::vector<FreedNumber>& numbers);
/// Gives numbers the values that those of the same keys have in `from`.
void adopt(std::vector<FreedNumber>& numbers, const std::vector<FreedNumber>& from);
/// Gives numbers the values that they have in a machine.
void take_values(std::vector<FreedNumber>& numbers, const Machine& machine);
bool has_key(const std::vector<FreedNumber>& numbers, const std::string& key);
/// Unit of a key's number: "um" of "gap_um", "" where it has none.
std::string unit_of_key(const std::string& key);
/// SI of one of a key's unit of length or angle; 1 of any other.
double si_of_unit(const std::string& key);
/// "X" of "effects.X.coulomb.level_N" and of "axes.X.load_kg"; what is no key, as it is.
std::string place_of_key(const std::string& key);
/// "coulomb" of "effects.X.coulomb.level_N".
std::string effect_of_key(const std::string& key);
/// Whether it says where the piece is clamped, which is no number of the machine.
bool is_clamping(const std::string& key);

/// Whether an axis has a screw that can be found wrong: with the loop closed on the motor it is as
/// a wrong scale, and a linear motor has none.
bool has_a_lead(const Machine& declared, std::size_t axis);

/// What a machine is held against: a declaration that was measured, one that a builder reckoned, or
/// a run of the same machine.
enum class Against { declaration, reckoning, healthy_run };

/// `other` with what `fitted` has otherwise than declared, but for what it says itself: numbers of
/// a file that are as declared.
Machine with_fitted(Machine other, const Machine& declared, const Machine& fitted);

/// Declared numbers that are never exact, with their tolerances (standard deviations):
///
///   moving mass and inertia                    1 %
///   friction levels of declared effects        3 % dry, 5 % viscous, 10 % break-away, pre-sliding
///   compliance, play of declared effects       2 %
///   damping of declared windup                 50 %
///   where the piece was clamped                free (100 um, 500 urad); reported above 5 um
///   scale of a linear axis                     1.5 ppm
///   lead of a screw                            30 ppm, as of 3 K, its loop closed with the load
///   size of gauge and ball                     1 um; between two runs, too: a steel ring of 50 mm
///                                              in diameter grows by 0.6 um in 1 K
///   drift of a linear axis                     3 um with 1200 s: 0.15 um/min
///   only where they were reckoned:             6 % compliance and play, 5 % weight, 2 deg its
///   angle
///
/// Against the declaration, those that the machine lists as uncertain are as uncertain as it says:
/// free, of another tolerance, or exact and no nuisance at all. Of a change between two runs of one
/// machine that says nothing. Only numbers that can show in the run matter; the others stay at
/// their declaration by themselves.
std::vector<FreedNumber> nuisances(const Machine& declared, Against against = Against::declaration);

/// Whether a number of an undeclared effect is among them: where the piece was clamped, drift, ...
bool never_quite_absent(const std::string& key);

}  // namespace vcnc
