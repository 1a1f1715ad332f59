// All ports, in the order in which a set-point becomes a reading.
#pragma once

#include <type_traits>

#include "model/effects/ports.hpp"

namespace vcnc {

template <class... Port>
struct PortList {
  template <class P>
  static constexpr bool contains = (std::is_same_v<P, Port> || ...);
};

using AllPorts =
    PortList<PlanPort, InterpolationPort, ReceptionPort, SetpointPort, ServoPort, EncoderPort,
             MotorForcePort, TransmissionPort, LoadForcePort, FrictionPort, DisplacementPort,
             PosePort, TouchPort, DeflectionPort, AnaloguePort, ReadingPort>;

/// Calls f(std::type_identity<Port>()) for every port, in order.
template <class F, class... Port>
void for_each_port(PortList<Port...>, F&& f) {
  (f(std::type_identity<Port>()), ...);
}
template <class F>
void for_each_port(F&& f) {
  for_each_port(AllPorts(), f);
}

}  // namespace vcnc
