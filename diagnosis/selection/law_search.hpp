// Laws without names: beside what names explain, or in place of all of them.
//
//   a law beside          is told where it gains what an effect must, and half a percent of all
//   there was a law in their place  takes the names away where it does clearly more than one of
//   them, more
//                         than two, or as much as three (takes_names_away()), or where more names
//                         than a machine changes in between two runs leave something
//   further laws          where the laws so far leave a tenth of what there was and one more takes
//                         half of that: f(q_Y) and q_X f(q_Y) are waves over Y that grow with X
#pragma once

#include <string>
#include <vector>

#include "diagnosis/candidates/candidate.hpp"
#include "diagnosis/diagnosis_options.hpp"
#include "diagnosis/evidence/evidence.hpp"
#include "diagnosis/selection/selection.hpp"

namespace vcnc {

/// Part of the noise's chi-square that tells nothing: no law is sought in it.
inline constexpr double kFloorScatter = 0.04;

struct UnnamedLaws {
  std::vector<LearnedLaw> laws;  ///< empty: none is told
  Machine machine;               ///< with them
  bool instead = false;          ///< of all names
  std::string note;              ///< why the names went
};

/// `still_off`: a signal is, by more than a model of the true cause may be wrong by.
UnnamedLaws search_laws(const Evidence& evidence, const SelectionResult& selection,
                        const std::vector<Candidate>& candidates, const DiagnosisOptions& options,
                        bool still_off);

/// What becomes of names of which a law in their place gains `alone`, and one beside them `beside`.
enum class Names {
  stay,
  replaced,  ///< the law does what they do
  imitate,   ///< there are too many of them, and the law does enough
};
Names judged(double alone, double beside, const Named& named, double needed, bool too_many);

}  // namespace vcnc
