// How long a frame occupies the bus.
//
// Equation, 11-bit identifier, n data bytes, including the 3 bits of inter-frame space:
//   classical   T = (47 + 8n + s) / f_nom
//   CAN FD      T = (29 + s_a) / f_nom + (6 + 8n + c + s_d) / f_data,  c = 27 for n <= 16, else 32
// s: stuff bits over start of frame .. CRC;  s_a: over start of frame .. BRS;  s_d: over ESI ..
// data. The 29 are SOF, identifier, RRS, IDE, FDF, res (16), ACK and its delimiter (2), end of
// frame (7), space (3) and, as the rate switches inside BRS and inside the CRC delimiter, half of
// each. The CRC field of an FD frame (stuff count 4, CRC 17 or 21) carries 6 or 7 stuff bits at
// fixed places, which c contains; the first one also stands for a dynamic one that would be due
// after the last data bit. Worst case: s = (34 + 8n - 1) div 4, s_a = 3 (largest over all 2048
// identifiers), s_d = (8n + 8) div 4.
//
// Units: bit rates in bit/s, times in ns (rounded up to whole ns). Valid for data frames that are
// sent without error, error-active sender (ESI dominant), bit-rate switch on.
// Source: ISO 11898-1:2015, 10.4; Davis, Burns, Bril, Lukkien, Real-Time Systems 35 (2007) 239.
// Not modelled: error frames, clock tolerance, transceiver delay.
#pragma once

#include <cstdint>

#include "bus/frame.hpp"

namespace vcnc {

struct BitRates {
  double nominal = 1e6;  ///< arbitration phase and classical frames [bit/s]
  double data = 5e6;     ///< FD data phase [bit/s]
};

/// Bits of a frame by the rate they travel at.
struct FrameBits {
  int nominal = 0, data = 0;
};

FrameBits exact_bits(const Frame& frame);
FrameBits worst_bits(int len, bool fd);

std::int64_t duration_ns(FrameBits bits, const BitRates& rates);
inline std::int64_t exact_duration_ns(const Frame& frame, const BitRates& rates) {
  return duration_ns(exact_bits(frame), rates);
}
inline std::int64_t worst_duration_ns(int len, bool fd, const BitRates& rates) {
  return duration_ns(worst_bits(len, fd), rates);
}

}  // namespace vcnc
