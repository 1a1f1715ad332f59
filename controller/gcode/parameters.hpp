// Numbered and named parameters: #1, #<name>, #<_global>.
//
//   #1 .. #30   local: every call has its own; in Fanuc macros up to #33
//   .. #9999    global; positions, offsets and modal codes among them are SystemParameters
//   #<name>        local; with _ in front global
//
// A parameter that was never set is vacant (NaN). Fanuc macros can see that (#1 EQ #0); NGC reads a
// vacant number as 0 and refuses a vacant name.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vcnc {

inline constexpr double kVacant = std::numeric_limits<double>::quiet_NaN();

/// What the control itself keeps under numbers and names.
class SystemParameters {
 public:
  virtual ~SystemParameters() = default;
  /// nullopt: an ordinary parameter.
  virtual std::optional<double> read(int number) const = 0;
  virtual std::optional<double> read(std::string_view name) const = 0;
  /// False: an ordinary parameter. Throws ProgramError where it must not be written.
  virtual bool write(int number, double value) = 0;
};

struct LocalParameters {
  static constexpr int kCount = 33;  ///< of macros; those of NGC end at #30
  std::array<double, kCount + 1> numbered;
  std::map<std::string, double, std::less<>> named;
  LocalParameters() { numbered.fill(kVacant); }
};

class Parameters {
 public:
  static constexpr int kLast = 9999;
  static constexpr std::size_t kMostNames = 10'000;

  explicit Parameters(SystemParameters& system) : system_(system), numbered_(kLast + 1, kVacant) {}

  void last_local(int number) { last_local_ = number; }

  /// kVacant where it was never set; `number` must be 0 .. kLast.
  double read(int number) const;
  void write(int number, double value);
  std::optional<double> read(std::string_view name) const;
  void write(std::string_view name, double value);

  LocalParameters& locals() { return locals_; }

 private:
  SystemParameters& system_;
  int last_local_ = 30;
  LocalParameters locals_;
  std::vector<double> numbered_;
  std::map<std::string, double, std::less<>> named_;
};

}  // namespace vcnc
