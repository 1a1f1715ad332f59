// The derivatives of every effect: dual numbers against finite differences.
#include <gtest/gtest.h>

#include "tests/effects/contract.hpp"

namespace vcnc::contract_derivative_test {
namespace {

TEST(EffectContract, DerivativesAreThoseOfTheStep) {
  for_each_effect([]<class Effect>(std::type_identity<Effect>) {
    SCOPED_TRACE(std::string(Effect::text.name));
    check_derivative<Effect>();
  });
}

}  // namespace
}  // namespace vcnc::contract_derivative_test
