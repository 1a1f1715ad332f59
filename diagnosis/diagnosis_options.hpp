// What a diagnosis asks of an effect before it is told.
//
// Thresholds: chi-square of a few spurious numbers is a few units; 25 is also what five standard
// deviations of one number give, which is how a detection limit is defined.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "diagnosis/candidates/freed_number.hpp"

namespace vcnc {

struct DiagnosisOptions {
  double least_gain = 25, least_share = 0.02;
  /// Chi-square that a model may leave by its form alone, and the share of it an effect must gain.
  double form = 0, share_of_form = 0;
  double share_of_found = 0;  ///< of what found effects explain, see above
  /// Chi-square per channel that the model is known to leave by its form, and the share of it that
  /// one effect may take for its own. Empty: none.
  std::vector<double> form_of_channel;
  double taken_of_form = 0.5;
  /// Chi-square per channel that encoders make as reckoned, and the share of it that counts for
  /// nobody: what they make is known as a sample, and it repeats. Empty: none.
  std::vector<double> rounding_of_channel;
  double taken_of_rounding = 0.05;
  /// RMS of the reading that this form makes; less in readings alone is a note.
  double form_um = 0;
  /// Below both, an effect is of no consequence: RMS of what it does to the contour, and to any
  /// signal, of the noise of one sample.
  double least_contour_um = 0.01, least_of_noise = 0.1;
  /// Gains are alike that differ by less than this, this share of what is left and this share of
  /// the chi-square that does not count.
  double class_gain = 30, class_share = 0.05, class_doubt = 0.1;
  double law_gain = 40;           ///< of a generic law
  double model_form = 1.10;       ///< chi-square per sample above which no cause is named
  double out_of_tolerance = 4.5;  ///< pull of a declared number
  double release_gain = 25;       ///< of one whose tolerance is lifted, priors included
  double clamped_um = 5;          ///< offset of the piece that is worth a word; 10 urad per um
  /// All that is sought (suspects.hpp); none: everything.
  std::vector<std::string> suspects;
  Against against = Against::declaration;
  /// Numbers that a healthy run has in common with the one that is explained.
  std::vector<FreedNumber> common;
  /// Axes that vibrate by themselves: what else their drives do is not sought.
  std::vector<std::size_t> vibrating;
  std::size_t refits = 5, per_family = 2, pairs_of = 10;
  std::size_t max_effects = 8;
  /// Part of what is left that a further effect at a drive must explain where one was found: what
  /// that leaves in its own drive, another law of the same drive can always imitate a little.
  double share_beside = 0;
  /// More than these are told only while each explains half of what the others leave: many that do
  /// a little imitate something else.
  std::size_t few_effects = 8;
};

}  // namespace vcnc
