// The one error a program can cause.
#pragma once

#include "model/input_error.hpp"

namespace vcnc {

/// A program that cannot be run: "FILE:LINE: reason", naming the word.
class ProgramError : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace vcnc
