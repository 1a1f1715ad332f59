// What only the dialect of Siemens has: R parameters, addresses with an index, CIP, AC() IC() DC().
//
//   R1=R2*(R3+1)   parameters R0 .. R999, kept as #1000 .. #1999; each acts on what is behind it
//   X=AC(10)       absolute, IC(..) incremental; of rotary axes DC(..) the shortest way, ACP(..)
//                  upwards, ACN(..) downwards
//   CIP X Y I1= J1=   circle through a point: absolute, under G91 from the start; in the plane
//   TURN=2         so many whole turns more
//   S1=800 M1=3    the first spindle, which is the only one
// Source: Siemens, SINUMERIK 840D sl, Programming Manual Fundamentals.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr int kMostTurns = 999;

/// Read, and the same as without them here.
constexpr std::array kWithoutEffect{"FFWON",  "FFWOF",   "SOFT",   "BRISK",  "DRIVE",   "STOPRE",
                                    "FNORM",  "CFTCP",   "CFC",    "CFIN",   "COMPCAD", "COMPON",
                                    "COMPOF", "ORIAXES", "ORIWKS", "DIAMOF", "NORM",    "KONTOFF"};

/// G codes that are those of another number here [tenths]; 0: without effect.
constexpr std::array<std::array<int, 2>, 13> kOtherNumbers{{{600, 610},
                                                            {6010, 0},
                                                            {6020, 0},
                                                            {6030, 0},
                                                            {6410, 640},
                                                            {6420, 640},
                                                            {6430, 640},
                                                            {6440, 640},
                                                            {6450, 640},
                                                            {700, 200},
                                                            {7000, 200},
                                                            {710, 210},
                                                            {7100, 210}}};

}  // namespace

/// Words of more than a letter. False: no such word stands here.
bool ProgramRun::read_siemens_word(Cursor& at) {
  const int column = at.column();
  const std::string word = at.letters();
  if (word == "CIP") {
    at.advance(word.size());
    words_.enter_g(kCircleThroughPoint, column);
    return true;
  }
  if (word == "SUPA") {
    at.advance(word.size());
    words_.enter_g(530, column);
    return true;
  }
  if (word == "TURN" && at.peek(word.size()) == '=') {
    at.advance(word.size() + 1);
    const double turns = evaluator_.bare(at);
    if (whole_number(turns) < 0 || turns > kMostTurns)
      fail(fmt::format("TURN={:g}: allowed is a whole number from 0 to {}", turns, kMostTurns),
           column);
    words_.enter('P', turns + 1, column);
    return true;
  }
  if (word == "MSG" && at.peek(word.size()) == '(') {
    bool quoted = false;
    for (at.advance(word.size() + 1); quoted || at.peek() != ')'; at.advance()) {
      if (at.at_end()) fail("MSG( without its )", column);
      if (at.peek() == '"') quoted = !quoted;
    }
    at.advance();
    return true;
  }
  if (std::find(kWithoutEffect.begin(), kWithoutEffect.end(), word) == kWithoutEffect.end())
    return false;
  at.advance(word.size());
  return true;
}

/// Behind a letter, an index and "=". False: no such address.
bool ProgramRun::read_siemens_address(char letter, Cursor& at, int column) {
  if (letter == 'R') {
    const int number = evaluator_.r_parameter(at);
    if (!at.take('=')) fail("an R parameter at the begin of a word is set: R1=..", column);
    parameters_.write(number, evaluator_.bare(at));
    return true;
  }
  if (at.peek(1) != '=' || at.peek() != '1') return false;
  if (letter == 'S' || letter == 'M') {
    at.advance(2);
    words_.enter(letter, evaluator_.bare(at), column);
    return true;
  }
  if (letter < 'I' || letter > 'K') return false;
  at.advance(2);
  const auto i = static_cast<std::size_t>(letter - 'I');
  via_[i] = evaluator_.bare(at);
  via_given_ |= 1u << i;
  return true;
}

/// What stands behind "X=".
double ProgramRun::siemens_value(char letter, Cursor& at) {
  at.skip_blanks();
  const int column = at.column();
  const std::string word = at.letters();
  const Way way = word == "AC"    ? Way::absolute
                  : word == "IC"  ? Way::incremental
                  : word == "DC"  ? Way::shortest
                  : word == "ACP" ? Way::upwards
                  : word == "ACN" ? Way::downwards
                                  : Way::modal;
  if (way == Way::modal) return evaluator_.bare(at);
  if (way >= Way::shortest && letter != 'A' && letter != 'C')
    fail(fmt::format("{}={}(): allowed with the rotary axes A and C", letter, word), column);
  at.advance(word.size());
  way_[static_cast<std::size_t>(letter - 'A')] = way;
  return evaluator_.bracketed(at);
}

/// False: the code does nothing here.
bool ProgramRun::siemens_code(double& number) const {
  const int tenths = whole_number(10 * number);
  for (const auto& [theirs, ours] : kOtherNumbers)
    if (tenths == theirs) {
      number = ours / 10.0;
      return ours != 0;
    }
  return true;
}

/// A turn of a rotary axis as DC(), ACP() and ACN() ask for it.
double ProgramRun::turned(double to, double from, Way way) {
  const double turns = (from - to) / (2 * kPi);
  const double count = way == Way::shortest  ? std::round(turns)
                       : way == Way::upwards ? std::ceil(turns - 1e-12)
                                             : std::floor(turns + 1e-12);
  return to + count * 2 * kPi;
}

/// CIP: the point between, in the frame.
Coordinates ProgramRun::via_point() const {
  Coordinates words = work_.to_words(position_);
  for (std::size_t i = 0; i < via_.size(); ++i) {
    if (!(via_given_ & 1u << i)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double word = via_[i] * modal_.length_unit;
    words[row] = modal_.absolute ? word : words[row] + word;
  }
  return work_.to_frame(words);
}

Arc ProgramRun::arc_through_point(const Coordinates& end) {
  constexpr double kFlat = 2e-6;  // [m]
  const std::size_t n = modal_.normal;
  const auto w = static_cast<Eigen::Index>(n);
  const auto u = static_cast<Eigen::Index>((n + 1) % 3), v = static_cast<Eigen::Index>((n + 2) % 3);
  if (via_given_ == 0) fail("CIP without the point between: I1= J1= K1=");
  if (n != kZ && work_.rotated()) fail("CIP in a plane other than G17 while it is rotated");
  const Coordinates via = via_point();
  if (std::abs(via[w] - position_[w]) > kFlat || std::abs(end[w] - position_[w]) > kFlat)
    fail(
        fmt::format("CIP: its three points do not lie in a plane G{}; allowed are circles in the "
                    "active plane",
                    19 - n));
  words_.use("P");
  const int more = words_.has('P') ? whole_number(words_.value('P')) - 1 : 0;
  PlanarArc planar = arc_through({position_[u], position_[v]}, {via[u], via[v]}, {end[u], end[v]});
  planar.sweep += std::copysign(2 * kPi * more, planar.sweep);
  Arc arc{Vec3::Zero(), n, planar.sweep};
  arc.centre[u] = planar.centre[0];
  arc.centre[v] = planar.centre[1];
  return arc;
}

}  // namespace vcnc
