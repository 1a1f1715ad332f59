// A diagnosis as JSON and as text. The schema of the JSON is in docs/diagnosis.md.
#pragma once

#include <string>

#include "diagnosis/diagnosis.hpp"

namespace vcnc {

/// Numbers as shortest decimals that read back as the same double; units in the names.
std::string to_json(const Diagnosis& diagnosis, const std::string& source);

}  // namespace vcnc
