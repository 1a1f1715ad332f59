#include "diagnosis/fit/ground.hpp"

namespace vcnc {

Ground::Ground(const Evidence& evidence, const Column& residual, const LinearPart& linear)
    : columns{&residual}, precision(linear.precision()), offset(linear.offset()) {
  for (const Column& c : linear.columns) columns.push_back(&c);
  grams = evidence.products(columns);
  const LinearStep at = linear_step(grams.fitted, grams.held_out, precision, offset);
  step = at.step;
  fitted = at.fitted;
  held_out = at.held_out;
  held_out_of = left_after(grams.held_out_of, at.step);
}

}  // namespace vcnc
