// What came out of a diagnosis: all that diagnosis.json, the report and the new model file say.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/replica/replica.hpp"
#include "model/axes.hpp"
#include "model/machine.hpp"

namespace vcnc {

enum class DiagnosisVerdict {
  explained,         ///< the added effects leave nothing but noise
  partly,            ///< they explain the share told
  unexplained,       ///< something repeatable is there that nothing in the library does
  no_deviation,      ///< the declared machine does what was measured
  not_identifiable,  ///< the run cannot tell
  interrupted        ///< before all was sought
};
std::string_view to_string(DiagnosisVerdict verdict);  ///< "EXPLAINED", "PARTLY", ...

/// A number that was fitted, in the unit of its key.
struct FittedNumber {
  std::string key;
  double value = 0, low = 0, high = 0;  ///< 95 % interval
};

/// An effect that was added, or a declared number found out of tolerance.
struct FoundEffect {
  std::string name;   ///< as in the library; "deviation" for a declared number
  std::string place;  ///< "X", "geometry", ...; of a declared number its key
  std::vector<FittedNumber> numbers;
  double gain = 0;              ///< held-out chi-square it explains
  double contour_error_um = 0;  ///< RMS by which it moves the ball, else the axes
  bool minor = false;           ///< significant, but of no consequence for the contour
  bool acquisition = false;     ///< of the measurement, not of the machine
  /// Others that the data cannot tell from it, and the canned program that would.
  std::vector<std::string> class_with;
  std::string separating_program;
};

/// A law without a name, found on what is left.
struct LearnedLaw {
  Law law;
  std::vector<double> low, high;  ///< band of its values
  double share = 0;               ///< of the remaining excess that it explains
  std::string words;              ///< what it behaves like: "force on X as sgn(v_X) f(q_X)"
  std::vector<std::string> not_distinguishable_from;
};

/// RMS of one signal against a model [SI]; `floor` is what noise leaves.
struct SignalFigure {
  ComparedChannel channel;
  std::string run;  ///< which record: "fitted laps", "held-out laps", a test run's file
  double before = 0, after = 0, floor = 0;
};

/// Whether the run could have shown an effect.
struct Excitation {
  std::string name;            ///< candidate
  double detection_limit = 0;  ///< of its first number, in the unit of its key; inf: not excited
  bool excited = false;
  std::string program;  ///< the canned program that would show it; empty if excited
  std::string key;      ///< of that number
  /// The limit beside what was found, and of what was found beside the rest; none: nothing was.
  std::optional<double> beside_found{};
};

/// One rung of the ladder: the state after adding an effect.
struct Rung {
  std::string added;
  double chi2 = 0;          ///< held-out, per degree of freedom of the floor
  std::vector<double> rms;  ///< held-out, per channel
};

/// Chi-square on held-out laps before and after, and what noise leaves of it.
struct HeldOut {
  double before = 0, after = 0, noise = 0;
};

struct Diagnosis {
  DiagnosisVerdict verdict = DiagnosisVerdict::no_deviation;
  bool differential = false;  ///< against a healthy reference run
  /// What the user calls the axes X, Y, Z, A, C; empty: as we do.
  std::array<std::string, kAxisCount> axis_names;
  double explained_share = 0, model_form_share = 0;
  HeldOut chi2;
  std::vector<std::string> suspects;  ///< all that was sought; none: everything
  double left = 0;  ///< RMS in units of the noise, of all signals; 0: no more than noise
  std::vector<FoundEffect> effects;     ///< by what they do to the contour error
  std::vector<FittedNumber> uncertain;  ///< what the declared machine calls so, as fitted along
  std::vector<LearnedLaw> laws;         ///< each on what those before leave
  /// "X vibrates by itself at 83 Hz", "deflection x shifts by 1.2 um from lap to lap": of unknown
  /// cause.
  std::vector<std::string> vibrations;
  std::vector<SignalFigure> figures;
  std::optional<ComparedChannel> still_off;  ///< the signal that is furthest off in the end
  std::vector<Excitation> excitation;
  std::vector<Rung> ladder;
  std::vector<std::string> warnings, notes;
  Machine declared, found;  ///< found: declared with what was added
};

}  // namespace vcnc
