#include "bus/telemetry.hpp"

#include <cstddef>

namespace vcnc {

// In the order of the members of TelemetryRow. One tick is one cycle of 1 ms, so the tick reads as
// milliseconds.
const std::array<Channel, kRowWidth> kChannels{{
    {"tick", "ms"},          {"line", "1"},         {"state", "1"},
    {"feed", "m/s"},         {"q_cmd.X", "m"},      {"q_cmd.Y", "m"},
    {"q_cmd.Z", "m"},        {"q_cmd.A", "rad"},    {"q_cmd.C", "rad"},
    {"q_act.X", "m"},        {"q_act.Y", "m"},      {"q_act.Z", "m"},
    {"q_act.A", "rad"},      {"q_act.C", "rad"},    {"q_second.X", "m"},
    {"q_second.Y", "m"},     {"q_second.Z", "m"},   {"q_second.A", "rad"},
    {"q_second.C", "rad"},   {"force.X", "1"},      {"force.Y", "1"},
    {"force.Z", "1"},        {"force.A", "1"},      {"force.C", "1"},
    {"deflection.x", "m"},   {"deflection.y", "m"}, {"deflection.z", "m"},
    {"adc.x_cos", "code"},   {"adc.x_sin", "code"}, {"adc.y_cos", "code"},
    {"adc.y_sin", "code"},   {"adc.z_cos", "code"}, {"adc.z_sin", "code"},
    {"probe_flags", "bits"}, {"overtravel", "1"},   {"spindle_speed", "rad/s"},
    {"bus_load", "1"},
}};

static_assert(offsetof(TelemetryRow, q_act) / sizeof(double) == 9);
static_assert(offsetof(TelemetryRow, deflection) / sizeof(double) == 24);
static_assert(offsetof(TelemetryRow, bus_load) / sizeof(double) == kRowWidth - 1);

}  // namespace vcnc
