// What an effect is: one thing that a real machine does besides what it was told, declared once.
//
// An effect is a plain struct in a file of its own under model/effects/ and a line in list.hpp.
// From these come its keys in a machine file with their ranges, `--inject`, `vcnc effects`, its
// place in the simulation, its page of the gallery and the contract tests. It holds
//
//   struct Backlash {
//     using Port = TransmissionPort;              // where it acts: ports.hpp
//     static constexpr Place place = Place::axis; // what it belongs to, and so its key
//     static constexpr EffectText text{...};      // name, equation, source, signature, ...
//     double gap = 0;                             // parameters, SI; the default is the null effect
//     static Backlash nominal(bool rotary);       // a typical size, for pictures and tests
//     bool null() const;                          // true: it does nothing, whatever the rest
//     template <class Self, class Visit>
//     static void fields(Self& p, Visit& visit, bool rotary);   // key, unit, range: fields.hpp
//     template <class T>                          // what it does; T is double or a dual number
//     void step(Port::Signal<T>& signal, const Port::Context<T>& context) const;
//   };
//
// `rotary` is there for Place::axis only, where one effect serves linear and rotary axes.
// An effect with memory declares `template <class T> struct State` and takes `State<T>&` as a third
// argument of step; one that needs its axis or random numbers takes a `const Seat&` last. A step is
// pure: it changes nothing but the signal and its state, and allocates nothing.
// Where several effects act at one port, they do so in the order of list.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "model/probe/noise.hpp"

namespace vcnc {

/// What an effect belongs to: the first part of its key.
enum class Place {
  axis,         ///< effects.X.name ... effects.C.name
  linear_axis,  ///< effects.X.name, Y, Z
  rotary_axis,  ///< effects.A.name, C
  geometry,     ///< effects.geometry.name
  probe,        ///< effects.probe.name
  setup,        ///< effects.setup.name
  nc            ///< effects.nc.name
};

constexpr bool of_axis(Place place) {
  return place == Place::axis || place == Place::linear_axis || place == Place::rotary_axis;
}
constexpr bool fits(Place place, bool rotary) {
  return place == Place::axis || place == (rotary ? Place::rotary_axis : Place::linear_axis);
}
/// The first part of the key of an effect that does not belong to an axis.
constexpr std::string_view key_of(Place place) {
  switch (place) {
    case Place::geometry:
      return "geometry";
    case Place::probe:
      return "probe";
    case Place::setup:
      return "setup";
    case Place::nc:
      return "nc";
    default:
      return "";
  }
}

/// The machine's subsystem an effect comes from.
enum class Family {
  servo,
  friction,
  mechanics,
  geometry,
  thermal,
  probe,
  acquisition,
  setup,
  bus,
  nc
};

constexpr std::string_view name_of(Family family) {
  constexpr std::string_view names[]{"servo", "friction",    "mechanics", "geometry", "thermal",
                                     "probe", "acquisition", "setup",     "bus",      "nc"};
  return names[static_cast<std::size_t>(family)];
}

/// The motion that shows an effect best.
enum class Showing {
  circle,        ///< in the ring gauge, counter-clockwise and clockwise: radial error over angle
  circle_feeds,  ///< the same at three feeds
  line,          ///< slow straight motion of the axis there and back: over position
  reversals,     ///< small reversals of one axis: over time
  standstill,    ///< the ball rests on the piece: over time
  spin,     ///< the rotary axis turns with the ball held still on the piece (RTCP): over its angle
  s_piece,  ///< one lap of the S piece: over the station
  corner    ///< a square in the plane: contour error over the path
};

/// Everything there is to say about an effect. Plain text; lines of at most 90 columns.
struct EffectText {
  std::string_view name;   ///< snake_case, unique; its key
  std::string_view title;  ///< "Backlash"
  Family family;
  std::string_view brief;       ///< one line: what it does
  std::string_view equation;    ///< with every symbol and its unit
  std::string_view validity;    ///< where it holds and what it leaves out
  std::string_view source;      ///< publication, standard or "own derivation"
  std::string_view signature;   ///< how it shows in the dynamic error, and how that scales
  std::string_view confusable;  ///< names of effects that look alike, separated by spaces
  std::string_view separate;    ///< what tells it from those
  Showing showing;              ///< what the gallery draws
};

/// Random numbers of one effect at one place, as pure functions of a counter.
class NoiseStream {
 public:
  NoiseStream() = default;
  /// `name` and `axis` make the stream, so that a new effect does not shift another's numbers.
  NoiseStream(std::uint64_t seed, std::string_view name, std::size_t axis);
  double gaussian(std::int64_t counter) const;  ///< standard normal
  double uniform(std::int64_t counter) const;   ///< in (0, 1)

 private:
  std::uint64_t seed_ = 0, stream_ = 0;
};

/// Where an effect sits in a simulation.
struct Seat {
  std::size_t axis = 0;  ///< of an axis effect
  bool rotary = false;
  NoiseStream noise;
};

}  // namespace vcnc
