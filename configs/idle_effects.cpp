#include "configs/idle_effects.hpp"

#include <fmt/format.h>

#include <type_traits>

namespace vcnc {
namespace {

void look_at_axis(const Machine& machine, std::size_t axis, std::vector<std::string>& idle) {
  const AxisEffects& e = machine.effects.axis[axis];
  const auto say = [&](const auto& effect, const char* why) {
    idle.push_back(fmt::format("effects.{}.{}: {}", kAxisNames[axis], effect.text.name, why));
  };
  const bool dry =
      !e.get<Coulomb>().null() || !e.get<Stribeck>().null() || !e.get<GreaseDrag>().null();
  const bool viscous = !e.get<Viscous>().null() || !e.get<NonlinearViscous>().null();
  const auto needs_dry = [&](const auto& effect) {
    if (!effect.null() && !dry)
      say(effect, "does nothing, the axis has no dry friction (coulomb, stribeck, grease_drag)");
  };
  needs_dry(e.get<Presliding>());
  needs_dry(e.get<FrictionZone>());
  needs_dry(e.get<FrictionFade>());
  if (const auto& a = e.get<FrictionAsymmetry>();
      !a.null() && !(a.dry != 0 && dry) && !(a.viscous != 0 && viscous))
    say(a, "does nothing, the axis has no friction of the kind that it makes uneven");
  if (const auto& b = e.get<Backlash>();
      !b.null() && !dry && machine.axes[axis].servo.feedback == ServoParams::Feedback::load)
    say(b,
        "hardly shows, the measuring system is on the load (feedback = \"load\") and no friction "
        "holds the load back");
}

}  // namespace

std::vector<std::string> idle_effects(const Machine& machine) {
  std::vector<std::string> idle;
  for (std::size_t i = 0; i < kAxisCount; ++i) look_at_axis(machine, i, idle);
  if (!machine.setup.piece.empty()) return idle;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if constexpr (std::is_same_v<typename Effect::Port, TouchPort>) {
      if (!machine.effects.get<Effect>().null())
        idle.push_back(
            fmt::format("effects.{}.{}: does nothing, there is no piece to touch "
                        "(setup.piece)",
                        key_of(Effect::place), Effect::text.name));
    }
  });
  return idle;
}

}  // namespace vcnc
