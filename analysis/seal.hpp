// The seal of a closed file: 32 bytes behind its content, by which any later change is noticed.
//
//   u64 size of the content | XXH3 (128 bit, canonical) of the content | "VCNCSEAL"
//
// Integers are little-endian. It finds damage and carelessness, not forgery: who knows the format
// can seal anew.
#pragma once

#include <filesystem>

namespace vcnc {

enum class Seal { none, intact, broken };

/// Appends a seal. False, with errno, if the file cannot be read or written.
bool put_seal(const std::filesystem::path& path);

/// `none` also for a file that cannot be read.
Seal seal_of(const std::filesystem::path& path);

}  // namespace vcnc
