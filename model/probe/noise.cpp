#include "model/probe/noise.hpp"

#include <cmath>

#include "model/math.hpp"

namespace vcnc {
namespace {

constexpr std::uint32_t low32(std::uint64_t x) { return static_cast<std::uint32_t>(x); }
constexpr std::uint32_t high32(std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32); }

// Two uniform numbers in (0, 1), each the middle of one of 2^52 cells.
std::array<double, 2> uniform_pair(std::uint64_t seed, std::uint64_t stream,
                                   std::uint64_t counter) {
  const auto r = philox({low32(counter), high32(counter), low32(stream), high32(stream)},
                        {low32(seed), high32(seed)});
  const auto unit = [](std::uint32_t high, std::uint32_t low) {
    const std::uint64_t bits =
        (std::uint64_t{high} << 32 | low) >> 12;  // 52 bits: + 0.5 stays exact
    return (static_cast<double>(bits) + 0.5) * 0x1p-52;
  };
  return {unit(r[1], r[0]), unit(r[3], r[2])};
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> c,
                                    std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53} * c[0], b = std::uint64_t{0xCD9E8D57} * c[2];
    c = {high32(b) ^ c[1] ^ key[0], low32(b), high32(a) ^ c[3] ^ key[1], low32(a)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return c;
}

double uniform_noise(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  return uniform_pair(seed, stream, counter)[0];
}

std::array<double, 2> gaussian_noise(std::uint64_t seed, std::uint64_t stream,
                                     std::uint64_t counter) {
  const auto [a, b] = uniform_pair(seed, stream, counter);
  const double radius = std::sqrt(-2 * std::log(a)), angle = 2 * kPi * b;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace vcnc
