// A dual number: value and derivative, to check the derivatives of effects.
//
// As Eigen::AutoDiffScalar with one derivative, but T{} is zero with a zero derivative (that one
// leaves both uninitialised, so also every state), and it knows floor, round and the like.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace vcnc {

struct Dual {
  double v = 0, d = 0;

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT: constants mix with duals
  Dual(double value, double derivative) : v(value), d(derivative) {}

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }
  Dual operator-() const { return {-v, -d}; }
  Dual operator+() const { return *this; }

  friend Dual operator+(const Dual& a, const Dual& b) { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    return {a.v / b.v, (a.d - a.v / b.v * b.d) / b.v};
  }
  friend bool operator==(const Dual& a, const Dual& b) { return a.v == b.v; }
  friend auto operator<=>(const Dual& a, const Dual& b) { return a.v <=> b.v; }

  friend Dual sin(const Dual& x) { return {std::sin(x.v), x.d * std::cos(x.v)}; }
  friend Dual cos(const Dual& x) { return {std::cos(x.v), -x.d * std::sin(x.v)}; }
  friend Dual tan(const Dual& x) { return {std::tan(x.v), x.d / (std::cos(x.v) * std::cos(x.v))}; }
  friend Dual asin(const Dual& x) { return {std::asin(x.v), x.d / std::sqrt(1 - x.v * x.v)}; }
  friend Dual acos(const Dual& x) { return {std::acos(x.v), -x.d / std::sqrt(1 - x.v * x.v)}; }
  friend Dual atan(const Dual& x) { return {std::atan(x.v), x.d / (1 + x.v * x.v)}; }
  friend Dual atan2(const Dual& y, const Dual& x) {
    return {std::atan2(y.v, x.v), (y.d * x.v - y.v * x.d) / (x.v * x.v + y.v * y.v)};
  }
  friend Dual tanh(const Dual& x) {
    const double t = std::tanh(x.v);
    return {t, x.d * (1 - t * t)};
  }
  friend Dual exp(const Dual& x) { return {std::exp(x.v), x.d * std::exp(x.v)}; }
  friend Dual expm1(const Dual& x) { return {std::expm1(x.v), x.d * std::exp(x.v)}; }
  friend Dual log(const Dual& x) { return {std::log(x.v), x.d / x.v}; }
  friend Dual log1p(const Dual& x) { return {std::log1p(x.v), x.d / (1 + x.v)}; }
  friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.v);
    return {root, x.d == 0 ? 0 : x.d / (2 * root)};
  }
  friend Dual hypot(const Dual& x, const Dual& y) {
    const double r = std::hypot(x.v, y.v);
    return {r, (x.v * x.d + y.v * y.d) / r};
  }
  friend Dual pow(const Dual& x, double n) {
    return {std::pow(x.v, n), x.d == 0 ? 0 : x.d * n * std::pow(x.v, n - 1)};
  }
  friend Dual pow(const Dual& x, const Dual& n) { return exp(n * log(x)); }
  friend Dual abs(const Dual& x) { return x.v < 0 ? -x : x; }
  friend Dual fabs(const Dual& x) { return abs(x); }
  friend Dual copysign(const Dual& x, const Dual& sign) {
    return std::signbit(x.v) == std::signbit(sign.v) ? x : -x;
  }
  friend Dual floor(const Dual& x) { return std::floor(x.v); }
  friend Dual ceil(const Dual& x) { return std::ceil(x.v); }
  friend Dual round(const Dual& x) { return std::round(x.v); }
  friend Dual trunc(const Dual& x) { return std::trunc(x.v); }
  friend Dual fmod(const Dual& x, const Dual& y) {
    return {std::fmod(x.v, y.v), x.d - y.d * std::trunc(x.v / y.v)};
  }
  friend bool isfinite(const Dual& x) { return std::isfinite(x.v) && std::isfinite(x.d); }
};

}  // namespace vcnc

namespace Eigen {
template <>
struct NumTraits<vcnc::Dual> : NumTraits<double> {
  using Real = vcnc::Dual;
  using NonInteger = vcnc::Dual;
  using Nested = vcnc::Dual;
  enum { RequireInitialization = 1, ReadCost = 2, AddCost = 2, MulCost = 4 };
};
template <class Operation>
struct ScalarBinaryOpTraits<vcnc::Dual, double, Operation> {
  using ReturnType = vcnc::Dual;
};
template <class Operation>
struct ScalarBinaryOpTraits<double, vcnc::Dual, Operation> {
  using ReturnType = vcnc::Dual;
};
}  // namespace Eigen
