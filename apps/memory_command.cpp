#include "apps/memory_command.hpp"

#include <iostream>

#include "apps/memory_content.hpp"
#include "model/input_error.hpp"

namespace vcnc {

void memory_command(const std::string& folder) {
  const MemoryFolder memory(folder, false);
  try {
    std::cout << to_text(read_content(memory));
  } catch (const MemoryError& e) {
    throw InputError(e.what());
  }
}

void reset_command(const std::string& folder) {
  const MemoryFolder memory(folder, false);
  try {
    std::cout << to_text(read_content(memory));
    for (const char* owner : kMemoryOwners) SlotFiles(memory.path(), owner).save({});
  } catch (const MemoryError& e) {
    std::cout << e.what() << '\n';
    for (const char* owner : kMemoryOwners) SlotFiles(memory.path(), owner).create();
  }
  std::cout << "reset: nothing is latched any more, no program waits\n";
}

}  // namespace vcnc
