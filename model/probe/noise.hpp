// Random numbers as pure functions of (seed, stream, counter): no state, nothing to share.
//
// Philox 4x32-10, a counter-based generator with the seed as key: Salmon et al., Parallel Random
// Numbers: As Easy as 1, 2, 3 (SC 2011). Uniform numbers take 52 bits; Gaussian ones follow by the
// Box-Muller formula. A stream belongs to one source of noise, so that a new source does not shift
// the numbers of another.
#pragma once

#include <array>
#include <cstdint>

namespace vcnc {

/// The bare block function.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key);

/// Uniform in the open interval (0, 1).
double uniform_noise(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);

/// Two independent standard normal numbers.
std::array<double, 2> gaussian_noise(std::uint64_t seed, std::uint64_t stream,
                                     std::uint64_t counter);

}  // namespace vcnc
