#include "model/effects/effect.hpp"

namespace vcnc {

NoiseStream::NoiseStream(std::uint64_t seed, std::string_view name, std::size_t axis)
    : seed_(seed), stream_(14695981039346656037ull) {
  // FNV-1a over the name and the axis.
  const auto mix = [&](std::uint64_t byte) { stream_ = (stream_ ^ byte) * 1099511628211ull; };
  for (const char c : name) mix(static_cast<unsigned char>(c));
  mix(axis);
}

double NoiseStream::gaussian(std::int64_t counter) const {
  return gaussian_noise(seed_, stream_, static_cast<std::uint64_t>(counter))[0];
}

double NoiseStream::uniform(std::int64_t counter) const {
  return uniform_noise(seed_, stream_, static_cast<std::uint64_t>(counter));
}

}  // namespace vcnc
