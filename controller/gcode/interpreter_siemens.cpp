// What only the dialect of Siemens has: R parameters, addresses with an index, CIP, AC() IC() DC().
//
//   R1=R2*(R3+1)   parameters R0 .. R999, kept as #1000 .. #1999; each acts on what is behind it
//   X=AC(10)       absolute, IC(..) incremental; of rotary axes DC(..) the shortest way, ACP(..)
//                  upwards, ACN(..) downwards
//   CIP X Y I1= J1=   circle through a point: absolute, under G91 from the start; in the plane
//   TURN=2         so many whole turns more
//   S1=800 M1=3    the first spindle, which is the only one
//   CT X Y         circle that goes on tangentially
//   MEAS=1         G1 ends where the probe touches: $AA_MW[X] (in the work offset), $AA_MM[X] (in
//                  the machine), $AC_MEA[1] (it has touched)
//   TRANS X ROT RPL= SCALE X MIRROR X   frame of the program; ATRANS .. within it
//   IF R1==1 GOTOF NAME, NAME:          jumps; structures: controller/gcode/flow_index.hpp
// Source: Siemens, SINUMERIK 840D sl, Programming Manual Fundamentals.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/gcode/interpreter_run.hpp"

namespace vcnc {
namespace {

constexpr int kMostTurnsOfArc = 999;

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
  if (word == "CT") {
    at.advance(word.size());
    words_.enter_g(kTangentialCircle, column);
    return true;
  }
  if (word == "MEAS" && at.peek(word.size()) == '=') {
    at.advance(word.size() + 1);
    const double edge = evaluator_.bare(at);
    if (std::abs(edge) != 1)
      fail(fmt::format("MEAS={:g}: allowed are 1 and -1, the first probe", edge), column);
    measures_ = true;
    return true;
  }
  if (read_siemens_frame(at)) return true;
  if (word == "SUPA") {
    at.advance(word.size());
    words_.enter_g(530, column);
    return true;
  }
  if (word == "TURN" && at.peek(word.size()) == '=') {
    at.advance(word.size() + 1);
    const double turns = evaluator_.bare(at);
    if (whole_number(turns) < 0 || turns > kMostTurnsOfArc)
      fail(fmt::format("TURN={:g}: allowed is a whole number from 0 to {}", turns, kMostTurnsOfArc),
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

/// CT: the circle that goes on in the direction in which the motion before has ended.
///   c = s + n |d|^2 / (2 n . d),  sweep = 2 atan2(t x d, t . d),  d = e - s, n left of t
Arc ProgramRun::arc_along_tangent(const Coordinates& end) {
  constexpr double kStraight = 1e-9;  // sine between tangent and chord
  const std::size_t n = modal_.normal;
  const auto w = static_cast<Eigen::Index>(n);
  const auto u = static_cast<Eigen::Index>((n + 1) % 3), v = static_cast<Eigen::Index>((n + 2) % 3);
  const Vec2 d(end[u] - position_[u], end[v] - position_[v]);
  Vec2 t(tangent_[u], tangent_[v]);
  if (!(t.norm() > kStraight))
    fail(fmt::format("CT: no motion in the plane G{} before it", 19 - n),
         words_.column(GGroup::motion));
  if (!(d.norm() > 0)) fail("CT ends where it starts", words_.column(GGroup::motion));
  t.normalize();
  Arc arc{Vec3::Zero(), n, 0};
  const double across = t[0] * d[1] - t[1] * d[0], along = t.dot(d);
  if (std::abs(across) < kStraight * d.norm()) {
    if (along < 0) fail("CT: its end lies straight behind", words_.column(GGroup::motion));
    return arc;
  }
  arc.sweep = 2 * std::atan2(across, along);
  const double radius = d.squaredNorm() / (2 * across);  // positive to the left
  arc.centre[u] = position_[u] - t[1] * radius;
  arc.centre[v] = position_[v] + t[0] * radius;
  arc.centre[w] = 0;
  return arc;
}

/// Keeps the direction in which a move ends, for CT.
void ProgramRun::turn_tangent(const Move& move) {
  Vec3 t = (move.end - move.start).head<3>();
  if (move.kind == Move::Kind::arc) {
    const auto n = static_cast<Eigen::Index>(move.arc.normal);
    const auto u = (n + 1) % 3, v = (n + 2) % 3;
    const double turn = move.arc.sweep > 0 ? 1 : -1;
    const double x = move.end[u] - move.arc.centre[u], y = move.end[v] - move.arc.centre[v];
    const double rise = t[n] / std::abs(move.arc.sweep);
    t[u] = -turn * y;
    t[v] = turn * x;
    t[n] = rise;
  }
  if (t.norm() > 0) tangent_ = t.normalized();
}

// ---------------------------------------------------------------------------------------- flow

/// Takes "NAME:"; empty: none stands here. A label has two letters or _ at its begin.
std::string ProgramRun::take_siemens_label(Cursor& at) {
  Cursor to = at;
  to.skip_blanks();
  const auto opens = [](char c) { return is_letter(c) || c == '_'; };
  if (!opens(to.peek()) || !opens(to.peek(1))) return {};
  std::string name;
  for (; opens(to.peek()) || is_digit(to.peek()); to.advance()) name += upper(to.peek());
  if (to.peek() != ':' || to.peek(1) == '=') return {};
  to.advance();
  at = to;
  return name;
}

/// GOTO and its kinds, and the IF before one. False: no such word stands here.
bool ProgramRun::read_siemens_jump(Cursor& at) {
  bool jumps = true;
  const int begin = at.column();
  if (at.take_word("IF")) {
    jumps = condition(at) != 0;
    at.skip_blanks();
    if (!at.letters().starts_with("GOTO"))
      fail("IF .. is followed by GOTOF, GOTOB, GOTO or GOTOC and a label", at.column());
  }
  const std::string word = at.letters();
  if (word != "GOTO" && word != "GOTOF" && word != "GOTOB" && word != "GOTOC") {
    if (word == "GOTOS") fail("unknown word GOTOS; allowed are GOTO GOTOF GOTOB GOTOC", begin);
    return false;
  }
  const int column = at.column();
  at.advance(word.size());
  at.skip_blanks();
  std::string name;
  for (; is_letter(at.peek()) || is_digit(at.peek()) || at.peek() == '_'; at.advance())
    name += upper(at.peek());
  if (name.empty()) fail(word + " without a label or block number", column);
  if (name[0] == 'N' && name.size() > 1 && is_digit(name[1]))
    name = fmt::format("N{}", std::stol(name.substr(1, 9)));
  at.skip_blanks();
  if (!at.at_end() && at.peek() != ';' && at.peek() != '(')
    fail("only a comment may follow here", at.column());
  at.to_end();
  if (!jumps) return true;
  const Search search = word == "GOTOF"   ? Search::forwards
                        : word == "GOTOB" ? Search::backwards
                                          : Search::around;
  const bool found = jump(name, search);
  if (!found && word != "GOTOC")
    fail(fmt::format("{} {}: there is no such label{}", word, name,
                     search == Search::forwards    ? " behind it"
                     : search == Search::backwards ? " before it"
                                                   : ""),
         column);
  return true;
}

int ProgramRun::siemens_loop_variable(Cursor& at) const {
  at.skip_blanks();
  const int column = at.column();
  if (!at.take('R') && !at.take('r')) fail("FOR counts an R parameter: FOR R1=.. TO ..", column);
  return evaluator_.r_parameter(at);
}

/// Behind "FOR R1=..".
bool ProgramRun::siemens_loop_goes_on(Cursor& at, int variable) const {
  at.skip_blanks();
  if (!at.take_word("TO")) fail("FOR R1=.. is followed by TO ..", at.column());
  return parameters_.read(variable) <= evaluator_.bare(at);
}

// -------------------------------------------------------------------------------------- frames

bool ProgramRun::read_siemens_frame(Cursor& at) {
  using Frame = SiemensFrame;
  constexpr std::array<std::pair<const char*, Frame>, 8> kWords{{{"TRANS", Frame::trans},
                                                                 {"ATRANS", Frame::atrans},
                                                                 {"ROT", Frame::rot},
                                                                 {"AROT", Frame::arot},
                                                                 {"SCALE", Frame::scale},
                                                                 {"ASCALE", Frame::ascale},
                                                                 {"MIRROR", Frame::mirror},
                                                                 {"AMIRROR", Frame::amirror}}};
  const int column = at.column();
  const std::string word = at.letters();
  if (word == "RPL" && at.peek(3) == '=') {
    at.advance(4);
    rpl_ = evaluator_.bare(at);
    return true;
  }
  for (const auto& [name, frame] : kWords) {
    if (word != name) continue;
    if (siemens_frame_ != Frame::none)
      fail(fmt::format("{}: one of TRANS ROT SCALE MIRROR stands in a block", word), column);
    at.advance(word.size());
    siemens_frame_ = frame;
    return true;
  }
  return false;
}

/// TRANS, ROT, SCALE, MIRROR replace the frame; with an A before them they act within it.
void ProgramRun::set_siemens_frame() {
  using Frame = SiemensFrame;
  const Frame kind = siemens_frame_;
  need_no_compensation("a change of the frame", column_of_block());
  if (words_.has(GGroup::motion))
    fail("a frame and a motion in one block; write them in two blocks");
  words_.use(kAxisLetters);
  ProgramFrame own;
  const bool turns = kind == Frame::rot || kind == Frame::arot;
  const bool shifts = kind == Frame::trans || kind == Frame::atrans;
  if (rpl_ && !turns) fail("RPL= belongs to ROT and AROT");
  std::optional<double> angle = rpl_;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const char letter = kAxisLetters[i];
    if (!words_.has(letter)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double value = words_.value(letter);
    if (shifts) {
      own.shift[row] = in_si(i, value);
      continue;
    }
    if (i >= 3)
      fail(fmt::format("{}: only TRANS shifts rotary axes", letter), words_.column(letter));
    if (turns) {
      if (i != modal_.normal || rpl_)
        fail(fmt::format("ROT about {}: allowed is the turn in the active plane, RPL= or {}",
                         letter, kAxisLetters[modal_.normal]),
             words_.column(letter));
      angle = value;
    } else if (kind == Frame::scale || kind == Frame::ascale) {
      if (!(value > 0))
        fail(fmt::format("{}{:g}: a scale is greater than 0", letter, value),
             words_.column(letter));
      own.linear(row, row) = value;
    } else {
      own.linear(row, row) = -1;
    }
  }
  if (angle) {
    const Vec3 axis = Vec3::Unit(static_cast<Eigen::Index>(modal_.normal));
    own.linear = Eigen::AngleAxisd(*angle * kDegree, axis).toRotationMatrix();
  }
  const bool within = kind == Frame::atrans || kind == Frame::arot || kind == Frame::ascale ||
                      kind == Frame::amirror;
  work_.program(within ? work_.program().then(own) : own);
  words_.clear();
}

}  // namespace vcnc
