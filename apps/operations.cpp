#include "apps/operations.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "model/input_error.hpp"

namespace vcnc {

namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string trimmed(const std::string& text) {
  const std::size_t from = text.find_first_not_of(kBlanks);
  if (from == std::string::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlanks) - from + 1);
}

void add_operation(const std::string& text, const std::string& where,
                   std::vector<Operation>& operations) {
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ';');) {
    const std::string one = trimmed(part);
    if (one.empty()) continue;
    try {
      operations.push_back(parse_operation(one));
    } catch (const std::invalid_argument& e) {
      throw InputError(where + ": " + e.what());
    }
  }
}

void add_file(const std::string& path, std::vector<Operation>& operations) {
  std::ifstream in(path);
  if (!in) throw InputError("--operate " + path + ": cannot be read");
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    add_operation(line.substr(0, line.find('#')), path + ":" + std::to_string(number), operations);
  }
}

}  // namespace

std::vector<Operation> read_operations(const std::vector<std::string>& texts) {
  std::vector<Operation> operations;
  for (const std::string& text : texts) {
    std::error_code error;
    if (std::filesystem::is_regular_file(text, error))
      add_file(text, operations);
    else
      add_operation(text, "--operate \"" + text + "\"", operations);
  }
  return operations;
}

std::vector<std::string> texts_of(const std::vector<Operation>& operations) {
  std::vector<std::string> texts;
  for (const Operation& operation : operations) texts.push_back(operation.text);
  return texts;
}

}  // namespace vcnc
