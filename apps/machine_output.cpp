#include "apps/machine_output.hpp"

#include <unistd.h>

#include <filesystem>

#include "configs/config.hpp"
#include "model/input_error.hpp"

namespace vcnc {

namespace fs = std::filesystem;

void check_machine_output(const std::string& out) {
  if (out.empty()) throw InputError("--out: is empty; it needs a file for the machine");
  const fs::path folder = fs::absolute(out).parent_path();
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError("--out " + out + ": there is no folder " + folder.string());
  if (access(folder.c_str(), W_OK) != 0)
    throw InputError("--out " + out + ": " + folder.string() + " cannot be written to");
  if (!fs::exists(out, error)) return;
  try {
    load_machine(out);
  } catch (const InputError&) {
    throw InputError("--out " + out +
                     ": exists and is no machine file; it needs a new file or an earlier machine");
  }
}

}  // namespace vcnc
