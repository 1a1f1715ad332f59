#include "apps/memory_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "bus/memory_slot.hpp"
#include "model/input_error.hpp"

namespace vcnc {

namespace fs = std::filesystem;

namespace {

constexpr const char* kMarkName = "memory.txt";
constexpr const char* kMemoryMark =
    "What a vcnc machine keeps while it is off. See vcnc memory --help.\n";

std::vector<std::uint8_t> bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Overwrites a file in place and waits until the disk has it. False, with errno.
bool write_durably(const fs::path& path, std::span<const std::uint8_t> bytes) {
  const Fd file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
  if (!file.valid()) return false;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote = ::write(file.get(), bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    done += static_cast<std::size_t>(wrote);
  }
  return ::ftruncate(file.get(), static_cast<off_t>(bytes.size())) == 0 && ::fsync(file.get()) == 0;
}

bool sync_folder(const fs::path& path) {
  const Fd folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return folder.valid() && ::fsync(folder.get()) == 0;
}

/// Nothing but what a creation that was interrupted leaves.
bool may_become_memory(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    bool ours = false;
    for (const char* owner : kMemoryOwners)
      for (const char* slot : {".0", ".1"})
        ours = ours || entry.path().filename() == std::string(owner) + slot;
    if (!ours) return false;
  }
  return true;
}

void create_memory(const fs::path& folder) {
  for (const char* owner : kMemoryOwners) SlotFiles(folder, owner).create();
  const std::string_view mark(kMemoryMark);
  if (!sync_folder(folder) ||
      !write_durably(folder / kMarkName,
                     {reinterpret_cast<const std::uint8_t*>(mark.data()), mark.size()}) ||
      !sync_folder(folder))
    throw InputError(folder.string() + ": cannot be written: " + std::strerror(errno));
}

}  // namespace

SlotFiles::SlotFiles(fs::path folder, std::string module)
    : folder_(std::move(folder)), module_(std::move(module)) {}

fs::path SlotFiles::file(std::size_t slot) const {
  return folder_ / fmt::format("{}.{}", module_, slot);
}

void SlotFiles::write(std::size_t slot, std::span<const std::uint8_t> bytes) const {
  if (!write_durably(file(slot), bytes))
    throw MemoryError(file(slot).string() + ": cannot be written: " + std::strerror(errno));
}

std::vector<std::uint8_t> SlotFiles::load() {
  SlotChoice choice = newest_slot(bytes_of(file(0)), bytes_of(file(1)));
  if (choice.newest) return std::move(choice.newest->state);
  throw MemoryError(fmt::format(
      "{} {} and {} {}: nobody knows whether the machine was locked; look at the machine, then "
      "clear its memory with `vcnc reset {}`",
      file(0).string(), choice.why[0], file(1).string(), choice.why[1], folder_.string()));
}

void SlotFiles::save(std::span<const std::uint8_t> state) {
  const SlotChoice choice = newest_slot(bytes_of(file(0)), bytes_of(file(1)));
  const std::uint64_t sequence = choice.newest ? choice.newest->sequence + 1 : 0;
  write(choice.write_to, encode_slot({sequence, {state.begin(), state.end()}}));
}

void SlotFiles::create() {
  write(0, encode_slot({0, {}}));
  write(1, encode_slot({1, {}}));
}

MemoryFolder::MemoryFolder(const std::string& path, bool create) {
  if (path.empty()) throw InputError("--memory: is empty; it needs a folder");
  const fs::path folder = fs::absolute(path);
  path_ = folder.string();
  std::error_code error;
  if (create && !fs::exists(folder, error)) fs::create_directories(folder, error);
  if (error) throw InputError(path_ + ": cannot be created: " + error.message());
  if (!fs::is_directory(folder, error))
    throw InputError(path_ + ": is not a folder that holds a machine's memory");
  lock_ = Fd(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock_.valid() || ::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError(path_ + ": a machine is running with this memory");
  if (fs::exists(folder / kMarkName, error)) return;
  if (!create || !may_become_memory(folder))
    throw InputError(path_ + (create ? ": holds other files; --memory needs a new or empty folder, "
                                       "or a machine's memory"
                                     : ": is not the memory of a machine (vcnc run --memory)"));
  create_memory(folder);
}

}  // namespace vcnc
