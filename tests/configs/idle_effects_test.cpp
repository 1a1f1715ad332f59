#include "configs/idle_effects.hpp"

#include <gtest/gtest.h>

#include "configs/config.hpp"

namespace vcnc::idle_effects_test {
namespace {

std::string idle(const std::string& effects, const std::string& setup = "piece = \"p.toml\"") {
  std::string text;
  for (const std::string& one :
       idle_effects(parse_machine("[setup]\n" + setup + "\n[effects]\n" + effects, "test")))
    text += one + "\n";
  return text;
}

bool names(const std::string& text, const char* what) {
  return text.find(what) != std::string::npos;
}

TEST(IdleEffects, WhatShapesFrictionNeedsFriction) {
  for (const char* one : {"presliding.stiffness_N_per_um=25", "friction_zone.height_percent=50",
                          "friction_asymmetry.dry_percent=10", "friction_fade.share_percent=20"}) {
    const std::string effect = std::string(one).substr(0, std::string(one).find('.'));
    EXPECT_TRUE(names(idle("X." + std::string(one)), ("effects.X." + effect + ": does").c_str()))
        << one << ": " << idle("X." + std::string(one));
    EXPECT_EQ(idle("X." + std::string(one) + "\nX.coulomb.level_N=50"), "") << one;
    EXPECT_NE(idle("X." + std::string(one) + "\nY.coulomb.level_N=50"), "") << "of another axis";
  }
  EXPECT_EQ(idle("X.friction_asymmetry.viscous_percent=10\nX.viscous.coefficient_Ns_per_m=9"), "");
  EXPECT_NE(idle("X.friction_asymmetry.viscous_percent=10\nX.coulomb.level_N=50"), "");
}

TEST(IdleEffects, BacklashBehindAScaleOnTheLoadNeedsFriction) {
  EXPECT_TRUE(names(idle("Y.backlash.gap_um=10"), "effects.Y.backlash: hardly shows"));
  EXPECT_EQ(idle("Y.backlash.gap_um=10\nY.coulomb.level_N=50"), "");
  EXPECT_EQ(idle("Y.backlash.gap_um=10\n[axes.Y]\nfeedback=\"motor\""), "");
}

TEST(IdleEffects, AContactNeedsAPiece) {
  EXPECT_TRUE(names(idle("probe.surface_friction.coefficient=0.1", ""), "no piece to touch"))
      << idle("probe.surface_friction.coefficient=0.1", "");
  EXPECT_EQ(idle("probe.surface_friction.coefficient=0.1"), "");
}

TEST(IdleEffects, NothingIsSaidOfNothing) { EXPECT_EQ(idle("", ""), ""); }

}  // namespace
}  // namespace vcnc::idle_effects_test
