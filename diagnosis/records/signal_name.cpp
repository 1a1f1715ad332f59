#include "diagnosis/records/signal_name.hpp"

#include <array>
#include <utility>

namespace vcnc {

namespace {

constexpr std::array<std::pair<SignalKind, std::string_view>, 14> kKindNames{{
    {SignalKind::command, "command"},
    {SignalKind::position, "position"},
    {SignalKind::twist, "twist"},
    {SignalKind::velocity, "velocity"},
    {SignalKind::force, "force"},
    {SignalKind::applied_force, "applied force"},
    {SignalKind::added_force, "added force"},
    {SignalKind::deflection, "deflection"},
    {SignalKind::bar, "ball bar"},
    {SignalKind::tool_position, "tool position"},
    {SignalKind::cosine, "cosine"},
    {SignalKind::sine, "sine"},
    {SignalKind::temperature, "temperature"},
    {SignalKind::clock, "clock"},
}};

}  // namespace

std::string_view to_string(SignalKind kind) {
  for (const auto& [known, name] : kKindNames)
    if (known == kind) return name;
  return "";
}

std::optional<SignalKind> signal_kind(std::string_view name) {
  for (const auto& [kind, known] : kKindNames)
    if (known == name) return kind;
  return std::nullopt;
}

std::string signal_name(SignalKind kind, std::size_t axis) {
  if (kind == SignalKind::temperature || kind == SignalKind::clock || kind == SignalKind::bar)
    return std::string(to_string(kind));
  const bool own_frame = kind == SignalKind::deflection || kind == SignalKind::tool_position ||
                         kind == SignalKind::cosine || kind == SignalKind::sine;
  const std::string place = own_frame ? std::string(1, static_cast<char>('x' + axis % 3))
                                      : std::string(kAxisNames.at(axis));
  return std::string(to_string(kind)) + " " + place;
}

}  // namespace vcnc
