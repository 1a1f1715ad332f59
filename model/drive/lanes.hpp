// Several numbers that go through the same computation side by side.
//
// A model written for a number type Real, with choose() where it would branch, runs with
// Real = double for one case and with Real = Lanes for kLanes cases at a time, each of which comes
// to the same bits as alone. Pairs are what every 64-bit processor computes at once; several of
// them hide its latency.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace vcnc {

inline constexpr std::size_t kLanes = 8;

class Lanes {
 public:
  using Pair = double __attribute__((vector_size(16)));
  using Bits = std::int64_t __attribute__((vector_size(16)));
  static constexpr std::size_t kPairs = kLanes / 2;

  /// Of a comparison: all bits of a lane set, or none.
  struct Mask {
    Bits part[kPairs];

    friend bool any(const Mask& m) {
      Bits bits = m.part[0];
      for (std::size_t i = 1; i < kPairs; ++i) bits |= m.part[i];
      return (bits[0] | bits[1]) != 0;
    }
    friend bool all(const Mask& m) {
      Bits bits = m.part[0];
      for (std::size_t i = 1; i < kPairs; ++i) bits &= m.part[i];
      return (bits[0] & bits[1]) != 0;
    }
  };

  Lanes() : Lanes(0.0) {}
  Lanes(double x) {  // the same in all
    for (Pair& p : part_) p = Pair{x, x};
  }

  /// f(0), f(1), ...
  template <class F>
  static Lanes of(F&& f) {
    Lanes r;
    for (std::size_t i = 0; i < kPairs; ++i) r.part_[i] = Pair{f(2 * i), f(2 * i + 1)};
    return r;
  }

  double get(std::size_t lane) const { return part_[lane / 2][lane % 2]; }
  void set(std::size_t lane, double x) { part_[lane / 2][lane % 2] = x; }

  Lanes& operator+=(const Lanes& b) { return *this = *this + b; }
  Lanes& operator-=(const Lanes& b) { return *this = *this - b; }

  friend Lanes operator-(const Lanes& a) {
    return map(a, a, [](Pair x, Pair) { return -x; });
  }
  friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return map(a, b, [](Pair x, Pair y) { return x + y; });
  }
  friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return map(a, b, [](Pair x, Pair y) { return x - y; });
  }
  friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return map(a, b, [](Pair x, Pair y) { return x * y; });
  }
  friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return map(a, b, [](Pair x, Pair y) { return x / y; });
  }
  friend Mask operator<(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](Pair x, Pair y) { return x < y; });
  }
  friend Mask operator>(const Lanes& a, const Lanes& b) { return b < a; }
  friend Mask operator>=(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](Pair x, Pair y) { return x >= y; });
  }
  friend Mask operator==(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](Pair x, Pair y) { return x == y; });
  }

  friend Lanes choose(const Mask& m, const Lanes& yes, const Lanes& no) {
    Lanes r;
    for (std::size_t i = 0; i < kPairs; ++i)
      r.part_[i] = reinterpret_cast<Pair>((reinterpret_cast<Bits>(yes.part_[i]) & m.part[i]) |
                                          (reinterpret_cast<Bits>(no.part_[i]) & ~m.part[i]));
    return r;
  }
  friend Lanes abs(const Lanes& a) {
    return map(a, a, [](Pair x, Pair) {
      return reinterpret_cast<Pair>(reinterpret_cast<Bits>(x) & ~sign_bit());
    });
  }
  friend Lanes copysign(const Lanes& size, const Lanes& sign) {
    return map(size, sign, [](Pair x, Pair y) {
      return reinterpret_cast<Pair>((reinterpret_cast<Bits>(x) & ~sign_bit()) |
                                    (reinterpret_cast<Bits>(y) & sign_bit()));
    });
  }
  friend Lanes max(const Lanes& a, const Lanes& b) { return choose(a < b, b, a); }
  friend Lanes min(const Lanes& a, const Lanes& b) { return choose(b < a, b, a); }

 private:
  static Bits sign_bit() { return Bits{INT64_MIN, INT64_MIN}; }
  template <class F>
  static Lanes map(const Lanes& a, const Lanes& b, F f) {
    Lanes r;
    for (std::size_t i = 0; i < kPairs; ++i) r.part_[i] = f(a.part_[i], b.part_[i]);
    return r;
  }
  template <class F>
  static Mask compare(const Lanes& a, const Lanes& b, F f) {
    Mask m;
    for (std::size_t i = 0; i < kPairs; ++i) m.part[i] = f(a.part_[i], b.part_[i]);
    return m;
  }

  Pair part_[kPairs];
};

// The same words for one number.
inline double choose(bool yes, double a, double b) { return yes ? a : b; }
inline bool any(bool b) { return b; }
inline bool all(bool b) { return b; }

template <class Real>
inline constexpr std::size_t kLanesOf = 1;
template <>
inline constexpr std::size_t kLanesOf<Lanes> = kLanes;

inline double lane(double x, std::size_t) { return x; }
inline double lane(const Lanes& x, std::size_t i) { return x.get(i); }
inline void set_lane(double& x, std::size_t, double value) { x = value; }
inline void set_lane(Lanes& x, std::size_t i, double value) { x.set(i, value); }

/// One of something per lane.
template <class Real, class T>
using PerLane = std::array<T, kLanesOf<Real>>;

/// A number of each, as one: what was just written one by one is read one by one, since a pair of
/// it would wait for both.
template <class T>
double packed(const PerLane<double, T>& each, double T::*number) {
  return each[0].*number;
}
template <class T>
Lanes packed(const PerLane<Lanes, T>& each, double T::*number) {
  return Lanes::of([&](std::size_t i) { return each[i].*number; });
}

}  // namespace vcnc
