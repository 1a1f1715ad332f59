#include "analysis/seal.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <vector>

namespace vcnc {
namespace {

constexpr std::array<char, 8> kMagic{'V', 'C', 'N', 'C', 'S', 'E', 'A', 'L'};
constexpr std::size_t kSealSize = 32;
using SealBytes = std::array<char, kSealSize>;

struct FreeState {
  void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
};

/// The seal of the first `size` bytes; nothing if they cannot be read.
std::optional<SealBytes> seal_for(std::ifstream& in, std::uint64_t size) {
  const std::unique_ptr<XXH3_state_t, FreeState> state(XXH3_createState());
  XXH3_128bits_reset(state.get());
  std::vector<char> block(1 << 20);
  for (std::uint64_t left = size; left > 0;) {
    const auto next = static_cast<std::streamsize>(std::min<std::uint64_t>(left, block.size()));
    if (!in.read(block.data(), next)) return std::nullopt;
    XXH3_128bits_update(state.get(), block.data(), static_cast<std::size_t>(next));
    left -= static_cast<std::uint64_t>(next);
  }
  XXH128_canonical_t hash;
  XXH128_canonicalFromHash(&hash, XXH3_128bits_digest(state.get()));
  SealBytes seal{};
  for (std::size_t i = 0; i < 8; ++i) seal[i] = static_cast<char>(size >> (8 * i) & 0xff);
  std::copy(std::begin(hash.digest), std::end(hash.digest), seal.begin() + 8);
  std::copy(kMagic.begin(), kMagic.end(), seal.begin() + 24);
  return seal;
}

}  // namespace

bool put_seal(const std::filesystem::path& path) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) return false;
  std::ifstream in(path, std::ios::binary);
  const auto seal = seal_for(in, size);
  if (!seal) return false;
  std::ofstream out(path, std::ios::binary | std::ios::app);
  out.write(seal->data(), kSealSize);
  out.close();
  return !out.fail();
}

Seal seal_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error || size < kSealSize) return Seal::none;
  std::ifstream in(path, std::ios::binary);
  SealBytes found{};
  in.seekg(static_cast<std::streamoff>(size - kSealSize));
  if (!in.read(found.data(), kSealSize) ||
      !std::equal(kMagic.begin(), kMagic.end(), found.begin() + 24))
    return Seal::none;
  in.seekg(0);
  return seal_for(in, size - kSealSize) == found ? Seal::intact : Seal::broken;
}

}  // namespace vcnc
