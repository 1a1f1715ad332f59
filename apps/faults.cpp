#include "apps/faults.hpp"

#include <stdexcept>

#include "model/input_error.hpp"

namespace vcnc {

BusFaults parse_faults(const std::vector<std::string>& texts) {
  BusFaults faults;
  for (const std::string& text : texts) {
    try {
      faults.push_back(parse_fault(text));
    } catch (const std::invalid_argument& e) {
      throw InputError("--fault \"" + text + "\": " + e.what());
    }
  }
  return faults;
}

}  // namespace vcnc
