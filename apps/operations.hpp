// What the operator does, as people write it on a command line.
#pragma once

#include <string>
#include <vector>

#include "controller/operation.hpp"

namespace vcnc {

/// Every text is an operation (controller/operation.hpp), several of them separated by ';', or the
/// name of a file with one in each line; # begins a comment there. Throws InputError naming the
/// text, or file and line.
std::vector<Operation> read_operations(const std::vector<std::string>& texts);

/// As they were written, for another program's command line.
std::vector<std::string> texts_of(const std::vector<Operation>& operations);

}  // namespace vcnc
