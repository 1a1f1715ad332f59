// Machine and piece files (TOML) to parameter structs and back.
//
// The keys are those that the structs declare (model/fields.hpp): unknown keys, wrong types and
// values out of range are refused with file, line, key and what is allowed. Values in a file are in
// the unit at the end of the key; the structs hold SI.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/input_error.hpp"
#include "model/machine.hpp"
#include "model/piece_params.hpp"

namespace vcnc {

/// One sentence that begins with FILE:LINE (or the command line option) and names the key.
class ConfigError : public InputError {
 public:
  using InputError::InputError;
};

/// Reads a machine file and applies `--set` assignments ("axes.Y.kv_per_s=38") in order, then
/// `--inject` ones: effects ("Y.backlash.gap_um=12"), or declared numbers whose true value is
/// another ("axes.Y.load_kg=550"), which only the simulators learn. Paths inside (setup.piece)
/// become absolute: relative to the file, or to the working directory where they come from an
/// assignment. Throws ConfigError.
Machine load_machine(const std::string& path, const std::vector<std::string>& assignments = {},
                     const std::vector<std::string>& injections = {});

/// The same for text; `name` stands for the file in messages; paths stay as they are.
Machine parse_machine(std::string_view toml, const std::string& name);

PieceParams load_piece(const std::string& path);
PieceParams parse_piece(std::string_view toml, const std::string& name);

/// Every key with its value in the key's own unit; parse(to_toml(x)) gives x to the last bit of the
/// shortest decimal that does so.
std::string to_toml(const Machine& machine);
std::string to_toml(const PieceParams& piece);
/// Without the tables of which every value is the default; parse(brief_toml(x)) gives x as well.
std::string brief_toml(const Machine& machine);

/// The reference of all keys as Markdown: key, unit, range, default, meaning.
std::string machine_key_reference();
std::string piece_key_reference();

}  // namespace vcnc
