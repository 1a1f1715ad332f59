// Something a person wrote cannot be used: one sentence that says where, what and what is allowed.
#pragma once

#include <stdexcept>

namespace vcnc {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace vcnc
