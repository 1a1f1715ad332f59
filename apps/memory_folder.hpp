// The folder of --memory: what the machine keeps while it is switched off.
//
//   memory.txt            says that the folder is one; written last when it is made
//   nc.0       nc.1       the NC unit's record (controller/nc_record.hpp)
//   spindle.0  spindle.1  the latch of the spindle's lock (servo_sim/spindle_node.hpp)
//   overtravel.0 .1       the latch of the overtravel module (probe_sim/overtravel_node.hpp)
//   data.0     data.1     offsets, parameters and tools (controller/gcode/nc_data.hpp)
//
// Two slots for each module, written in turn (bus/memory_slot.hpp): overwritten in place, then
// fsync. Whoever starts a machine holds a lock on the folder; the modules' programs open their own
// files in it.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/fd.hpp"
#include "bus/node_memory.hpp"

namespace vcnc {

/// The two slots of one module as files.
class SlotFiles : public NodeMemory {
 public:
  SlotFiles(std::filesystem::path folder, std::string module);

  std::vector<std::uint8_t> load() override;
  void save(std::span<const std::uint8_t> state) override;

  /// Makes both anew, with nothing in them.
  void create();

 private:
  std::filesystem::path file(std::size_t slot) const;
  void write(std::size_t slot, std::span<const std::uint8_t> bytes) const;

  std::filesystem::path folder_;
  std::string module_;
};

inline constexpr std::array kMemoryOwners{"nc", "spindle", "overtravel", "data"};
/// Of them, what the operator's reset opens.
inline constexpr std::array kLatchOwners{"nc", "spindle", "overtravel"};

class MemoryFolder {
 public:
  /// Opens a memory for this program alone, and makes one where `create` and the folder is new or
  /// empty. Throws InputError naming the folder.
  MemoryFolder(const std::string& path, bool create);

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  Fd lock_;
};

}  // namespace vcnc
