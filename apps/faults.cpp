#include "apps/faults.hpp"

#include <algorithm>
#include <stdexcept>

#include "model/input_error.hpp"

namespace vcnc {

BusFaults parse_faults(const std::vector<std::string>& texts) {
  BusFaults faults;
  for (const std::string& text : texts) {
    try {
      faults.push_back(parse_fault(text));
      if (faults.back().at_contact)
        throw std::invalid_argument("at=contact: only scenarios of vcnc lockout know that moment");
    } catch (const std::invalid_argument& e) {
      throw InputError("--fault \"" + text + "\": " + e.what());
    }
  }
  return faults;
}

std::vector<std::string> never_struck(const BusFaults& faults,
                                      const std::vector<std::string>& struck) {
  std::vector<std::string> never;
  for (const BusFault& fault : faults)
    if (std::find(struck.begin(), struck.end(), fault.text) == struck.end())
      never.push_back(fault.text);
  return never;
}

}  // namespace vcnc
