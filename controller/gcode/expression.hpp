// Values: numbers, parameters, [expressions], functions.
//
//   value       number | #value | #<name> | [expression] | function value | + value | - value
//   expression  values joined by operators; of equal rank from left to right
//     6  **     5  * / MOD     4  + -     3  EQ NE GT GE LT LE     2  AND OR XOR
//   functions   ABS ACOS ASIN COS EXP FIX FUP LN ROUND SIN SQRT TAN, ATAN[y]/[x], EXISTS[#..];
//               of macros also POW[x,y], MAX[,], MIN[,], SGN
//   Siemens     also R1, R[expression], brackets ( ), POT (square), TRUNC, ATAN2(y,x), TRUE, FALSE,
//               NOT value, $AA_IW[X] (system variables); of the words MOD DIV 5, AND 3, XOR 2, OR
//               1, then == <> > >= < <= 0: relations bind least there
//
// Angles in degrees. FIX rounds down, FUP up. EQ and NE compare to 1e-6; relations and logic give 1
// or 0. Source: NIST RS274/NGC interpreter, version 3 (NISTIR 6556), chapter 3.3; Fanuc custom
// macro B for the rest.
#pragma once

#include <string>

#include "controller/gcode/cursor.hpp"
#include "controller/gcode/parameters.hpp"

namespace vcnc {

class Evaluator {
 public:
  /// `vacant`: parameters never set are seen as such (Fanuc) instead of as 0. `siemens`: R1, R[..]
  /// and brackets ( ).
  Evaluator(const Parameters& parameters, const bool& vacant, const bool& siemens)
      : parameters_(parameters), vacant_(vacant), siemens_(siemens) {}

  static bool is_function(std::string_view name);  ///< upper case

  /// Takes a value. NaN only for a vacant parameter. Throws LineError.
  double value(Cursor& at) const { return value(at, 0); }
  /// Takes "[expression]".
  double bracketed(Cursor& at) const { return bracketed(at, 0); }
  /// Takes an expression without its brackets.
  double bare(Cursor& at) const { return expression(at, 0, 0); }
  /// Takes the number of a parameter, what follows a '#'.
  int parameter_number(Cursor& at) const { return parameter_number(at, 0); }
  /// Takes what follows the R of a parameter; gives the number under which that is kept.
  int r_parameter(Cursor& at) const { return r_parameter(at, 0); }

 private:
  double value(Cursor& at, int depth) const;
  double bracketed(Cursor& at, int depth) const;
  double expression(Cursor& at, int lowest_rank, int depth) const;
  double function(Cursor& at, int depth) const;
  double arc_tangent(Cursor& at, int depth) const;
  int parameter_number(Cursor& at, int depth) const;
  int r_parameter(Cursor& at, int depth) const;
  bool opens(char c) const { return c == '[' || (siemens_ && c == '('); }
  double arc_tangent_of_two(Cursor& at, int depth) const;
  double exists(Cursor& at, int depth) const;
  double system_variable(Cursor& at) const;

  const Parameters& parameters_;
  const bool& vacant_;
  const bool& siemens_;
};

/// Takes "<name>": lower case, without blanks.
std::string take_name(Cursor& at);

}  // namespace vcnc
