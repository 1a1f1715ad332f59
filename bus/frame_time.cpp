#include "bus/frame_time.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vcnc {

namespace {

/// Bit stuffing: after five equal bits one complementary bit is inserted. State: the last bit and
/// the length (1..4) of the run it ends, coded 4 * bit + length - 1.
struct Step {
  std::uint8_t stuffed = 0;  ///< bits inserted
  std::uint8_t state = 0;
  bool ends_stuffed = false;  ///< the last one was inserted behind the last bit
};

constexpr Step push_bit(std::uint8_t state, bool bit) {
  const bool last = state >= 4;
  const int run = bit == last ? state % 4 + 2 : 1;
  if (run < 5) return {0, static_cast<std::uint8_t>(4 * bit + run - 1), false};
  return {1, static_cast<std::uint8_t>(4 * !bit), true};  // the inserted bit begins a run of one
}

constexpr Step push_bits(std::uint8_t state, unsigned bits, int count) {
  Step all{0, state, false};
  for (int i = count - 1; i >= 0; --i) {
    const Step one = push_bit(all.state, (bits >> i & 1) != 0);
    all = {static_cast<std::uint8_t>(all.stuffed + one.stuffed), one.state, one.ends_stuffed};
  }
  return all;
}

using ByteTable = std::array<std::array<Step, 256>, 8>;

constexpr ByteTable make_byte_table() {
  ByteTable table{};
  for (unsigned state = 0; state < 8; ++state)
    for (unsigned byte = 0; byte < 256; ++byte)
      table[state][byte] = push_bits(static_cast<std::uint8_t>(state), byte, 8);
  return table;
}
constexpr ByteTable kByte = make_byte_table();

/// CRC-15 of classical CAN, x^15+x^14+x^10+x^8+x^7+x^4+x^3+1.
constexpr unsigned kPolynomial = 0x4599;

constexpr std::array<std::uint16_t, 256> make_crc_table() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << 7;
    for (int i = 0; i < 8; ++i) crc = (crc << 1) ^ ((crc & 0x4000) ? kPolynomial : 0);
    table[byte] = static_cast<std::uint16_t>(crc & 0x7fff);
  }
  return table;
}
constexpr auto kCrc = make_crc_table();

constexpr unsigned crc_byte(unsigned crc, unsigned byte) {
  return ((crc << 8) ^ kCrc[(crc >> 7 ^ byte) & 0xff]) & 0x7fff;
}

constexpr std::uint8_t kOneDominant = 0;   // state after a single 0 (start of frame)
constexpr std::uint8_t kOneRecessive = 4;  // state after a single 1 (BRS)

unsigned dlc(int len) {
  if (len <= 8) return static_cast<unsigned>(len);
  return static_cast<unsigned>(len <= 24 ? 9 + (len - 12) / 4 : 13 + (len - 32) / 16);
}

/// Stuff bits in SOF, identifier, RRS = 0, IDE = 0, FDF = 1, res = 0, BRS = 1, by identifier.
constexpr std::array<std::uint8_t, 2048> make_arbitration_table() {
  std::array<std::uint8_t, 2048> table{};
  for (unsigned id = 0; id < 2048; ++id)
    table[id] = push_bits(kOneDominant, id << 5 | 0b00101, 16).stuffed;
  return table;
}
constexpr auto kArbitration = make_arbitration_table();

FrameBits classical(const Frame& frame) {
  // identifier, RTR, IDE, r0, DLC: 18 bits
  const unsigned header = unsigned{frame.id} << 7 | dlc(frame.len);
  Step step = push_bits(kOneDominant, header, 18);
  int stuffed = step.stuffed;
  unsigned crc = 0;  // the leading zeros that fill up the 19 header bits do not change it
  for (int shift = 16; shift >= 0; shift -= 8) crc = crc_byte(crc, header >> shift & 0xff);
  for (const std::uint8_t byte : frame.payload()) {
    step = kByte[step.state][byte];
    stuffed += step.stuffed;
    crc = crc_byte(crc, byte);
  }
  stuffed += push_bits(step.state, crc, 15).stuffed;
  return {47 + 8 * frame.len + stuffed, 0};
}

int fd_crc_bits(int len) { return len <= 16 ? 27 : 32; }

FrameBits flexible(const Frame& frame) {
  Step step = push_bits(kOneRecessive, dlc(frame.len), 5);  // ESI = 0, DLC
  int stuffed = step.stuffed;
  for (const std::uint8_t byte : frame.payload()) {
    step = kByte[step.state][byte];
    stuffed += step.stuffed;
  }
  if (step.ends_stuffed) --stuffed;  // the first fixed stuff bit of the CRC field stands for it
  return {29 + kArbitration[frame.id & 0x7ff],
          6 + 8 * frame.len + fd_crc_bits(frame.len) + stuffed};
}

}  // namespace

FrameBits exact_bits(const Frame& frame) { return frame.fd ? flexible(frame) : classical(frame); }

FrameBits worst_bits(int len, bool fd) {
  if (!fd) return {47 + 8 * len + (34 + 8 * len - 1) / 4, 0};
  return {29 + 3, 6 + 8 * len + fd_crc_bits(len) + (8 * len + 8) / 4};
}

std::int64_t duration_ns(FrameBits bits, const BitRates& rates) {
  return static_cast<std::int64_t>(
      std::ceil(bits.nominal * (1e9 / rates.nominal) + bits.data * (1e9 / rates.data) - 1e-6));
}

}  // namespace vcnc
