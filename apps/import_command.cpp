#include "apps/import_command.hpp"

#include <filesystem>
#include <iostream>

#include "configs/import_map.hpp"
#include "diagnosis/quadrature.hpp"
#include "diagnosis/records/any_record.hpp"
#include "diagnosis/records/import_table.hpp"
#include "diagnosis/records/record_file.hpp"
#include "diagnosis/replica/checked_replica.hpp"

namespace vcnc {

namespace {

namespace fs = std::filesystem;

/// An import never takes the place of anything but an earlier one.
void refuse_foreign(const std::string& out) {
  std::error_code ignored;
  if (fs::exists(out, ignored) && !is_record_file(out))
    throw InputError("--out " + out + ": exists and is no record of vcnc import");
}

}  // namespace

void import_command(const ImportOptions& options) {
  if (options.keys) {
    std::cout << "# Keys of a map\n\n" << import_map_key_reference();
    return;
  }
  for (const auto& [value, name] :
       {std::pair(&options.table, "TABLE"), {&options.map, "--map"}, {&options.out, "--out"}})
    if (value->empty()) throw InputError(std::string(name) + ": is missing");
  refuse_foreign(options.out);
  const Record record = import_files(options.table, options.map);
  std::vector<std::string> warnings = record.warnings;
  if (!record.machine_toml.empty() && !is_bare_encoder(record))
    checked_replica(record, declared_machine("", record), warnings);
  write_record(record, options.out);
  std::cout << describe(record);
  for (const std::string& warning : warnings) std::cerr << "vcnc: " << warning << '\n';
  if (record.machine_toml.empty() && !is_bare_encoder(record))
    std::cout << "The map names no machine: travels, speeds, forces, inertias and readings are not "
                 "checked until vcnc diagnose has the model.\n";
  std::cout << "record: " << fs::absolute(options.out).string() << '\n';
}

}  // namespace vcnc
