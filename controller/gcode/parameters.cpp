#include "controller/gcode/parameters.hpp"

#include "controller/program_error.hpp"

namespace vcnc {

double Parameters::read(int number) const {
  if (number <= last_local_) return locals_.numbered[static_cast<std::size_t>(number)];
  if (const std::optional<double> value = system_.read(number)) return *value;
  return numbered_[static_cast<std::size_t>(number)];
}

void Parameters::write(int number, double value) {
  if (number <= last_local_)
    locals_.numbered[static_cast<std::size_t>(number)] = value;
  else if (!system_.write(number, value))
    numbered_[static_cast<std::size_t>(number)] = value;
}

std::optional<double> Parameters::read(std::string_view name) const {
  const auto& names = name.starts_with('_') ? named_ : locals_.named;
  if (const auto found = names.find(name); found != names.end()) return found->second;
  return name.starts_with('_') ? system_.read(name) : std::nullopt;
}

void Parameters::write(std::string_view name, double value) {
  auto& names = name.starts_with('_') ? named_ : locals_.named;
  const auto found = names.find(name);
  if (found == names.end() && name.starts_with('_') && system_.read(name))
    throw ProgramError("this name belongs to the control and cannot be set");
  if (found != names.end()) {
    found->second = value;
    return;
  }
  if (names.size() >= kMostNames) throw ProgramError("more than 10000 named parameters");
  names.emplace(name, value);
}

}  // namespace vcnc
