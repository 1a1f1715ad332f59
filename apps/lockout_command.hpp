// `vcnc lockout`: the regression suite of the overtravel protection.
#pragma once

#include <string>

#include "apps/lockout_suite.hpp"

namespace vcnc {

struct LockoutArguments : LockoutOptions {
  std::string json, junit, html;  ///< files to write; empty: not
  std::string out;                ///< with `only`: run folder
  std::uint64_t processes = 0;    ///< runs on real processes
  bool list = false;              ///< tells the kinds and keys instead
};

/// Exit code: 0 all as expected, 1 something not. Throws InputError.
int lockout_command(LockoutArguments arguments);

}  // namespace vcnc
